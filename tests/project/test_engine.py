"""The engine: compiled and source twins are never mixed, and a stale compiled module is refused."""

import sys

import pytest
from miro_protocol import engine

from tests import children


def test_a_stamp_that_is_not_the_sources_hash_is_refused_with_a_remedy():
    with pytest.raises(engine.EngineError, match=r"stale.*pip install"):
        engine.refuse_if_stale("miro_robot.nowhere", "0" * 64)


def test_the_engine_cannot_be_changed_once_it_is_in_use():
    script = (
        "from miro_protocol import engine\n"
        "engine.select('python')\n"
        "try:\n    engine.select('compiled')\n"
        "except engine.EngineError as error:\n    print('refused:', error)\n"
    )
    done = children.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("refused: engine python is already in use")
