"""The packages as a stranger gets them: `python -m tests.project.packages`.

    the source archive    has all that git tracks
    the compiled wheel    built from the archive by each Python; compiled modules run
    the pure wheel        built from the archive once, installed under each Python; nothing is compiled, same digest
    no compiler           the archive installed under the newest Python with a compiler that fails; as the pure wheel

Compiling takes minutes for each Python; `--smoke` compiles nothing, takes this Python alone, and puts the compiled
modules of this tree into its environment.
"""

import argparse
import shutil
import sys
import tarfile
import tempfile
import time
from pathlib import Path

from tests import children
from tests.project.clean import Clean, pure_wheel, source_archive, unpacked
from tests.project.lowest import tracked

LOWEST = 11
"""The lowest 3.x that `requires-python` allows."""
INSTALLED = Path("tests/project/installed.py")
MINOR = "import sys; print(sys.version_info[0] * 1000 + sys.version_info[1])"


def pythons():
    """One Python of each 3.x from 3.11 on, the oldest first: on the path, of pyenv, and this one."""
    named = [shutil.which(f"python3.{minor}") for minor in range(LOWEST, LOWEST + 10)]
    candidates = [Path(name) for name in named if name]
    candidates += sorted(Path.home().glob(".pyenv/versions/3.*/bin/python3"))
    found = {}
    for path in (Path(sys.executable), *candidates):
        done = children.run([str(path), "-c", MINOR], capture_output=True, text=True)
        version = done.stdout.strip()
        if done.returncode == 0 and version.isdigit() and int(version) >= 3000 + LOWEST:
            found.setdefault(int(version), path)
    return [path for _, path in sorted(found.items())]


def left_out(archive):
    """What git tracks and a source archive does not have."""
    with tarfile.open(archive) as tar:
        there = {name.partition("/")[2] for name in tar.getnames()}
    return [name for name in tracked() if name.as_posix() not in there]


def problems(clean, tree, engine):
    """What the installed program does wrong, by the test that the archive has; `tree`: the archive, unpacked."""
    code, out = clean.run("python", tree / INSTALLED, "--engine", engine)
    if code:
        yield out
    else:
        print(f"  {out.strip()}", flush=True)


def tried(folder, tree, python, archive, pure, newest):
    """Under one Python: the compiled wheel, the pure one; for the newest the archive without a compiler."""
    compiled = Clean(folder / "compiled")
    compiled.folder.mkdir(parents=True)
    compiled.make(python)
    begun = time.perf_counter()
    compiled.must("pip", "wheel", "-q", "--no-deps", "-w", "wheel", archive)
    (wheel,) = (compiled.folder / "wheel").iterdir()
    print(f"{wheel.name}: built in {time.perf_counter() - begun:.0f} s", flush=True)
    compiled.must("pip", "install", "-q", wheel)
    yield from problems(compiled, tree, "compiled")
    compiled.must("mirotwin", "run", "fig6")
    slow = Clean(folder / "pure")
    slow.folder.mkdir()
    slow.make(python)
    print(pure.name, flush=True)
    slow.must("pip", "install", "-q", pure)
    yield from problems(slow, tree, "python")
    if newest:
        print(f"{archive.name}, CC=false", flush=True)
        slow.must("pip", "uninstall", "-q", "-y", "mirotwin")
        slow.must("pip", "install", "-q", archive, more={"CC": "false"})
        yield from problems(slow, tree, "python")


def smoke(folder, tree, pure):
    """The pure wheel under this Python, then with the compiled modules of this tree."""
    clean = Clean(folder)
    clean.make()
    print(pure.name, flush=True)
    clean.must("pip", "install", "-q", pure)
    yield from problems(clean, tree, "python")
    clean.copy_engines()
    yield from problems(clean, tree, "compiled")


def found(folder, chosen):
    """All that is wrong. `chosen`: the Pythons; none for the short form."""
    archive = source_archive(folder)
    yield from (f"{archive.name} lacks {name}" for name in left_out(archive))
    tree = unpacked(archive, folder / "source")
    pure = pure_wheel(tree, folder / "pure")
    if not pure.name.endswith("-py3-none-any.whl"):
        yield f"{pure.name} is for some machines only"
    for number, python in enumerate(chosen):
        yield from tried(folder / str(number), tree, python, archive, pure, python == chosen[-1])
    if not chosen:
        yield from smoke(folder, tree, pure)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--smoke", action="store_true", help="take the compiled modules of this tree")
    parser.add_argument(
        "--python", action="append", type=Path, help="instead of all at hand; may be repeated"
    )
    given = parser.parse_args(arguments)
    chosen = [] if given.smoke else (given.python or pythons())
    with tempfile.TemporaryDirectory(prefix="mirotwin-packages-") as name:
        wrong = [*found(Path(name), chosen)]
    for what in wrong:
        print(what, file=sys.stderr)
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
