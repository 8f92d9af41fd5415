"""Files that have the names of modules, in the folder where somebody calls a command: none is executed."""

import os
import sys

import pytest
from intelhex import IntelHex

from mirotwin.fuzz.afl.settings import missing
from mirotwin.shell.processes import python_module
from tests import children
from tests.mirotwin.verify.firmwares import POLLS
from tests.robot.mcs51.asm import assemble

OTHERS = ("msgspec", "numpy", "click", "hypothesis", "pyarrow", "conftest")
OURS = ("mirotwin", "miro_exact", "miro_sim")
SHORT = 'scenario = "fig6"\nseeds = "0-3"\nset = { duration_s = 0.1 }\n'


@pytest.fixture
def folder(tmp_path):
    """A folder with a trap for each module of Python and some of ours: who imports one leaves a file `was_run`."""
    trap = f"open({str(tmp_path / 'was_run')!r}, 'a').write(__name__ + '\\n')\n"
    here = tmp_path / "here"
    here.mkdir()
    for name in (*sys.stdlib_module_names, *OTHERS, *OURS):
        (here / f"{name}.py").write_text(trap)
    (here / "short.toml").write_text(SHORT)
    program = IntelHex()
    program.puts(0, assemble(POLLS))
    program.write_hex_file(here / "polls.ihx")
    return here


def called(folder, *words, **environment):
    program = [os.path.join(os.path.dirname(sys.executable), "mirotwin"), *words]
    environment = plain() | environment
    done = children.run(program, cwd=folder, capture_output=True, text=True, timeout=120, env=environment)
    assert not (folder.parent / "was_run").exists(), (folder.parent / "was_run").read_text()
    return done


def plain():
    return {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}


@pytest.mark.slow
def test_processes_of_a_campaign_import_nothing_from_the_current_folder(folder):
    done = called(folder, "campaign", "short.toml", "--jobs", "2", "-q")
    assert done.returncode == 0, done.stderr
    assert (folder / "runs/short.parquet").exists()


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["hypothesis", "afl"])
def test_processes_of_fuzzing_import_nothing_from_the_current_folder(folder, engine):
    if engine == "afl" and missing():
        pytest.skip(missing())
    path = os.environ["PATH"] if engine == "afl" else str(folder)
    options = ("--bare", "--time", "1s", "--minimise", "1s", "-q")
    done = called(folder, "fuzz", "polls.ihx", *options, PATH=path)
    assert done.returncode in (0, 1), done.stderr


def test_a_module_of_ours_runs_without_the_current_folder(folder):
    done = children.run(
        python_module("mirotwin.fuzz.hypothesis_process"), cwd=folder, capture_output=True, env=plain()
    )
    assert b"Error" not in done.stdout
    assert not (folder.parent / "was_run").exists()
