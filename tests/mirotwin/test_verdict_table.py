"""One failure of each kind through every command that takes it: the same verdict and the same words."""

import contextlib

import pytest

from mirotwin.shell.verdicts import VERDICTS
from tests.mirotwin import verdict_table
from tests.mutants.sdcc import needs_sdcc

pytest.importorskip("pyarrow")
KINDS = [kind for kind in verdict_table.KINDS if kind != "rule"]


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    with contextlib.chdir(tmp_path_factory.mktemp("table")):
        return list(verdict_table.table())


def check(rows, verdict):
    """`verdict`: that of all of them, in the words of each command."""
    assert len(rows) > 1
    assert {row.verdict for row in rows} <= {verdict, VERDICTS[verdict].junit, ""}, "\n".join(map(str, rows))
    assert len({row.words for row in rows}) == 1, "\n".join(map(str, rows))


@pytest.mark.parametrize("kind", KINDS)
def test_every_command_gives_a_failure_the_same_verdict_and_words(rows, kind):
    check(
        [row for row in rows if row.kind == kind],
        "fault" if kind in ("fault", "bare processor") else "failed",
    )


@needs_sdcc
@pytest.mark.slow
def test_a_broken_rule_is_the_same_in_the_twin_at_a_port_and_as_a_case(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    check(list(verdict_table.rule()), "failed")
