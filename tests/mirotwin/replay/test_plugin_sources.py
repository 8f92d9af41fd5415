"""A recording says which plug-ins made it; `replay` and `diff` say when they are others now."""

import os

import pytest

from mirotwin.recording.reader import read
from tests import children
from tests.exact.distribution import install
from tests.host.test_plugins import GOOD
from tests.mirotwin.program import COMMAND

SCENARIO = """
name = "steady"
duration_s = 0.2
[[network]]
[[network.robot]]
reference.kind = "line"
controller.law = "steady"
"""


@pytest.fixture
def site(tmp_path):
    (tmp_path / "steady.toml").write_text(SCENARIO)
    install(tmp_path / "site", "steady-law", "1.2", {"steady": "plug_steady:Parameters"}, plug_steady=GOOD)
    return tmp_path


def called(site, *words):
    """Exit code, stdout and stderr of the program with the law installed."""
    environment = {**os.environ, "PYTHONPATH": str(site / "site")}
    done = children.run([*COMMAND, *words], cwd=site, capture_output=True, text=True, env=environment)
    return done.returncode, done.stdout, done.stderr


def test_replay_and_diff_tell_of_a_law_that_was_edited_since(site):
    for number in "12":
        assert called(site, "run", "steady.toml", "--out", number, "--no-figure", "-q")[0] == 0
        (site / "site" / "plug_steady.py").write_text(GOOD + "# edited\n")
    sources = {number: read(site / number / "run.mcap").source.plugins for number in "12"}
    assert all(texts[0].startswith("law steady: steady-law 1.2, sources ") for texts in sources.values())
    assert sources["1"] != sources["2"]
    now, then = (sources[number][0].partition(": ")[2] for number in "21")
    line = f"law steady is {now} instead of {then}: run again, it may do something else\n"
    assert called(site, "replay", "1", "-q")[::2] == (0, f"mirotwin: 1/run.mcap: {line}")
    assert called(site, "replay", "2", "-q")[::2] == (0, "")
    code, out, err = called(site, "diff", "1", "2")
    assert (code, err) == (0, f"mirotwin: 1/run.mcap: {line}")
    assert "plug-ins" in out


def test_a_run_with_our_own_plug_ins_alone_says_nothing_of_plug_ins(finished):
    assert read(finished / "run.mcap").source.plugins == ()
    assert b"plugins" not in (finished / "run.mcap").read_bytes()
