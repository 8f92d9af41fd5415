"""A user's own plug-ins: a check in each command that takes one, and mistakes, told with file, line and function."""

import re
import sys

import pytest

from tests.exact import distribution

CHECKS = '''
from mirotwin.verify.checks.interface import Check, Monitor

class Own(Check, frozen=True, kw_only=True):
    KIND = "safety"

    def monitor(self, subject):
        return globals()[f"{type(self).__name__}Monitor"](self, subject)

class Raises(Own, frozen=True, kw_only=True, tag="raises"):
    pass

class RaisesMonitor(Monitor):
    def period(self, record, tick):
        self.helper()

    def helper(self):
        raise RuntimeError("oh")

class GivesNone(Own, frozen=True, kw_only=True, tag="gives_none"):
    def monitor(self, subject):  # none
        RaisesMonitor(self, subject)

class Hears(Own, frozen=True, kw_only=True, tag="hears_wrong"):
    pass

class HearsMonitor(Monitor):
    EVENTS = ("comand",)

class HearsText(Own, frozen=True, kw_only=True, tag="hears_text"):
    pass

class HearsTextMonitor(Monitor):
    EVENTS = "command"

class NoSuper(Own, frozen=True, kw_only=True, tag="no_super"):
    pass

class NoSuperMonitor(Monitor):
    def __init__(self, check, subject):
        pass

class NoKind(Check, frozen=True, kw_only=True, tag="no_kind"):
    pass

class Objects(Own, frozen=True, kw_only=True, tag="objects"):
    def problem(self, end_tick):
        return 1 // 0

class Leaves(Own, frozen=True, kw_only=True, tag="leaves"):
    def __post_init__(self):
        raise SystemExit(0)

class FloatTick(Own, frozen=True, kw_only=True, tag="float_tick"):
    pass

class FloatTickMonitor(Monitor):
    def period(self, record, tick):
        self.fail(tick / 2, "one thing", "another")

class Still(Own, frozen=True, kw_only=True, tag="stands_still"):
    """No robot hears a frame: one that does what it should."""

class StillMonitor(Monitor):
    EVENTS = ("frame",)

    def event(self, event):
        self.judged += 1
        self.fail(event.tick, "no frame", "one")
'''
LAWS = """
from miro_host.laws.interface import Law, LawParameters

class Raises(LawParameters, frozen=True, tag="law_raises"):
    def law(self):
        return RaisesLaw(self)

class RaisesLaw(Law):
    def step(self, given):
        return {}["speed"]

class Nothing(LawParameters, frozen=True, tag="law_none"):
    def law(self):
        return None

class Breaks(LawParameters, frozen=True, tag="law_breaks"):
    def law(self):
        raise RuntimeError("no model file")

class Forgets(LawParameters, frozen=True, tag="law_forgets"):
    def law(self):
        return ForgetsLaw(self)

class ForgetsLaw(Law):
    def __init__(self, parameters):  # forgets
        super().__init__(parameters)
        self.seen_m = 0.0

class Says(LawParameters, frozen=True, tag="law_says"):
    def __post_init__(self):
        raise ValueError("how: is refused")

class Refuses(LawParameters, frozen=True, tag="law_refuses"):
    def __post_init__(self):
        raise KeyError("x")
"""
ESTIMATORS = """
from miro_host.estimators.interface import Estimator, EstimatorParameters

class Raises(EstimatorParameters, frozen=True, tag="estimator_raises"):
    def estimator(self):
        return RaisesEstimator(self)

class RaisesEstimator(Estimator):
    def step(self, given):
        return given.nothing
"""
SOURCES = {"checks": CHECKS, "laws": LAWS, "estimators": ESTIMATORS}
NEVER_THERE = {"absent": "plugged_checks:Absent", "syntax": "plugged_syntax:Anything"}


def at(kind, text):
    """The file of such plug-ins, with the number of the first line that holds this."""
    lines = SOURCES[kind].splitlines()
    return f"site/plugged_{kind}.py:{1 + next(n for n, line in enumerate(lines) if text in line)}"


