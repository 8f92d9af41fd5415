"""Every scenario, camera, radio and disturbance gives the bits that it gave when they were frozen."""

import json
import sys

import pytest

from miro_exact import engine
from tests.sim import digests
from tests.sim.digest_of import REFUSED, digest

GOLDEN = json.loads(digests.GOLDEN.read_text())


def test_the_table_has_a_run_of_everything_and_no_other():
    assert list(GOLDEN) == list(digests.names())


@pytest.mark.parametrize("name", GOLDEN)
def test_a_run_has_its_bits(name, monkeypatch):
    monkeypatch.chdir(digests.ROOT)
    assert digest(name) == GOLDEN[name]


def test_a_failed_build_is_told_at_once(monkeypatch, capsys):
    monkeypatch.setattr(engine.install(), "missing", lambda: ["miro_robot.mcs51.cpu"])
    monkeypatch.setattr(sys, "argv", ["digests"])
    assert digests.main() == REFUSED
    assert capsys.readouterr().err.startswith("no compiled module for miro_robot.mcs51.cpu; ")
