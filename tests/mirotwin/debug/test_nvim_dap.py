"""nvim-dap, without a screen, drives the adapter with the configuration of `docs/howto/debug.md`.

The plug-in is in no package registry: the test is run where nvim finds it, or where NVIM_DAP names its folder.
"""

import os
import re
import shutil
import sys
from pathlib import Path

import pytest

from miro_robot.firmware import source_folder
from tests import children

HERE = Path(__file__).parent
HOWTO = HERE.parents[2] / "docs" / "howto" / "debug.md"


def nvim(*words, **environment):
    """What nvim says, and its exit code."""
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    plugin = f"let &runtimepath .= ',' . '{os.environ.get('NVIM_DAP', '')}'"
    command = ["nvim", "--headless", "-n", "-i", "NONE", "--cmd", plugin, *words]
    done = children.run(
        command, env={**os.environ, "PATH": path, **environment}, capture_output=True, text=True, timeout=120
    )
    return done.returncode, done.stderr


@pytest.fixture
def configuration():
    """The text of the documentation, where nvim and the plug-in are there."""
    if shutil.which("nvim") is None or nvim("-c", "lua require('dap')", "-c", "qall!") != (0, ""):
        pytest.skip("nvim, or nvim-dap on its runtime path or in the folder NVIM_DAP, is not there")
    return re.search(r"For nvim-dap .*:\n\n```text\n(.*?)```", HOWTO.read_text(), re.DOTALL)[1]


def test_nvim_steps_both_ways_and_shows_variables(configuration, tmp_path):
    source = source_folder() / "failsafe.c"
    script = f"luafile {HERE / 'nvim_dap.lua'}"
    code, said = nvim("-c", script, source, CONFIGURATION=configuration, XDG_CACHE_HOME=str(tmp_path))
    assert (code, said.splitlines()[-1:]) == (0, ["done"]), said