RAISED = f"check 'raises' cannot judge: RuntimeError: oh ({at('checks', 'oh')} in RaisesMonitor.helper)"
CHECKS_TOLD = {
    "raises": f"{RAISED}; repair the check",
    "gives_none": "check 'gives_none' cannot judge: `monitor` returned None "
    f"({at('checks', '# none')} in GivesNone.monitor); return an object of a class that derives from Monitor",
    "hears_wrong": "EVENTS of HearsMonitor names 'comand', which is no event (site/plugged_checks.py:",
    "hears_text": "EVENTS of HearsTextMonitor is 'command' (site/plugged_checks.py:",
    "no_super": "the constructor of NoSuperMonitor does not call that of Monitor (site/plugged_checks.py:",
    "no_kind": "plugged_checks.NoKind has no KIND",
    "objects": "`problem` raised ZeroDivisionError: integer division or modulo by zero "
    f"({at('checks', '1 // 0')} in Objects.problem)",
    "leaves": f"SystemExit: 0 ({at('checks', 'SystemExit')} in Leaves.__post_init__)",
    "float_tick": f"({at('checks', 'tick / 2')} in FloatTickMonitor.period)",
    "absent": "module 'plugged_checks' has no attribute 'Absent'; repair or uninstall plugged-checks 1.0",
    "syntax": "SyntaxError: invalid syntax (plugged_syntax.py, line 1) (site/plugged_syntax.py:1)",
}
LAW_RAISES = f"KeyError: 'speed' ({at('laws', 'speed')} in RaisesLaw.step)"
PLUGINS_TOLD = {
    "controller={law='law_raises'}": LAW_RAISES,
    "controller={law='law_none'}": "`law` returned None (site/plugged_laws.py:",
    "controller={law='law_breaks'}": "law 'law_breaks' cannot be made: RuntimeError: no model file (site/",
    "controller={law='law_forgets'}": "cannot be made: attribute 'seen_m' is neither in STATE nor in NOT_STATE "
    f"({at('laws', '# forgets')} in ForgetsLaw.__init__); mend ",
    "controller={law='law_refuses'}": f"cannot check its parameters: KeyError: 'x' ({at('laws', 'KeyError')} in ",
    "controller={law='law_says'}": "controller.how: is refused",
    "estimator={kind='estimator_raises'}": f"({at('estimators', 'given.nothing')} in RaisesEstimator.step)",
}
STILL = "stands_still: net0/robot0: tick "
SETTINGS = ("--set", "duration_s=0.2")
TEST = 'scenario = "fig6"\nduration_s = 0.2\n'
CAMPAIGN = 'scenario = "fig6"\nseeds = "0-2"\nset = { duration_s = 0.2 }\n'


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """The current folder, with all plug-ins in `site`, two tests and a campaign."""
    for kind, source in SOURCES.items():
        module = f"plugged_{kind}"
        tags = re.findall(r'^class (\w+)\(.*tag="(\w+)"', source, re.MULTILINE)
        parts = {tag: f"{module}:{name}" for name, tag in tags} | (NEVER_THERE if kind == "checks" else {})
        distribution.install(tmp_path / "site", f"plugged-{kind}", "1.0", parts, kind, **{module: source})
    (tmp_path / "site/plugged_syntax.py").write_text("def f(:\n")
    for name, text in {"a.scenario.toml": TEST, "b.scenario.toml": TEST, "c.toml": CAMPAIGN}.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "site"))
    monkeypatch.delenv("MIROTWIN_TRACEBACK", raising=False)
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("plugged_")]:
        del sys.modules[name]


# A check that does what it should


def test_a_test_is_judged_by_it_and_its_line_repeats_that(mirotwin):
    code, out, err = mirotwin("test", "a.scenario.toml", "--expect", "stands_still")
    assert (code, err) == (1, "")
    assert f"expectation failed: {STILL}" in out
    assert "    mirotwin test a.scenario.toml --expect stands_still" in out.splitlines()
    code, out, _ = mirotwin("test", "a.scenario.toml", "--expect", "frames_accepted_min=1")
    assert (code, out.splitlines()[-1]) == (0, "1 passed")


