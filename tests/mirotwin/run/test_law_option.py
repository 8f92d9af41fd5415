"""A law in a file, `--law FILE.py:CLASS`: it steers, its source belongs to the run, no other file names it."""

import json
import re
import shutil
import tomllib
from pathlib import Path

import pytest

from mirotwin.recording.reader import read

ROOT = Path(__file__).parents[3]
LAW = "samson_law.py:Parameters"
OTHER = "pursuit_law.py:Parameters"
ESTIMATOR = """
from miro_host.estimators.interface import Estimate, Estimator, EstimatorParameters


class Parameters(EstimatorParameters, frozen=True, kw_only=True, tag="late_by"):
    late_s: float = 0.0

    def estimator(self):
        return LateBy(self)


class LateBy(Estimator[Parameters]):
    def step(self, given):
        return None if given.measured is None else Estimate(given.t_s - self.parameters.late_s, given.measured)
"""
OPTIONS = ("--no-figure", "-q")


@pytest.fixture
def here(tmp_path, monkeypatch, short):
    """The current folder, with two laws and the short scenario of two robots."""
    for name in ("samson_law.py", "pursuit_law.py"):
        shutil.copy(ROOT / "examples/laws" / name, tmp_path)
    shutil.copy(short, tmp_path / "short.toml")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def recorded(mirotwin, here):
    """A run that a law of a file steered."""
    mirotwin("run", "short.toml", *OPTIONS, "--law", LAW, "--out", "out")
    return here / "out"


def laws_in(folder):
    """Of each robot, None where its table does not say."""
    (network,) = tomllib.loads(read(str(folder / "run.mcap")).source.scenario_text)["network"]
    return [robot.get("controller", {}).get("law") for robot in network["robot"]]


def test_it_steers_all_robots_of_a_scenario_that_does_not_name_it(mirotwin, recorded):
    assert laws_in(recorded) == ["samson", "samson"]
    (used,) = read(str(recorded / "run.mcap")).source.plugins
    assert re.fullmatch(rf"law samson: {LAW}, sources [0-9a-f]{{12}}", used)


def test_it_steers_only_those_robots_for_which_the_scenario_or_a_setting_names_it(mirotwin, here):
    key = "network.robot.1.controller.law=samson"
    mirotwin("run", "short.toml", *OPTIONS, "--law", LAW, "--set", key, "--out", "set")
    assert laws_in(here / "set") == [None, "samson"]
    whole = 'scenario = "short.toml"\nset = { network.robot.0.controller.law = "samson" }\n'
    (here / "mine.toml").write_text(whole)
    assert mirotwin("run", "mine.toml", *OPTIONS, "--law", LAW, "--out", "file") == (0, "", "")
    assert laws_in(here / "file") == ["samson", None]


def test_it_steers_only_those_runs_of_a_campaign_whose_level_names_it(mirotwin, here):
    parquet = pytest.importorskip("pyarrow.parquet", reason="needs pyarrow: the extra campaign")
    alone = 'scenario = "short.toml"\nset = { duration_s = 0.2 }\n'
    levels = '[factor.law]\nown = []\nmine = ["law=samson"]\n'
    digests = {}
    for name, text, options in (("both", alone + levels, ("--law", LAW)), ("alone", alone, ())):
        (here / f"{name}.toml").write_text(text)
        assert mirotwin("campaign", f"{name}.toml", "-q", *options, "--out", f"{name}.parquet")[0] == 0
        digests[name] = parquet.read_table(f"{name}.parquet")["digest"].to_pylist()
    own, mine = digests["both"]
    assert [own] == digests["alone"]
    assert mine != own


def test_of_two_laws_the_scenario_says_which_steers_which(mirotwin, here):
    both = ("--law", LAW, "--law", OTHER)
    _, _, err = mirotwin("run", "short.toml", *OPTIONS, *both, "--out", "neither")
    assert laws_in(here / "neither") == [None, None]
    notes = [
        f"mirotwin: note: --law: the scenario has no law {name!r}, " for name in ("samson", "pure_pursuit")
    ]
    assert [line.startswith(note) for line, note in zip(err.splitlines(), notes, strict=True)] == [True, True]
    keys = [
        f"network.robot.{place}.controller.law={name}"
        for place, name in enumerate(("samson", "pure_pursuit"))
    ]
    mirotwin("run", "short.toml", *OPTIONS, *both, "--set", keys[0], "--set", keys[1], "--out", "each")
    assert laws_in(here / "each") == ["samson", "pure_pursuit"]
    assert len(read("each/run.mcap").source.plugins) == 2


def test_its_keys_are_set_and_checked_as_those_of_any_law(mirotwin, here):
    key = "network.robot.0.controller.k2_per_m2="
    assert mirotwin("run", "short.toml", *OPTIONS, "--law", LAW, "--set", f"{key}2", "--out", "out")[0] == 0
    err = mirotwin.refuses("run", "short.toml", "--law", LAW, "--set", f"{key}-1")
    assert f"--set {key}-1: -1 is out of range" in err
    err = mirotwin.refuses(
        "run", "short.toml", "--law", LAW, "--set", "network.robot.0.controller.q1_per_s=1"
    )
    assert "unknown key" in err


