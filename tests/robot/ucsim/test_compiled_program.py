"""A C program of SDCC on both machines; the long one is `python -m tests.robot.ucsim.compiled`."""

import shutil

import pytest

from miro_exact import engine
from tests.robot.ucsim import s51
from tests.robot.ucsim.compiled import MODELS, build, differences

CHECKPOINTS = 40 if engine.active() == "compiled" else 2

pytestmark = pytest.mark.skipif(
    not (s51.installed() and shutil.which("sdcc")), reason="needs ucsim's s51 and sdcc"
)


@pytest.mark.parametrize("model", MODELS)
def test_the_machines_agree_at_every_checkpoint(model, tmp_path):
    assert list(differences(build(model, tmp_path), CHECKPOINTS)) == []


def test_a_difference_is_named(monkeypatch):
    run = s51.run
    monkeypatch.setattr(s51, "run", lambda code, commands: run(code.replace(b"\x24", b"\x34"), commands))
    adding = bytes.fromhex("2401 80FC")  # ADD A,#1 (ADDC on the other side), for ever
    found = list(differences(adding.ljust(64, b"\x00"), 2))
    assert len(found) == 1
    assert found[0].startswith("checkpoint 0: ")
    assert "E0h ours 10h ucsim 37h" in found[0]