@pytest.fixture
def own_file(here):
    """A check that no distribution has, in a file."""
    source = CHECKS[: CHECKS.index("class Raises")] + CHECKS[CHECKS.index("class Still") :]
    (here / "mine.py").write_text(source.replace("stands_still", "never_hears"))
    return "mine.py:Still"


def test_a_check_in_a_file_judges_as_one_that_is_installed(mirotwin, own_file, here):
    code, out, _ = mirotwin("test", "a.scenario.toml", "--expect", own_file)
    assert (code, f"    mirotwin test a.scenario.toml --expect {own_file}" in out.splitlines()) == (1, True)
    assert "expectation failed: never_hears: " in out
    err = mirotwin.ends(
        1, "run", "a.scenario.toml", "--expect", own_file, "--out", "out", "-q", "--no-figure"
    )
    assert "expectation failed: never_hears: " in err
    assert "expectation failed: never_hears: " in mirotwin.ends(
        1, "replay", "out", "--expect", own_file, "-q"
    )
    err = mirotwin.refuses("replay", "out", "-q")
    assert "expect.never_hears: there is no such check; " in err
    assert "--expect FILE.py:CLASS takes one of your own" in err


def test_a_case_of_a_check_in_a_file_is_judged_by_that_check_and_nothing_else_ran(mirotwin, own_file, here):
    lines = ["# mirotwin stream 2", '#: scenario = "silent"', '#: verdict = "never_hears: of old"']
    lines += ["#: end_tick = 2000000", "#: [expect]", "#: never_hears = true", "240000 > 31"]
    (here / "a.stream").write_text("\n".join(lines) + "\n")
    err = mirotwin.ends(1, "replay", "a.stream", "--expect", own_file)
    assert "expectation not judged: never_hears: the run had no occasion for it" in err
    (here / "mine.py").write_text((here / "mine.py").read_text().replace('"frame",', '"received",'))
    assert "still fails, but not as recorded: never_hears" in mirotwin.ends(
        1, "replay", "a.stream", "--expect", own_file
    )
    (here / "mine.py").write_text(
        (here / "mine.py").read_text().replace('self.fail(event.tick, "no frame", "one")', "pass")
    )
    assert "not reproduced: never_hears passes" in mirotwin.ends(
        4, "replay", "a.stream", "--expect", own_file
    )
    assert "there is no such check" in mirotwin.refuses("replay", "a.stream")


def test_a_check_in_a_file_has_a_name_of_its_own(mirotwin, own_file, here):
    (here / "mine.py").write_text((here / "mine.py").read_text().replace("never_hears", "no_fault"))
    err = mirotwin.refuses("run", "fig6", "--expect", own_file)
    assert "mine.py: --expect Still: check 'no_fault' is in mirotwin (" in err
    assert err.endswith("; give the class another tag")
    assert "there is no class 'Stil' derived from Check; did you mean Still?" in mirotwin.refuses(
        "run", "fig6", "--expect", "mine.py:Stil"
    )
    (here / "mine.py").write_text("raise RuntimeError('no')")
    assert "mine.py: --expect: cannot be run: RuntimeError: no (mine.py:1); repair it" in mirotwin.refuses(
        "run", "fig6", "--expect", own_file
    )


@pytest.mark.slow
def test_a_campaign_has_a_column_for_it_from_every_process(mirotwin, here):
    from mirotwin import campaign

    command = ("campaign", "run", "c.toml", "--out", "c.parquet", "--jobs", 2)
    err = mirotwin.ends(1, *command, "--expect", "stands_still", "--expect", "frames_accepted_min=1")
    assert f"failed: runs 0, 1, 2: {STILL}" in err or f"failed: run 0: {STILL}" in err
    rows = campaign.read(here / "c.parquet")[0].to_pylist()
    assert {row["check.stands_still"] for row in rows} == {"failed"}
    assert {row["check.frames_accepted_min"] for row in rows} == {"passed"}