def test_the_keys_that_go_with_the_law_before_are_told_once(mirotwin, here):
    (here / "mine.toml").write_text((here / "short.toml").read_text() + "controller.q1_per_s = 0.3\n")
    _, _, err = mirotwin("run", "mine.toml", *OPTIONS, "--law", LAW, "--out", "out")
    assert err == "mirotwin: note: --set law=samson leaves out q1_per_s\n"


def test_a_recording_is_replayed_by_the_same_source(mirotwin, recorded):
    out = mirotwin.succeeds("replay", "out", "-q", "--law", LAW)
    assert out.startswith("the robots' response equals the recorded one in all 6 control periods")


@pytest.mark.parametrize("command", ["replay", "report", "debug"])
def test_a_recording_names_the_file_that_is_missing(mirotwin, recorded, command):
    err = mirotwin.refuses(command, "out")
    reason = "its run used the law 'samson' of a file, which is not here by itself"
    assert err == f"out/run.mcap: {reason}; give --law {LAW}, the same file"


def test_a_recording_says_that_the_file_is_another_one_now(mirotwin, recorded, here):
    text = (here / "samson_law.py").read_text()
    (here / "samson_law.py").write_text(text.replace("= 30.0", "= 31.0"))
    code, _, err = mirotwin("replay", "out", "-q", "--law", LAW)
    assert code == 0
    form = rf"law samson is {LAW}, sources \w+ instead of {LAW}, sources \w+: run again, it may do something else\n"
    assert re.fullmatch(rf"mirotwin: out/run.mcap: {form}", err)


def test_two_sources_of_one_law_are_a_difference_of_two_runs(mirotwin, recorded, here):
    text = (here / "samson_law.py").read_text()
    (here / "samson_law.py").write_text(text.replace("k2_per_m2: Gain = 30.0", "k2_per_m2: Gain = 300.0"))
    mirotwin("run", "short.toml", *OPTIONS, "--law", LAW, "--out", "again")
    code, out, _ = mirotwin("diff", "out", "again", "--law", LAW)
    assert (code, "plug-ins" in out) == (4, True)


def test_tests_run_with_it_and_the_line_that_repeats_them_has_it(mirotwin, here):
    (here / "a.scenario.toml").write_text(
        (here / "short.toml").read_text() + "expect.tracks_within_cm = 0.001\n"
    )
    code, out, _ = mirotwin("test", "a.scenario.toml", "--law", LAW)
    assert code == 1
    assert f"    mirotwin test a.scenario.toml --law {LAW}" in out.splitlines()


def test_no_file_makes_us_import_one(mirotwin, here):
    (here / "evil.py").write_text("raise RuntimeError('imported')\n")
    for name in ("evil.py:Parameters", "./evil.py:Parameters", "evil:Parameters", "evil"):
        (here / "mine.toml").write_text(
            (here / "short.toml").read_text() + f"controller.law = {json.dumps(name)}\n"
        )
        assert "is not one of the choices; " in mirotwin.refuses("run", "mine.toml")


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ("samson", "--law: 'samson' is not FILE.py:CLASS; write it as my_law.py:Parameters"),
        ("none.py:Parameters", "none.py: --law: there is no such file; give the path of a file in Python"),
        ("samson_law.py:Params", "there is no class 'Params' derived from LawParameters; did you mean Parameters?"),
        ("broken.py:Parameters", "broken.py: --law: cannot be run: ZeroDivisionError: "),
        ("taken.py:Parameters", "law 'kanayama' is in mirotwin ("),
    ],
)  # fmt: skip
def test_a_file_without_the_law_is_refused_in_one_line(mirotwin, here, law, message):
    (here / "broken.py").write_text("1 // 0\n")
    (here / "taken.py").write_text((here / "samson_law.py").read_text().replace('"samson"', '"kanayama"'))
    assert message in mirotwin.refuses("run", "short.toml", "--law", law)


def test_one_law_cannot_be_brought_twice(mirotwin, here):
    assert "there are two laws 'samson'" in mirotwin.refuses("run", "short.toml", "--law", LAW, "--law", LAW)


def test_an_estimator_in_a_file_is_used_in_the_same_way(mirotwin, here):
    (here / "late.py").write_text(ESTIMATOR)
    mirotwin("run", "short.toml", *OPTIONS, "--estimator", "late.py:Parameters", "--out", "out")
    (used,) = read("out/run.mcap").source.plugins
    assert used.startswith("estimator late_by: late.py:Parameters, sources ")
    assert "give --estimator late.py:Parameters" in mirotwin.refuses("replay", "out")


@pytest.mark.slow
def test_the_workers_of_a_campaign_have_it(mirotwin, here):
    from mirotwin import campaign

    lines = ('scenario = "short.toml"', "seeds = '0-1'", "[grid]", '"network.robot.0.controller" = [')
    (here / "c.toml").write_text("\n".join(lines) + '{law = "yang_kim"}, {law = "samson"}]\n')
    assert mirotwin("campaign", "run", "c.toml", "--out", "c.parquet", "--jobs", 2, "--law", LAW)[0] == 0
    rows = campaign.read(here / "c.parquet")[0].to_pylist()
    assert {row["verdict"] for row in rows} == {"passed"}
    assert len({row["digest"] for row in rows}) == 4
    err = mirotwin.refuses("campaign", "run", "c.toml", "--out", "c.parquet")
    assert "'samson' is not one of the choices" in err
