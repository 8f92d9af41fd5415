"""`mirotwin scenarios`, and how the command line refuses what it is not meant to get."""

import tomllib

import click
import pytest
from click.testing import CliRunner

from miro_sim.scenario.file import builtin_text, parse
from mirotwin.commands import main
from mirotwin.shell.program import MainGroup
from mirotwin.verify.checks.expect import CHECKS


def mirotwin(*arguments):
    result = CliRunner().invoke(main, arguments)
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return result.exit_code, result.stdout, result.stderr


def test_the_built_in_scenarios_are_listed_with_what_they_show():
    code, out, err = mirotwin("scenarios")
    assert (code, err) == (0, "")
    assert "fig6" in out
    assert "Arc, initial errors (11.20 cm, 28.92 cm, -1.31 rad)" in out
    assert out.endswith("\nwrite one out, to start from: mirotwin scenarios show NAME\n")


@pytest.mark.parametrize("name", ["fig6", "fig10"])
def test_show_prints_the_file_as_it_stands(name):
    assert mirotwin("scenarios", "show", name) == (0, builtin_text(name), "")
    assert tomllib.loads(mirotwin("scenarios", "show", name)[1])["name"] == name


def test_the_checks_are_listed_with_their_parameters():
    code, out, err = mirotwin("scenarios", "checks")
    assert (code, err) == (0, "")
    rows = {line.split()[0]: line for line in out.splitlines() if line.strip()}
    assert set(CHECKS.own) <= set(rows)
    assert rows["tracks_within_cm"].endswith("limit_cm*, from_s")


@pytest.mark.parametrize("command", [["scenarios", "show"], ["run"]])
def test_the_help_has_the_three_lines_that_derive_a_scenario(command):
    lines = mirotwin(*command, "--help")[1].splitlines()
    first = next(number for number, line in enumerate(lines) if line.strip() == 'scenario = "fig6"')
    mine = parse("\n".join(lines[first : first + 3]).replace("    ", ""), "mine.toml")
    assert (mine.name, mine.networks[0].robot[0].controller.q1_per_s) == ("mine", 0.3)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["scenarios", "show", "fig5"], "error: fig5: no such scenario; did you mean"),
        (["run", "fig5"], "error: fig5: no such scenario; did you mean"),
        (["run", "absent.toml"], "error: absent.toml: no such file"),
        (["run", "fig6", "--seed", "-1"], "error: Invalid value for '--seed': -1 is not in the range"),
        (["run", "fig6", "--seed", str(1 << 63)], "error: Invalid value for '--seed': 9223372036854775808"),
        (["run", "fig6", "--seed", "one"], "error: Invalid value for '--seed': 'one' is not a whole number"),
        (["run", "fig6", "--engine", "numba"], "error: Invalid value for '--engine': 'numba' is not one of"),
        (["run"], "error: Missing argument 'SCENARIO'"),
        (["run", "fig6", "--sed", "3"], "error: No such option '--sed'; did you mean --seed?"),
        (["camera", "track", "--colour=x"], "error: No such option '--colour'; did you mean --colours?"),
        (["run", "fig6", "--zzzzz"], "error: No such option '--zzzzz'. See `"),
        (["rnu"], "error: No such command 'rnu'; did you mean run?"),
        (["fw", "trce"], "error: No such command 'trce'; did you mean trace?"),
        (["scenarios", "fig6"], "error: No such command 'fig6'; did you mean `scenarios show fig6`?"),
        (["scenarios", "x.toml"], "error: No such command 'x.toml'; did you mean `scenarios show x.toml`?"),
        (["scenarios", "shwo"], "error: No such command 'shwo'; did you mean show?"),
        (["xyz"], "error: No such command 'xyz'; there are run, "),
        (["replay", "absent.mcap"], "error: absent.mcap: No such file or directory"),
    ],
)
def test_bad_input_is_one_line_on_stderr_and_exit_code_2(arguments, expected):
    code, out, err = mirotwin(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"mirotwin: {expected}")
    assert err.count("\n") == 1


def test_without_a_command_the_help_is_shown():
    code, _, err = mirotwin()
    assert code == 2
    assert "Simulate:" in err


FULL_DISK = OSError(28, "No space left on device", "out/run.mcap")


@pytest.mark.parametrize(
    ("raised", "code", "line"),
    [
        (KeyboardInterrupt(), 130, "mirotwin: interrupted\n"),
        (FULL_DISK, 2, "mirotwin: error: out/run.mcap: No space left on device\n"),
    ],
)
def test_what_comes_from_outside_is_no_traceback_either(raised, code, line):
    @click.group(cls=MainGroup)
    def group(): ...

    @group.command()
    def stumble():
        raise raised

    result = CliRunner().invoke(group, ["stumble"])
    assert (result.exit_code, result.stderr.lstrip("\n")) == (code, line)


def test_a_mistake_of_the_program_itself_asks_for_a_report():
    @click.group(cls=MainGroup)
    def group(): ...

    @group.command()
    def stumble():
        raise ZeroDivisionError

    result = CliRunner().invoke(group, ["stumble"])
    assert result.exit_code == 70
    assert "ZeroDivisionError" in result.stderr
    assert "report" in result.stderr


def test_what_a_setting_leaves_out_is_told_on_stderr(tmp_path):
    folder = ("--out", str(tmp_path / "out"), "--no-figure", "-q")
    code, _, err = mirotwin(
        "run", "fig6", "--set", "camera.kind=geometric", "--set", "duration_s=0.1", *folder
    )
    assert code == 0
    assert (
        err
        == "mirotwin: note: --set camera.kind=geometric leaves out centroid, window_px, self_calibration\n"
    )
