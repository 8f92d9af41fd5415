"""Keys of parts: each can be read from a file, in both engines."""

import msgspec
import pytest

from miro_sim.scenario.parts import PARTS


@pytest.mark.parametrize("name", PARTS.own)
def test_a_file_can_give_the_keys_of_each_part(name):
    # The schema needs every annotation: a name that only C code knows is found here.
    assert msgspec.json.schema(PARTS.find(name))
