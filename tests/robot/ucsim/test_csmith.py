"""Random C programs of csmith on both machines; a thousand by `python -m tests.robot.ucsim.csmith`."""

import shutil

import pytest

from miro_exact import engine
from tests.robot.ucsim import s51
from tests.robot.ucsim.csmith import EQUAL, LEFT_OUT, build, differences, tried

pytestmark = [
    pytest.mark.skipif(
        not (s51.installed() and shutil.which("sdcc") and shutil.which("csmith")),
        reason="needs s51, sdcc, csmith",
    ),
    pytest.mark.skipif(engine.active() == "python", reason="a minute for each program"),
]
SEEDS = range(1, 13)


@pytest.mark.slow
def test_programs_end_with_the_same_memory_and_characters_on_both():
    found = dict(map(tried, SEEDS))
    assert {what for what in found.values() if what not in (EQUAL, LEFT_OUT)} == set()
    assert EQUAL in found.values()


def test_a_difference_is_told(tmp_path, monkeypatch):
    run = s51.run

    def with_other_memory(code, commands, heard):
        return run(code, [f"{one[:-1]}1" if one.startswith("fill xram") else one for one in commands], heard)

    monkeypatch.setattr(s51, "run", with_other_memory)
    image = next(
        image for seed in SEEDS if (image := build(seed, tmp_path)) and differences(image) is not None
    )
    assert differences(image) == ["external RAM"]
