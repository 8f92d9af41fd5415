"""Mistakes of a user's plug-in, as each command tells them: file, line and function, exit code 2, no traceback."""

import re
import sys

import pytest

from tests.mirotwin import plugins
from tests.mirotwin.plugins import CHECKS, ESTIMATORS, LAWS, REFERENCES, line_of

SHORT = ("--set", "duration_s=0.2")
AT = f"site/plugged_checks.py:{line_of(CHECKS, 'oh')} in RaisesMonitor.helper"
RAISED = f"check 'raises' cannot judge: RuntimeError: oh ({AT})"
CHECKS_TOLD = {
    "raises": f"{RAISED}; repair the check",
    "gives_none": (
        f"check 'gives_none' cannot judge: `monitor` returned None (site/plugged_checks.py:"
        f"{line_of(CHECKS, 'gives_none') + 3} in GivesNone.monitor); return an object of a class that derives "
        "from Monitor"
    ),
    "hears_wrong": "which is no event (site/plugged_checks.py:",
    "hears_text": "EVENTS of HearsTextMonitor is 'command' (site/plugged_checks.py:",
    "no_super": "the constructor of NoSuperMonitor does not call that of Monitor (site/plugged_checks.py:",
    "no_kind": "plugged_checks.NoKind has no KIND",
    "objects": f"`problem` raised ZeroDivisionError: integer division or modulo by zero (site/plugged_checks.py:"
    f"{line_of(CHECKS, '1 // 0')} in Objects.problem)",
    "leaves": f"SystemExit: 0 (site/plugged_checks.py:{line_of(CHECKS, 'SystemExit')} in Leaves.__post_init__)",
    "float_tick": f"(site/plugged_checks.py:{line_of(CHECKS, 'tick / 2')} in FloatTickMonitor.period)",
    "absent": "module 'plugged_checks' has no attribute 'Absent'; repair or uninstall plugged-checks 1.0",
    "syntax": "SyntaxError: invalid syntax (plugged_syntax.py, line 1) (site/plugged_syntax.py:1)",
}
PLUGINS_TOLD = {
    "controller={law='law_raises'}": (
        f"KeyError: 'speed' (site/plugged_laws.py:{line_of(LAWS, 'speed')} in RaisesLaw.step)"
    ),
    "controller={law='law_none'}": (
        f"`law` returned None (site/plugged_laws.py:{line_of(LAWS, 'law_none') + 1} in Nothing.law); return an object"
    ),
    "controller={law='law_nan'}": "= nan, which is not a finite float (site/plugged_laws.py:",
    "controller={law='law_refuses'}": (
        f"cannot check its parameters: KeyError: 'x' (site/plugged_laws.py:{line_of(LAWS, 'KeyError')} in "
    ),
    "controller={law='law_breaks'}": "law 'law_breaks' cannot be made: RuntimeError: no model file (site/",
    "controller={law='law_says'}": "controller.how: is refused",
    "reference={kind='reference_raises'}": (
        f"division by zero (site/plugged_references.py:{line_of(REFERENCES, '1 / 0')} in RaisesPath.at)"
    ),
    "reference={kind='reference_none'}": "`trajectory` returned None (site/plugged_references.py:",
    "estimator={kind='estimator_raises'}": (
        f"(site/plugged_estimators.py:{line_of(ESTIMATORS, 'given.nothing')} in RaisesEstimator.step)"
    ),
}


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """The current folder, with all plug-ins in `site`."""
    plugins.install_all(tmp_path / "site")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    monkeypatch.delenv("MIROTWIN_TRACEBACK", raising=False)
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("plugged_")]:
        del sys.modules[name]


def told(result):
    """The error's line, from stdout or stderr."""
    code, out, err = result
    assert code == 2
    assert "Traceback" not in out + err
    assert "internal error" not in out + err
    return out + err


@pytest.mark.parametrize("name", CHECKS_TOLD)
def test_a_check_that_is_wrong_is_told_with_its_file_by_run(mirotwin, name):
    said = told(mirotwin("run", "fig6", *SHORT, "-q", "--no-figure", "--expect", name))
    assert CHECKS_TOLD[name] in said
    assert len([line for line in said.splitlines() if "error: " in line]) == 1


