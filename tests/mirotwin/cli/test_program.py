"""The list of commands: what `--help` says without loading them is what they say of themselves."""

import sys
from importlib import import_module

import pytest
from tests import children

from miro_sim.scenario.file import builtin_text
from mirotwin.cli import COMMANDS


@pytest.mark.parametrize("name", COMMANDS)
def test_the_list_says_of_a_command_what_it_says_itself(name):
    command = getattr(import_module(f"mirotwin.cli.{name}"), name)
    assert command.get_short_help_str(limit=200) == COMMANDS[name]
    assert command.name == name


def test_help_lists_every_command(mirotwin):
    code, out, _ = mirotwin("--help")
    assert code == 0
    assert [line.split()[0] for line in out.split("Commands:\n")[1].splitlines()] == list(COMMANDS)


def test_the_version_loads_no_command_and_nothing_hot():
    script = (
        "import sys\ntry:\n    from mirotwin.cli import main; main()\nexcept SystemExit: pass\n"
        "print(*sorted(n for n in sys.modules if n.startswith(('matplotlib', 'numpy', 'mirotwin.cli.r'))))"
    )
    done = children.run(
        [sys.executable, "-c", script, "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == ""


def test_a_run_without_a_figure_writes_the_other_files(mirotwin, tmp_path):
    short = tmp_path / "short.toml"
    text = builtin_text("fig6").replace("duration_s = 6.0", "duration_s = 0.03", 1)
    short.write_text(text, encoding="utf-8")
    code, _, err = mirotwin("run", short, "--out", tmp_path / "out", "--no-figure")
    assert (code, err) == (0, "")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["run.mcap", "summary.json"]


def test_help_loads_click_and_nothing_that_is_slow() -> None:
    script = (
        "import sys\nfrom mirotwin.cli import main\n"
        "try:\n    main(['--help'])\n"
        "finally:\n    print('loaded:', *sorted(sys.modules), file=sys.stderr)\n"
    )
    done = children.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("Usage: mirotwin")
    loaded = done.stderr.rpartition("loaded: ")[2].split()
    slow = {"numpy", "msgspec", "rich", "mcap", "matplotlib", "hashlib", "tomllib", "importlib.metadata"}
    assert not slow.intersection(loaded)
    ours = [name for name in loaded if name.startswith("miro")]
    assert ours == [
        "miro_exact",
        "miro_exact.bad_input",
        "miro_exact.engine",
        "mirotwin",
        "mirotwin.cli",
        "mirotwin.cli.program",
    ]