def test_a_campaign_goes_on_with_the_same_expectations_only(mirotwin):
    command = ("campaign", "run", "c.toml", "--out", "c.parquet", "--jobs", 1)
    assert mirotwin(*command, "--expect", "frames_accepted_min=1")[0] == 0
    code, out, _ = mirotwin(*command, "--expect", "frames_accepted_min=1")
    assert (code, out.splitlines()[0]) == (0, "c.parquet has all 3 runs already")
    for more in ((), ("--expect", "frames_accepted_min=2"), ("--expect", "stands_still")):
        assert "c.parquet: holds the results of another campaign" in mirotwin.ends(2, *command, *more)


@pytest.mark.slow
def test_a_find_of_it_is_a_case_that_replays_to_the_same_failure(mirotwin, here):
    options = ("--time", "1s", "--jobs", 1, "--minimise", "0.2s", "--out", "out")
    code, out, _ = mirotwin("fuzz", *options, "--expect", "stands_still")
    assert code == 1
    case = next((here / "out" / "crashes").glob("stands_still-*.stream"))
    assert f"    mirotwin replay {case.relative_to(here)}" in out
    assert mirotwin.ends(1, "replay", case, "-q").startswith(f"mirotwin: fails as recorded: {STILL}")


@pytest.mark.parametrize(
    "command",
    [("run", "fig6"), ("test", "a.scenario.toml"), ("campaign", "run", "c.toml"), ("fuzz", "--time", "1s")],
)
def test_a_wrong_name_is_told_the_nearest_one_and_a_file_that_is_not_there(mirotwin, command):
    code, out, err = mirotwin(*command, "--expect", "stands_stil")
    assert (code, "there is no such check; did you mean stands_still?" in out + err) == (2, True)
    assert "--expect stands_stil" in out + err
    err = mirotwin.ends(2, *command, "--expect", "mine.py:Still")
    said = "mine.py: --expect: there is no such file"
    if command[0] == "campaign":
        said = "--expect: runs of other processes name checks that are installed"
    assert said in err


NOTE = "leaves out calibration, pattern, centroid, window_px, self_calibration"


def test_what_a_setting_leaves_out_is_told_once_for_all_tests(mirotwin):
    code, _, err = mirotwin("test", ".", "--set", "camera.kind=gaussian")
    assert (code, err) == (0, f"mirotwin: note: --set camera.kind=gaussian {NOTE}\n")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "more", "place"),
    [
        (("", ""), ("--set", "camera.kind=gaussian"), "--set camera.kind=gaussian"),
        (("0.2", '0.2, camera.kind = "gaussian"'), (), 'c.toml: set.camera.kind: camera.kind="gaussian"'),
        (
            ("}\n", '}\n[grid]\ncamera.kind = ["pixels", "gaussian"]\n'),
            (),
            'c.toml: grid.camera.kind[1]: camera.kind="gaussian"',
        ),
        (
            ("}\n", '}\n[factor.eye]\nfar = ["camera.kind=gaussian"]\n'),
            (),
            "c.toml: factor.eye.far: camera.kind=gaussian",
        ),
    ],
)
def test_a_campaign_tells_once_what_leaves_keys_out(mirotwin, here, change, more, place):
    (here / "c.toml").write_text(CAMPAIGN.replace(*change, 1))
    code, _, err = mirotwin("campaign", "run", "c.toml", "-q", "--jobs", 2, *more)
    assert (code, err) == (0, f"mirotwin: note: {place} {NOTE}\n")


@pytest.mark.parametrize(
    "kind",
    ['camera = { kind = "gaussian" }', '[camera]\nkind = "gaussian"', 'set = { camera.kind = "gaussian" }'],
)
def test_a_file_may_choose_another_kind_in_each_form(mirotwin, here, kind):
    (here / "a.scenario.toml").write_text(f"{TEST}{kind}\n")
    code, out, err = mirotwin("test", "a.scenario.toml")
    note = f'mirotwin: note: set.camera.kind="gaussian" {NOTE}\n' if kind.startswith("set") else ""
    assert (code, out.splitlines()[-1], err) == (0, "1 passed", note)


# Mistakes


def told(result):
    """The error's line, from stdout or stderr."""
    code, out, err = result
    assert code == 2
    assert "Traceback" not in out + err
    assert "internal error" not in out + err
    return out + err


