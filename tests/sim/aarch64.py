"""The same bits on another family of processors: `python -m tests.sim.aarch64`.

What belongs here: a twin of the installation for aarch64 in `build/aarch64`, made and run on this machine, and the
comparison of its digests with `tests/vectors/digests.json`. What a run is stands in `digest_of.py`.

    apt-get (own lists, nothing installed) -> root/   Python of Debian for arm64, its C library and headers
    pip, wheels for aarch64                -> site/   what `miro_sim.world` imports
    setup.py build with the cross compiler -> O2/lib/ the packages with their hot modules for aarch64
    qemu-aarch64-static root/usr/bin/python3.11 -m tests.sim.digest_of "fig6 0.5 s seed 7"

Needs Debian 12 with `gcc-aarch64-linux-gnu`, `libc6-dev-arm64-cross` and `qemu-user-static`. Delete `build/aarch64` to
begin
anew; otherwise only what changed is compiled again.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from tests import children
from tests.sim.digest_of import parse

from miro_exact import engine

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "build" / "aarch64"
GOLDEN = ROOT / "tests" / "vectors" / "digests.json"
VERSION = "3.11"  # of Debian 12's Python
DEBS = (
    *(f"{package}{VERSION}-minimal" for package in ("python", "libpython")),
    *(f"libpython{VERSION}-{part}" for part in ("stdlib", "dev")),
    *("libc6", "libgcc-s1", "zlib1g", "libexpat1"),
)
WHEELS = ("msgspec", "crcmod-plus", "intelhex")
TOOLS = {
    "aarch64-linux-gnu-gcc": "gcc-aarch64-linux-gnu libc6-dev-arm64-cross",
    "qemu-aarch64-static": "qemu-user-static",
    "apt-get": "apt",
    "dpkg": "dpkg",
}


class Missing(Exception):
    """Something that this machine lacks, with the remedy."""


def check_tools() -> None:
    """Raises Missing if a tool is not there."""
    missing = [TOOLS[tool] for tool in TOOLS if shutil.which(tool) is None]
    if missing:
        raise Missing(f"apt-get install {' '.join(missing)}")


def install_python(folder: Path) -> None:
    """Debian's Python for arm64 into `folder`/root, by packages that are unpacked and not installed."""
    root = folder / "root"
    if (root / "usr" / "bin" / f"python{VERSION}").exists():
        return
    state = folder / "apt"
    for part in ("lists/partial", "cache/archives/partial", "debs"):
        (state / part).mkdir(parents=True, exist_ok=True)
    settings = {
        "APT::Architecture": "arm64",
        "APT::Architectures": "arm64",
        "APT::Sandbox::User": "",
        "Dir::State::Lists": state / "lists",
        "Dir::State::status": "/dev/null",
        "Dir::Cache": state / "cache",
    }
    options = [word for name, value in settings.items() for word in ("-o", f"{name}={value}")]
    run(["apt-get", *options, "-qq", "update"])
    run(["apt-get", *options, "-qq", "download", *DEBS], cwd=state / "debs")
    for deb in sorted((state / "debs").glob("*.deb")):
        run(["dpkg", "-x", str(deb), str(root)])


def install_wheels(folder: Path) -> None:
    """What the world imports, for aarch64, into `folder`/site."""
    site = folder / "site"
    if all((site / name).exists() for name in ("msgspec", "crcmod", "intelhex")):
        return
    platform = ["--platform", "manylinux2014_aarch64", "--only-binary", ":all:", "--python-version", VERSION]
    quiet = ["-q", "--no-warn-conflicts", "--disable-pip-version-check"]
    command = [sys.executable, "-m", "pip", "install", *quiet, "--no-deps", "--target", str(site)]
    run([*command, *platform, *WHEELS])


