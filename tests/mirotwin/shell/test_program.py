"""The list of commands, and what is loaded for it."""

import os
import sys
from importlib import import_module
from pathlib import Path

import pytest

from miro_sim.scenario.file import builtin_text
from mirotwin.commands import CAMERA, CAMPAIGN, FIRMWARE, SECTIONS
from mirotwin.shell.program import Lazy
from tests import children

LAZY = [
    (name, one)
    for section in (CAMERA, CAMPAIGN, FIRMWARE, *SECTIONS.values())
    for name, one in section.items()
    if isinstance(one, Lazy)
]


@pytest.mark.parametrize(("name", "lazy"), LAZY)
def test_a_command_is_called_as_the_list_calls_it(name, lazy):
    assert getattr(import_module(lazy.module), name).name == name


def test_help_lists_every_command(mirotwin):
    code, out, _ = mirotwin("--help")
    assert code == 0
    for heading, section in SECTIONS.items():
        listed = out.split(f"\n{heading}:\n")[1].splitlines()[: len(section)]
        assert [line.split()[0] for line in listed] == list(section)


def test_the_version_loads_no_command_and_nothing_hot():
    script = (
        "import sys\ntry:\n    from mirotwin.commands import main; main()\nexcept SystemExit: pass\n"
        "print(*sorted(n for n in sys.modules if n.startswith(('numpy', 'mirotwin'))))"
    )
    done = children.run(
        [sys.executable, "-c", script, "--version"], capture_output=True, text=True, check=True
    )
    loaded = done.stdout.splitlines()[-1].split()
    assert loaded == ["mirotwin", "mirotwin.commands", "mirotwin.shell", "mirotwin.shell.program"]


def test_a_run_without_a_figure_writes_the_other_files(mirotwin, tmp_path):
    short = tmp_path / "short.toml"
    text = builtin_text("fig6").replace("duration_s = 6.0", "duration_s = 0.03", 1)
    short.write_text(text, encoding="utf-8")
    code, _, err = mirotwin("run", short, "--out", tmp_path / "out", "--no-figure")
    assert (code, err) == (0, "")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["run.mcap", "summary.json"]


def test_a_file_that_ends_too_soon_is_no_interruption(mirotwin, monkeypatch):
    def cut_short(name):
        raise EOFError("marshal data too short")

    monkeypatch.setattr("mirotwin.shell.program.import_module", cut_short)
    code, _, err = mirotwin("scenarios")
    assert code == 70
    assert err.startswith(
        "mirotwin: internal error: RuntimeError: a file ends too soon: marshal data too short"
    )


def test_help_loads_click_and_nothing_that_is_slow():
    script = (
        "import sys\nfrom mirotwin.commands import main\n"
        "try:\n    main(['--help'])\n"
        "finally:\n    print('loaded:', *sorted(sys.modules), file=sys.stderr)\n"
    )
    done = children.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("Usage: mirotwin")
    loaded = done.stderr.rpartition("loaded: ")[2].split()
    slow = {"numpy", "msgspec", "rich", "mcap", "hashlib", "tomllib", "importlib.metadata"}
    assert not slow.intersection(loaded)
    ours = [name for name in loaded if name.startswith("miro")]
    assert ours == [
        "miro_exact",
        "miro_exact.bad_input",
        "miro_exact.engine",
        "mirotwin",
        "mirotwin.commands",
        "mirotwin.shell",
        "mirotwin.shell.program",
    ]


@pytest.mark.parametrize("arguments", [["replay", "--help"], ["test", "--help"], ["conform", "--list"]])
def test_a_command_without_a_port_loads_nothing_for_ports_or_the_bare_processor(arguments):
    script = (
        "import sys\ntry:\n    from mirotwin.commands import main; main()\nexcept SystemExit: pass\n"
        "print('loaded:', *sorted(sys.modules))"
    )
    done = children.run(
        [sys.executable, "-c", script, *arguments], capture_output=True, text=True, check=True
    )
    loaded = done.stdout.rpartition("loaded: ")[2].split()
    assert "mirotwin.desk.guard" in loaded
    assert not {"serial", "mirotwin.desk.robot_port", "mirotwin.verify.bare"}.intersection(loaded)


def test_a_command_of_fw_loads_no_other():
    script = (
        "import sys\ntry:\n    from mirotwin.commands import main; main()\nexcept SystemExit: pass\n"
        "print(*sorted(n for n in sys.modules if '.fw_' in n))"
    )
    for arguments, loaded in (
        (["fw", "--help"], ""),
        (["fw", "trace", "--help"], "mirotwin.firmware.fw_trace"),
    ):
        done = children.run(
            [sys.executable, "-c", script, *arguments], capture_output=True, text=True, check=True
        )
        assert done.stdout.splitlines()[-1] == loaded


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


@pytest.mark.slow
def test_with_the_python_engine_a_command_loads_sources_alone(tmp_path):
    script = (
        "import sys\nfrom mirotwin.commands import main\ntry:\n    main()\nexcept SystemExit: pass\n"
        "for name in 'miro_sim.world.world', 'miro_robot.mcs51.cpu', 'miro_exact.rng':\n"
        "    print(sys.modules[name].__file__)"
    )
    command = ["run", "fig6", "--set", "duration_s=0.001", "--engine", "python", "--no-figure", "-q"]
    done = children.run(
        [sys.executable, "-c", script, *command], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert [line[-3:] for line in done.stdout.splitlines()[-3:]] == [".py"] * 3
    assert done.stderr == ""


def test_a_quiet_run_with_its_figure_loads_neither_rich_nor_numpy(tmp_path):
    script = (
        "import sys\nfrom mirotwin.commands import main\ntry:\n    main()\nexcept SystemExit: pass\n"
        "print({'rich', 'numpy'}.intersection(sys.modules))"
    )
    command = ["run", "fig6", "--set", "duration_s=0.05", "-q"]
    done = children.run(
        [sys.executable, "-c", script, *command], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert (done.stdout, done.stderr) == ("set()\n", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize("words", [["run", "nope"], ["test", "nope"], ["run", "--nope"]])
def test_the_exit_code_stays_where_stderr_is_full_or_its_reader_has_gone(words):
    command = [Path(sys.executable).with_name("mirotwin"), *words]
    with open("/dev/full", "w") as full:
        assert children.run(command, stderr=full, check=False).returncode == 2
    reader, writer = os.pipe()
    os.close(reader)
    try:
        assert children.run(command, stderr=writer, check=False).returncode == 2
    finally:
        os.close(writer)
