"""The engine: compiled and source twins are never mixed, and a stale compiled module is refused."""

import platform
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


ROUNDING = """
import ctypes, ctypes.util
libm = ctypes.CDLL(ctypes.util.find_library("m"))
assert libm.fesetround({mode}) == 0
"""
FLUSHING = """
import ctypes, ctypes.util
libm = ctypes.CDLL(ctypes.util.find_library("m"))
environment = (ctypes.c_uint32 * 8)()
assert libm.fegetenv(environment) == 0
environment[{index}] |= {bits}
assert libm.fesetenv(environment) == 0
"""
"""`fenv_t` of glibc: on x86-64 MXCSR is its last word, on aarch64 FPCR is its first."""
MODES = {
    "x86_64": {"down": 0x400, "up": 0x800, "towards zero": 0xC00},
    "aarch64": {"down": 0x800000, "up": 0x400000, "towards zero": 0xC00000},
}
BOTH = "results (FTZ) and operands (DAZ)"
FLUSHED = {
    "x86_64": {"results (FTZ)": (7, 1 << 15), "operands (DAZ)": (7, 1 << 6), BOTH: (7, 1 << 15 | 1 << 6)},
    "aarch64": {BOTH: (0, 1 << 24)},
}
MACHINE = platform.machine() if sys.platform == "linux" else ""


def ends_of(code, then):
    """What becomes of a process whose arithmetic `code` changes, and which then does something."""
    command = [sys.executable, "-c", code + then]
    done = children.run(command, cwd=ROOT, capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


PROGRAM = "import sys; sys.argv[1:] = ['info']\nfrom mirotwin.entry import main; main()"


@pytest.mark.parametrize(("direction", "mode"), [*MODES.get(MACHINE, {}).items()])
def test_another_rounding_mode_is_refused_by_its_name(direction, mode):
    what = f"the processor rounds {direction} and not to nearest, so that runs would have other bits"
    remedy = (
        "something in this process, a plug-in or a library, called fesetround: let it set FE_TONEAREST again"
    )
    said = f"mirotwin: error: {what}; {remedy}\n"
    assert ends_of(ROUNDING.format(mode=mode), PROGRAM) == (2, "", said)


@pytest.mark.parametrize(("flushed", "place"), [*FLUSHED.get(MACHINE, {}).items()])
def test_subnormal_numbers_that_are_flushed_to_zero_are_refused_as_such(flushed, place):
    index, bits = place
    what = f"the processor takes subnormal {flushed} for zero, so that runs would have other bits"
    code, out, said = ends_of(FLUSHING.format(index=index, bits=bits), PROGRAM)
    assert (code, out, said.count("\n")) == (2, "", 1)
    assert said.startswith(
        f"mirotwin: error: {what}; something in this process, a plug-in or a library in LD_PRELOAD"
    )
    assert "-ffast-math" in said


@pytest.mark.skipif(not MACHINE or shutil.which("cc") is None, reason="needs Linux and a C compiler")
def test_a_library_that_was_linked_with_fast_math_is_noticed_when_a_world_is_made(tmp_path):
    """As a plug-in loads one: after the program has started."""
    (tmp_path / "a.c").write_text("int nothing;")
    library = tmp_path / "a.so"
    children.run(["cc", "-shared", "-ffast-math", "-o", library, tmp_path / "a.c"], check=True)
    then = f"""
import mirotwin, sys
from miro_exact.engine import EngineError
image, scenario = mirotwin.load_hex(mirotwin.image_path()), mirotwin.load_scenario("fig6").scenario
def refused():
    try:
        mirotwin.World(scenario, seed=0, image=image)
    except EngineError as error:
        return str(error)
print(refused())
import ctypes; ctypes.CDLL("{library}")
tiny = sys.float_info.min
print(tiny * 0.25 > 0.0 or refused())
"""
    code, out, said = ends_of("", then)
    assert (code, said) == (0, "")
    first, second = out.splitlines()
    assert first == "None"
    if second == "True":
        pytest.skip("this compiler leaves flushing to programs")
    assert "(FTZ)" in second


def test_sums_that_are_rounded_twice_are_refused_as_x87_arithmetic(monkeypatch):
    class Twice(float):
        """A double as the x87 unit adds it: to 64 bits first."""

        def __add__(self, other):
            return 1e16 + 4

    monkeypatch.setattr(engine, "_BIG", Twice(1e16))
    with pytest.raises(engine.EngineError, match=r"rounds sums of doubles twice .* use a 64-bit Python"):
        engine.check_arithmetic()
    monkeypatch.undo()
    engine.check_arithmetic()