@pytest.mark.parametrize("setting", PLUGINS_TOLD)
def test_a_part_that_is_wrong_is_told_with_its_file_by_run(mirotwin, setting):
    said = told(mirotwin("run", "fig6", *SHORT, "-q", "--no-figure", "--set", f"network.robot.{setting}"))
    assert PLUGINS_TOLD[setting] in said


def test_a_wrong_event_in_hears_is_told_the_nearest_one_and_the_list(mirotwin):
    said = told(mirotwin("run", "fig6", *SHORT, "-q", "--no-figure", "--expect", "hears_wrong"))
    assert "EVENTS of HearsMonitor names 'comand'" in said
    assert "; did you mean command? there are sent, heard, answer, received, " in said


@pytest.mark.slow
def test_the_other_commands_tell_the_same(mirotwin, here):
    assert mirotwin("run", "fig6", *SHORT, "-q", "--no-figure", "--out", "run")[0] == 0
    file = here / "a.scenario.toml"
    file.write_text('scenario = "fig6"\nduration_s = 0.2\n')
    for command in (
        ("replay", "run/run.mcap", "-q"),
        ("test", "a.scenario.toml"),
        ("fuzz", "--time", "2s", "-q", "--force", "--jobs", "1"),
    ):
        assert RAISED in told(mirotwin(*command, "--expect", "raises")), command
    file.write_text('scenario = "fig6"\nduration_s = 0.2\nexpect.raises = true\n')
    assert RAISED in told(mirotwin("test", "a.scenario.toml"))
    (here / "c.toml").write_text('scenario = "fig6"\nseeds = "0-2"\nset = { duration_s = 0.2 }\n')
    said = told(mirotwin("campaign", "run", "c.toml", "-q", "--jobs", 1, "--expect", "raises"))
    assert f"error: runs 0, 1, 2: net0/robot0: {RAISED}" in said
    for command in (("camera", "look", "fig6", "--at", "0.1s"), ("run", "fig6", *SHORT, "-q")):
        said = told(mirotwin(*command, "--set", "network.robot.controller={law='law_raises'}"))
        assert PLUGINS_TOLD["controller={law='law_raises'}"] in said, command


def test_a_check_that_breaks_after_the_recording_is_told_by_replay_and_report(mirotwin, monkeypatch):
    code, _, _ = mirotwin(
        "run", "fig6", *SHORT, "-q", "--no-figure", "--out", "run", "--expect", "stands_still"
    )
    assert code == 1
    monitor = sys.modules["plugged_checks"].StillMonitor
    monkeypatch.setattr(monitor, "event", lambda self, event: self.nothing)
    for command in (("replay", "run/run.mcap", "-q"), ("report", "run/run.mcap", "--out", "page.html")):
        said = told(mirotwin(*command))
        assert "check 'stands_still' cannot judge: AttributeError: " in said
        assert "test_plugin_errors.py:" in said


def test_with_mirotwin_traceback_the_whole_of_it_comes_first(mirotwin, monkeypatch, here):
    monkeypatch.setenv("MIROTWIN_TRACEBACK", "1")
    (here / "a.scenario.toml").write_text('scenario = "fig6"\nduration_s = 0.2\nexpect.raises = true\n')
    for command in (
        ("run", "fig6", *SHORT, "-q", "--no-figure", "--expect", "raises"),
        ("run", "fig6", *SHORT, "-q", "--set", "network.robot.controller={law='law_refuses'}"),
        ("run", "fig6", *SHORT, "-q", "--expect", "syntax"),
        ("test", "a.scenario.toml"),
    ):
        code, _, err = mirotwin(*command)
        assert code == 2
        trace, _, line = err.rstrip().rpartition("\n")
        assert "Traceback (most recent call last):" in trace, command
        assert line.startswith("mirotwin: error: ") or command[0] == "test"
        assert re.search(r'File ".*/site/plugged_\w+.py", line \d+', err), command
    code, _, err = mirotwin("run", "fig6", "--set", "duration=1")  # nobody's plug-in
    assert (code, err.count("\n")) == (2, 1)