@pytest.mark.parametrize("name", CHECKS_TOLD)
def test_a_check_that_is_wrong_is_told_with_its_file_by_run(mirotwin, name):
    said = told(mirotwin("run", "fig6", *SETTINGS, "-q", "--no-figure", "--expect", name))
    assert CHECKS_TOLD[name] in said
    assert len([line for line in said.splitlines() if "error: " in line]) == 1


def test_a_wrong_event_is_told_the_nearest_one_and_the_list(mirotwin):
    said = told(mirotwin("run", "fig6", *SETTINGS, "-q", "--no-figure", "--expect", "hears_wrong"))
    assert "; did you mean command? there are sent, heard, answer, received, " in said


@pytest.mark.parametrize("setting", PLUGINS_TOLD)
def test_a_part_that_is_wrong_is_told_with_its_file_by_run(mirotwin, setting):
    said = told(mirotwin("run", "fig6", *SETTINGS, "-q", "--no-figure", "--set", f"network.robot.{setting}"))
    assert PLUGINS_TOLD[setting] in said


@pytest.mark.slow
def test_the_other_commands_tell_the_same(mirotwin, here):
    assert mirotwin("run", "fig6", *SETTINGS, "-q", "--no-figure", "--out", "run")[0] == 0
    for command in (
        ("replay", "run/run.mcap", "-q"),
        ("test", "a.scenario.toml"),
        ("fuzz", "--time", "2s", "-q", "--force", "--jobs", "1"),
    ):
        assert RAISED in told(mirotwin(*command, "--expect", "raises")), command
    (here / "a.scenario.toml").write_text(f"{TEST}expect.raises = true\n")
    assert RAISED in told(mirotwin("test", "a.scenario.toml"))
    said = told(mirotwin("campaign", "run", "c.toml", "-q", "--jobs", 1, "--expect", "raises"))
    assert f"error: runs 0, 1, 2: net0/robot0: {RAISED}" in said
    for command in (("camera", "look", "fig6", "--at", "0.1s"), ("run", "fig6", *SETTINGS, "-q")):
        said = told(mirotwin(*command, "--set", "network.robot.controller={law='law_raises'}"))
        assert LAW_RAISES in said, command


def test_a_check_that_breaks_after_the_recording_is_told_by_replay_and_report(mirotwin, monkeypatch):
    command = ("run", "fig6", *SETTINGS, "-q", "--no-figure", "--out", "run", "--expect", "stands_still")
    assert mirotwin(*command)[0] == 1
    monitor = sys.modules["plugged_checks"].StillMonitor
    monkeypatch.setattr(monitor, "event", lambda self, event: self.nothing)
    for command in (("replay", "run/run.mcap", "-q"), ("report", "run/run.mcap", "--out", "page.html")):
        said = told(mirotwin(*command))
        assert "check 'stands_still' cannot judge: AttributeError: " in said
        assert "test_plugins.py:" in said


def test_with_mirotwin_traceback_the_whole_of_it_comes_first(mirotwin, monkeypatch, here):
    monkeypatch.setenv("MIROTWIN_TRACEBACK", "1")
    (here / "a.scenario.toml").write_text(f"{TEST}expect.raises = true\n")
    (here / "c.toml").write_text('scenario = "a.scenario.toml"\nseeds = "0"\n')
    for command in (
        ("run", "fig6", *SETTINGS, "-q", "--no-figure", "--expect", "raises"),
        ("run", "fig6", *SETTINGS, "-q", "--set", "network.robot.controller={law='law_refuses'}"),
        ("run", "fig6", *SETTINGS, "-q", "--expect", "syntax"),
        ("test", "a.scenario.toml"),
        ("campaign", "c.toml", "-q", "--jobs", "1"),
    ):
        err = mirotwin.ends(2, *command)
        trace, _, line = err.rstrip().rpartition("\n")
        assert "Traceback (most recent call last):" in trace, command
        assert line.startswith("mirotwin: error: ") or command[0] in ("test", "campaign")
        assert re.search(r'File ".*/site/plugged_\w+.py", line \d+', err), command
    code, _, err = mirotwin("run", "fig6", "--set", "duration=1")  # nobody's plug-in
    assert (code, err.count("\n")) == (2, 1)
