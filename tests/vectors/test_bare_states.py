"""Runs of images without a robot end as they always did (`bare_states.json`)."""

import json

import pytest

from tests import children
from tests.vectors.bare_states import GOLDEN, SHORT, end, names

ENDS = json.loads(GOLDEN.read_text())


@pytest.mark.parametrize("name", ENDS)
def test_a_bare_run_ends_as_it_always_did(name):
    assert end(name) == ENDS[name]


@pytest.mark.parametrize("name", SHORT)
def test_uncompiled_it_ends_so_too(name):
    code = f"import json; from tests.vectors.bare_states import end; print(json.dumps(end({name!r})))"
    assert json.loads(children.uncompiled(code)) == ENDS[name]


def test_each_of_them_is_frozen():
    assert list(ENDS) == names()