def build(folder: Path, level: str) -> Path:
    """The packages, their hot modules translated by Cython here and compiled for aarch64 with `level` (O0, O2).

    Returns where they are.
    """
    headers = folder / "root" / "usr" / "include"
    base = folder / level
    base.mkdir(parents=True, exist_ok=True)
    compiler = base / "cc"  # headers go before the options of `setup.py`, the level of optimising behind them
    flags = f"-I{headers}/python{VERSION} -I{headers}"
    compiler.write_text(f'#!/bin/sh\nexec aarch64-linux-gnu-gcc {flags} "$@" -{level} -g0\n')
    compiler.chmod(0o755)
    settings = {
        "CC": str(compiler),
        "LDSHARED": "aarch64-linux-gnu-gcc -shared",
        "SETUPTOOLS_EXT_SUFFIX": f".cpython-{VERSION.replace('.', '')}-aarch64-linux-gnu.so",
    }
    where = ["--build-base", str(base), "--build-lib", str(base / "lib")]
    run([sys.executable, "setup.py", "-q", "build", *where], env=settings)
    return base / "lib"


def copy(folder: Path) -> Path:
    """The packages as sources, for the uncompiled engine. Returns where they are."""
    lib = folder / "python" / "lib"
    run([sys.executable, "setup.py", "-q", "build_py", "--build-lib", str(lib)])
    return lib


def digests(folder: Path, lib: Path, names: Sequence[str], which: str) -> list[str]:
    """Of the runs so named, by an aarch64 processor with the packages in `lib`."""
    python = [str(folder / "root" / "usr" / "bin" / f"python{VERSION}"), "-m", "tests.sim.digest_of"]
    command = ["qemu-aarch64-static", "-L", str(folder / "root"), *python, "--engine", which, *names]
    path = os.pathsep.join((str(lib), str(folder / "site")))
    return run(command, env={"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}).split()


def run(command: Sequence[str], cwd: Path = ROOT, env: dict[str, str] | None = None) -> str:
    """What it prints. Raises Missing with the end of its complaint if it fails."""
    done = children.run(command, cwd=cwd, env={**os.environ, **(env or {})}, capture_output=True, text=True)
    if done.returncode:
        end = "\n".join((done.stderr or done.stdout).splitlines()[-20:])
        raise Missing(f"{' '.join(command[:3])} .. failed with {done.returncode}:\n{end}")
    return done.stdout


def main() -> int:
    """Prints a line for each run; exit code 1 if a digest differs, 2 if something is missing."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--engine", choices=engine.ENGINES, default="compiled")
    parser.add_argument(
        "--beside", action="append", default=[], metavar="NAME",
        help="also this run, compared with this machine's own digest; like 'fig8 6 s seed 3'; repeatable",
    )  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="-O0, and the shortest run of the table only")
    options = parser.parse_args()
    try:
        for name in options.beside:
            parse(name)
    except ValueError as error:
        parser.error(str(error))
    expected: dict[str, str] = json.loads(GOLDEN.read_text())
    if options.quick:
        shortest = min(expected, key=lambda name: parse(name).duration_s)
        expected = {shortest: expected[shortest]}
    begin = time.monotonic()
    try:
        check_tools()
        install_python(FOLDER)
        install_wheels(FOLDER)
        lib = copy(FOLDER) if options.engine == "python" else build(FOLDER, "O0" if options.quick else "O2")
        built = time.monotonic()
        for name in options.beside:
            command = [sys.executable, "-m", "tests.sim.digest_of", "--engine", options.engine, name]
            expected[name] = run(command).strip()
        found = digests(FOLDER, lib, list(expected), options.engine)
    except Missing as error:
        print(f"aarch64: {error}", file=sys.stderr)
        return 2
    equal = True
    for name, digest in zip(expected, found, strict=True):
        equal = equal and digest == expected[name]
        print(f"{name}: {digest} {'equal' if digest == expected[name] else 'DIFFERS from ' + expected[name]}")
    print(
        f"aarch64, {options.engine}: built in {built - begin:.0f} s, ran in {time.monotonic() - built:.0f} s"
    )
    return 0 if equal else 1


if __name__ == "__main__":
    sys.exit(main())
