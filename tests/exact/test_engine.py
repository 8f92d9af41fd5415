"""The engine: compiled and source twins are never mixed, and a stale compiled module is refused."""

import shutil
import sys
from pathlib import Path

import pytest

from miro_exact import engine, hot_modules
from tests import children

ROOT = Path(__file__).parents[2]


def test_a_stamp_that_is_not_the_sources_hash_is_refused_with_a_remedy():
    with pytest.raises(engine.EngineError, match=r"stale.*pip install"):
        engine.refuse_if_stale("miro_robot.nowhere", "0" * 64)


def test_the_engine_cannot_be_changed_once_it_is_in_use():
    script = (
        "from miro_exact import engine\n"
        "engine.select('python')\n"
        "try:\n    engine.select('compiled')\n"
        "except engine.EngineError as error:\n    print('refused:', error)\n"
    )
    done = children.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("refused: engine python is already in use")


@pytest.fixture
def package(tmp_path):
    """Three hot modules: `upper` builds upon the layout of `lower`, `other` stands alone."""
    for name, layout in (
        ("lower", "cdef class Lower:\n    cdef int a\n"),
        ("upper", "from house.lower cimport Lower\n"),
        ("other", "cdef class Other:\n    cdef int b\n"),
    ):
        (tmp_path / f"{name}.py").write_text(f'"""{name}"""\n')
        (tmp_path / f"{name}.pxd").write_text(layout)
    return tmp_path


@pytest.mark.parametrize(
    ("file", "stale"),
    [
        ("lower.pxd", {"house.lower", "house.upper"}),
        ("upper.pxd", {"house.upper"}),
        ("lower.py", {"house.lower"}),
        ("other.pxd", {"house.other"}),
    ],
)
def test_a_module_is_stale_after_a_change_of_its_source_or_of_a_layout_it_builds_upon(package, file, stale):
    dirs = {"house": package}
    before = hot_modules.source_hashes(dirs, hot_modules.hot_sources(dirs))
    with (package / file).open("a") as changed:
        changed.write("# changed\n")
    after = hot_modules.source_hashes(dirs, hot_modules.hot_sources(dirs))
    assert {name for name in after if after[name] != before[name]} == stale


def test_an_engine_that_was_not_built_is_refused_for_that_reason_whatever_is_in_use(monkeypatch):
    finder = engine.EngineFinder()
    finder.engine = "python"
    monkeypatch.setattr(finder, "missing", lambda: ["miro_exact.rng"])
    monkeypatch.setattr(engine, "install", lambda: finder)
    with pytest.raises(engine.EngineError, match=r"no compiled module for miro_exact\.rng; reinstall with"):
        engine.select("compiled")


def test_a_checkout_that_lies_before_the_installed_package_does_not_change_the_engine(tmp_path):
    """`pip install .`, then a script in the checkout: `mirotwin` is the source, all else is compiled."""
    if engine.active() != "compiled":
        pytest.skip("nothing is compiled")
    shutil.copytree(
        ROOT / "mirotwin", tmp_path / "mirotwin", ignore=shutil.ignore_patterns("*.so", "__pycache__")
    )
    script = (
        "from mirotwin.recording import rows\n"
        "from miro_exact import engine, rng\n"
        "engine.select('compiled')\n"
        "print(engine.active(), rows.__file__, rng.__file__)\n"
    )
    command = [sys.executable, "-c", script]
    done = children.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    active, source, compiled = done.stdout.split()
    assert (active, source) == ("compiled", str(tmp_path / "mirotwin" / "recording" / "rows.py"))
    assert not compiled.endswith(".py")


def test_arithmetic_that_rounds_twice_is_refused_in_one_line(monkeypatch):
    class Twice(float):
        """A double as the x87 unit adds it: to 64 bits first."""

        def __add__(self, other):
            return 1e16 + 4

    monkeypatch.setattr(engine, "float", Twice, raising=False)
    engine.check_arithmetic.cache_clear()
    with pytest.raises(engine.EngineError, match=r"rounds sums of doubles twice .* use a 64-bit Python"):
        engine.check_arithmetic()
    monkeypatch.undo()
    engine.check_arithmetic()
