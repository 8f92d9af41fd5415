"""What a shell offers to complete."""

import os
import sys
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from mirotwin.commands import main
from tests import children

MIROTWIN = Path(sys.executable).with_name("mirotwin")
COMPLETE = ShellComplete(main, {}, "mirotwin", "_MIROTWIN_COMPLETE")


@pytest.mark.parametrize(
    ("words", "begun", "offered"),
    [
        ([], "ca", ["campaign", "camera"]),
        (["fw"], "di", ["disasm"]),
        (["run"], "fig1", ["fig10"]),
        (["run", "fig6"], "--se", ["--seed", "--set"]),
        (["camera", "calibrate", "--scenario"], "fig1", ["fig10"]),
        (["serve"], "curv", ["curve"]),
        (["run", "fig6", "--engine"], "", ["compiled", "python"]),
    ],
)
def test_commands_options_scenarios_and_choices_are_completed(words, begun, offered):
    found = [one.value for one in COMPLETE.get_completions(words, begun) if one.type == "plain"]
    assert found == offered


def test_a_scenario_may_be_a_file_too():
    assert "file" in [one.type for one in COMPLETE.get_completions(["run"], "mine")]


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_the_program_writes_what_a_shell_has_to_read(shell):
    asking = {**os.environ, "_MIROTWIN_COMPLETE": f"{shell}_source"}
    done = children.run([MIROTWIN], env=asking, capture_output=True, text=True)
    assert done.returncode == 0
    assert "_MIROTWIN_COMPLETE" in done.stdout
