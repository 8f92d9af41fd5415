"""Building with and without a C compiler, and what happens when source and compiled module drift apart.

A copy of the tree is built in place and run through PYTHONPATH: the same steps as an installation, without a
package index.
"""

import json
import os
import shutil
import sys
from importlib import resources
from pathlib import Path

import pytest

from miro_exact import engine, hot_modules
from tests import children

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
GOLDEN = ROOT / "tests" / "vectors" / "digests.json"
SOURCES = ("exact", "protocol", "robot_fw", "host", "sim", "mirotwin")


@pytest.fixture
def tree(tmp_path):
    """A copy of what an installation builds from, without compiled modules."""
    copy = tmp_path / "tree"
    copy.mkdir()
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy / name)
    for name in SOURCES:
        shutil.copytree(
            ROOT / name, copy / name, ignore=shutil.ignore_patterns("*.so", "*.pyd", "__pycache__")
        )
    return copy


def with_compiled_modules(tree):
    for built in engine.install().compiled():
        shutil.copy(built, tree / built.relative_to(ROOT))
    return tree


def python(tree, *arguments, **env):
    """Runs Python on the copy; -S would lose the dependencies, so the copy only comes first on the path."""
    path = os.pathsep.join(str(tree / name) for name in SOURCES)
    return children.run(
        [sys.executable, *arguments],
        cwd=tree,
        env={**os.environ, "PYTHONPATH": path, **env},
        capture_output=True,
        text=True,
    )


def mirotwin(tree, *arguments):
    return python(tree, "-c", "from mirotwin.commands import main; main()", *arguments)


def build(tree, *command, **env):
    built = python(tree, "setup.py", "-q", *command, **env)
    assert built.returncode == 0, built.stderr


def build_one_without_a_compiler(tree):
    build(tree, "build_ext", "--inplace", "--only", "miro_exact.rng", CC="no-such-compiler")


def run_short(tree, *options):
    short = ("fig6", "--set", "duration_s=0.5", "--seed", "7", "--out", "out", "--quiet")
    return mirotwin(tree, "run", *short, *options)


def test_without_a_compiler_the_package_builds_and_gives_the_golden_digest(tree):
    build_one_without_a_compiler(tree)
    assert list(tree.rglob("rng.c"))
    assert not list(tree.rglob("*.so"))
    done = run_short(tree)
    assert done.returncode == 0, done.stderr
    summary = json.loads((tree / "out" / "summary.json").read_text())
    assert summary["engine"] == "python"
    assert summary["digest"] == json.loads(GOLDEN.read_text())["fig6 0.5 s seed 7"]
    about = mirotwin(tree, "info")
    assert about.returncode == 0, about.stderr
    assert "python (0 of" in about.stdout


def test_asking_for_compiled_modules_that_are_not_there_is_an_error_with_a_remedy(tree):
    done = run_short(tree, "--engine", "compiled")
    assert done.returncode == 2
    assert "no compiled module" in done.stderr
    assert "pip install" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(engine.active() != "compiled", reason="no compiled modules here")
def test_a_compiled_module_whose_source_has_changed_is_refused(tree):
    with_compiled_modules(tree)
    with (tree / "robot_fw/miro_robot/mcs51/cpu.py").open("a") as source:
        source.write("\n# changed\n")
    done = run_short(tree)
    assert done.returncode == 2
    assert "stale" in done.stderr
    assert "Traceback" not in done.stderr
    assert run_short(tree, "--engine", "python", "--force").returncode == 0


@pytest.mark.skipif(engine.active() != "compiled", reason="no compiled modules here")
def test_building_again_removes_the_compiled_twin_of_a_module_that_is_hot_no_more(tree):
    with_compiled_modules(tree)
    orphan = hot_modules.compiled_file(ROOT / "exact/miro_exact/rng.py")
    left_over = tree / "sim/miro_sim" / orphan.name.replace("rng", "clock")
    shutil.copy(orphan, left_over)
    build_one_without_a_compiler(tree)
    assert not left_over.exists()
    assert hot_modules.compiled_file(tree / "exact/miro_exact/rng.py").exists()


def test_an_installation_puts_one_file_beside_pyserials_handlers_and_replaces_none(tree):
    build(tree, "build_py", "--build-lib", "built")
    put = [
        str(path.relative_to(tree / "built")) for path in (tree / "built/serial").rglob("*") if path.is_file()
    ]
    assert put == ["serial/urlhandler/protocol_miro.py"]
    own = resources.files("serial") / "urlhandler"
    assert {entry.name for entry in own.iterdir()} >= {"__init__.py", "protocol_loop.py"}
    assert (tree / "built/mirotwin/ports/serial_port.py").exists()


def test_a_wheel_carries_the_examples_without_what_tools_leave_behind(tree):
    shutil.copytree(ROOT / "examples", tree / "examples")
    for name in ("laws/build/x.py", "laws/example_laws.egg-info/PKG-INFO", "laws/__pycache__/x.pyc"):
        (tree / "examples" / name).parent.mkdir(parents=True, exist_ok=True)
        (tree / "examples" / name).write_text("")
    build(tree, "build_py", "--build-lib", "built")
    examples = tree / "built/mirotwin/testing/examples"
    assert (examples / "firmware/late.ihx").is_file()
    assert (examples / "hil/.github/workflows/firmware.yml").is_file()
    laws = sorted(path.name for path in (examples / "laws").iterdir())
    assert laws == ["pursuit.toml", "pursuit_law.py", "pyproject.toml", "samson.toml", "samson_law.py"]
