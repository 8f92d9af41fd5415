"""The list of commands, and what is loaded for it."""

import os
import sys
from importlib import import_module
from pathlib import Path

import pytest

from mirotwin.commands import CAMERA, CAMPAIGN, FIRMWARE, SECTIONS
from mirotwin.shell.program import Lazy
from tests import children
from tests.mirotwin.program import COMMAND

LAZY = [
    (name, one)
    for section in (CAMERA, CAMPAIGN, FIRMWARE, *SECTIONS.values())
    for name, one in section.items()
    if isinstance(one, Lazy)
]


@pytest.mark.parametrize(("name", "lazy"), LAZY)
def test_a_command_is_called_as_the_list_calls_it(name, lazy):
    assert getattr(import_module(f"mirotwin.{lazy.module}"), name).name == name


def test_help_lists_every_command(mirotwin):
    code, out, _ = mirotwin("--help")
    assert code == 0
    for heading, section in SECTIONS.items():
        listed = out.split(f"\n{heading}:\n")[1].splitlines()[: len(section)]
        assert [line.split()[0] for line in listed] == list(section)


@pytest.mark.parametrize(
    "arguments", [["scenarios"], ["--help"], ["run", "no-such-scenario"], ["--no-such-option"]]
)
def test_the_package_runs_as_the_program_does(tmp_path, arguments):
    ways = [
        children.run([*words, *arguments], cwd=tmp_path, capture_output=True, text=True)
        for words in (COMMAND, [sys.executable, "-m", "mirotwin"])
    ]
    as_program, as_package = ((done.returncode, done.stdout, done.stderr) for done in ways)
    assert as_package == as_program
    assert "__main__" not in "".join(as_package[1:])


def test_a_file_that_ends_too_soon_is_no_interruption(mirotwin, monkeypatch):
    def cut_short(name):
        raise EOFError("marshal data too short")

    monkeypatch.setattr("mirotwin.shell.program.import_module", cut_short)
    err = mirotwin.ends(70, "scenarios")
    assert "internal error: RuntimeError: a file ends too soon: marshal data too short" in err


LOADED = """
import sys
from mirotwin.commands import main
try:
    main()
finally:
    print("loaded:", *(f"{name}={getattr(one, '__file__', '')}" for name, one in sorted(sys.modules.items())))
"""


def loaded(*words, **more):
    """The files of all modules that were loaded by a command, by name."""
    done = children.run([sys.executable, "-c", LOADED, *words], capture_output=True, text=True, **more)
    assert done.stderr == ""
    return dict(one.split("=") for one in done.stdout.rpartition("loaded: ")[2].split())


@pytest.mark.parametrize(("word", "more"), [("--help", "importlib.metadata"), ("--version", "numpy")])
def test_help_and_version_load_click_and_nothing_that_is_slow(word, more):
    found = loaded(word)
    ours = ["mirotwin", "mirotwin.commands", "mirotwin.shell"]
    ours += ["mirotwin.shell.program", "mirotwin.shell.verdicts"]
    heads = ["mirotwin.conform", "mirotwin.verify", "mirotwin.verify.checks"]  # the table of checks
    assert sorted(name for name in found if name.startswith("mirotwin")) == sorted(ours + heads)
    others = {name for name in found if name.startswith("miro_")}
    assert others <= {"miro_exact", "miro_exact.bad_input", "miro_exact.engine"}
    assert not found.keys() & {"numpy", "msgspec", "rich", "mcap", more}
    assert word == "--version" or not found.keys() & {"hashlib", "tomllib"}


@pytest.mark.parametrize("words", [["replay", "--help"], ["test", "--help"], ["conform", "--list"]])
def test_a_command_without_a_port_loads_nothing_for_ports(words):
    found = loaded(*words)
    assert "mirotwin.desk.guard" in found
    assert not {"serial", "mirotwin.desk.robot_port"} & found.keys()


@pytest.mark.parametrize(("words", "ours"), [([], []), (["trace"], ["mirotwin.firmware.fw_trace"])])
def test_a_command_of_fw_loads_no_other(words, ours):
    assert [name for name in loaded("fw", *words, "--help") if ".fw_" in name] == ours


@pytest.mark.slow
def test_with_the_python_engine_a_command_loads_sources_alone(tmp_path):
    command = ("run", "fig6", "--set", "duration_s=0.001", "--engine", "python", "--no-figure", "-q")
    found = loaded(*command, cwd=tmp_path)
    for name in ("miro_sim.world.world", "miro_robot.mcs51.cpu", "miro_exact.rng"):
        assert found[name].endswith(".py")


def test_a_quiet_run_with_its_figure_loads_neither_rich_nor_numpy(tmp_path):
    found = loaded("run", "fig6", "--set", "duration_s=0.05", "-q", cwd=tmp_path)
    assert not {"rich", "numpy"} & found.keys()


@pytest.mark.parametrize(
    ("words", "engine"),
    [
        ([], None),
        (["--engine", "python"], "python"),
        (["--engine=python"], "python"),
        (["--engine", "compiled", "--engine", "python"], "python"),
        (["--engine", "numba"], None),
        (["--engine"], None),
    ],
)
def test_the_engine_is_settled_before_a_command_is_loaded(words, engine):
    script = (
        "import sys\nfrom miro_exact.engine import install\nfrom mirotwin.shell.program import settle_engine\n"
        "settle_engine(['fw', 'run', 'a.ihx', *sys.argv[1:]])\nprint(install().engine)"
    )
    done = children.run([sys.executable, "-c", script, *words], capture_output=True, text=True, check=True)
    assert done.stdout == f"{engine}\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize("words", [["run", "nope"], ["test", "nope"], ["run", "--nope"]])
def test_the_exit_code_stays_where_stderr_is_full_or_its_reader_has_gone(words):
    with open("/dev/full", "w") as full:
        assert children.run([*COMMAND, *words], stderr=full).returncode == 2
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer) as gone:
        assert children.run([*COMMAND, *words], stderr=gone).returncode == 2
