"""`python -m tests.fuzz` as people type it."""

import importlib.util
import sys
from pathlib import Path

import pytest

from tests import children
from tests.fuzz import campaign
from tests.fuzz.catalogue import TARGETS

ROOT = Path(__file__).parents[2]


def command(*words):
    called = [sys.executable, "-m", "tests.fuzz", *words]
    environment = campaign.child_environment({})
    found = children.run(called, cwd=ROOT, env=environment, capture_output=True, text=True)
    return found.returncode, found.stdout, found.stderr


def test_targets_are_listed_with_what_they_are():
    code, out, _ = command("--list")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(TARGETS)


def test_a_target_that_is_not_there_is_refused_in_a_line():
    code, _, err = command("nothing")
    assert (code, err) == (2, "there is no target 'nothing'; --list names them\n")


def test_a_campaign_by_chance_says_how_much_it_ran():
    code, out, _ = command("frames", "--plain", "--time", "0.3s")
    assert code == 0
    assert out.splitlines()[0] == "changes by chance"
    assert int(out.splitlines()[1].split()[1]) > 20


def test_one_input_is_run_again_with_what_came_of_it():
    kept = next(iter(sorted((ROOT / "tests/fuzz/corpus/frames").iterdir())))
    code, out, _ = command("frames", "--run", str(kept))
    assert code == 0
    assert out.strip()


@pytest.mark.skipif(importlib.util.find_spec("atheris") is None, reason="needs Atheris")
def test_a_campaign_under_atheris_says_what_it_reached():
    code, out, _ = command("frames", "--time", "1s")
    assert code == 0
    assert "guided by Atheris" in out
    assert " edges, " in out
