"""The same bits on another family of processors: `python -m tests.sim.machines s390x`.

What a run is stands in `digests.py`.

    apt-get (own lists, nothing installed) -> root/   Python of Debian for that machine, its C library and headers
    pip                                    -> site/   what `miro_sim.world` imports: wheels, or built from source
    setup.py build with the cross compiler -> O2/lib/ the packages with their hot modules for that machine
    qemu-s390x-static root/usr/bin/python3.11 -m tests.sim.digests "fig6 0.5 s seed 7"

Needs Debian 12 with `qemu-user-static` and the machine's cross compiler; the command names what is missing. Delete
`build/NAME` to start again; otherwise only what changed is compiled again.

A Python that rounds sums twice (x87 arithmetic, Debian's for i386) must refuse the run in one line. Any digest but
the golden one is a failure.
"""

import argparse
import os
import shutil
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from miro_exact import engine
from tests import children
from tests.sim.digests import BOARDS, GOLDEN, REFUSED, SHORT, SHORT_BOARDS, parse, table_in

ROOT = Path(__file__).parents[2]
VERSION = "3.11"  # of Debian 12's Python
DEBS = (
    *(f"{package}{VERSION}-minimal" for package in ("python", "libpython")),
    *(f"libpython{VERSION}-{part}" for part in ("stdlib", "dev")),
    *("libc6", "libgcc-s1", "zlib1g", "libexpat1"),
)
PACKAGES = {"msgspec": "msgspec", "crcmod-plus": "crcmod", "tomli-w": "tomli_w", "click": "click"}
"""Name on the package index -> folder. What `miro_sim.world`, scenarios with settings and tests of boards import."""


class Missing(Exception):
    """Something that this machine lacks, with the remedy."""


class Refused(Exception):
    """The other machine's Python refused the run; its line."""


@dataclass(frozen=True)
class Machine:
    """A family of processors. `wheels`: the tag of its wheels, "" if what has C is built here from its source."""

    name: str
    debian: str
    triplet: str
    libc: str
    wheels: str = ""

    @cached_property
    def folder(self):
        """Where its installation is made."""
        return ROOT / "build" / self.name

    @property
    def compiler(self):
        return f"{self.triplet}-gcc"

    @property
    def emulator(self):
        return f"qemu-{self.name}-static"

    @property
    def multiarch(self):
        """Debian's name of its library folder."""
        return self.triplet.replace("i686", "i386")

    @property
    def tools(self):
        """Program -> Debian packages that bring it."""
        return {
            self.compiler: f"gcc-{self.triplet} {self.libc}",
            self.emulator: "qemu-user-static",
            "apt-get": "apt",
            "dpkg": "dpkg",
        }


MACHINES = {
    machine.name: machine
    for machine in (
        Machine(
            "aarch64", "arm64", "aarch64-linux-gnu", "libc6-dev-arm64-cross", wheels="manylinux2014_aarch64"
        ),
        Machine("s390x", "s390x", "s390x-linux-gnu", "libc6-dev-s390x-cross"),
        Machine("i386", "i386", "i686-linux-gnu", "libc6-dev-i386-cross"),
    )
}


def check_tools(machine):
    """Raises Missing if a tool is not there."""
    missing = [packages for tool, packages in machine.tools.items() if shutil.which(tool) is None]
    if missing:
        raise Missing(f"apt-get install {' '.join(missing)}")


def install_python(machine):
    """Debian's Python for that machine into root/, by packages that are unpacked and not installed."""
    root = machine.folder / "root"
    if (root / "usr" / "bin" / f"python{VERSION}").exists():
        return
    state = machine.folder / "apt"
    for part in ("lists/partial", "cache/archives/partial", "debs"):
        (state / part).mkdir(parents=True, exist_ok=True)
    settings = {
        "APT::Architecture": machine.debian,
        "APT::Architectures": machine.debian,
        "APT::Sandbox::User": "",
        "Dir::State::Lists": state / "lists",
        "Dir::State::status": "/dev/null",
        "Dir::Cache": state / "cache",
    }
    options = [word for name, value in settings.items() for word in ("-o", f"{name}={value}")]
    with suppress(Missing):  # one list of several may be broken; the download says whether it is needed
        run(["apt-get", *options, "-qq", "update"])
    run(["apt-get", *options, "-qq", "download", *DEBS], cwd=state / "debs")
    for deb in sorted((state / "debs").glob("*.deb")):
        run(["dpkg", "-x", str(deb), str(root)])


def cross_compiler(machine, folder, level):
    """The environment in which setuptools compiles for that machine, with `level` of optimising (O0, O2)."""
    headers = machine.folder / "root" / "usr" / "include"
    folder.mkdir(parents=True, exist_ok=True)
    compiler = folder / "cc"  # headers go before the options of setuptools, the level after them
    flags = f"-I{headers}/python{VERSION} -I{headers}"
    compiler.write_text(f'#!/bin/sh\nexec {machine.compiler} {flags} "$@" -{level} -g0\n')
    compiler.chmod(0o755)
    return {
        "CC": str(compiler),
        "LDSHARED": f"{machine.compiler} -shared",
        "SETUPTOOLS_EXT_SUFFIX": f".cpython-{VERSION.replace('.', '')}-{machine.multiarch}.so",
    }


def install_packages(machine):
    """What the world imports into site/: wheels of that machine, or built here from their sources."""
    site = machine.folder / "site"
    if all((site / folder).exists() for folder in PACKAGES.values()):
        return
    quiet = ["-q", "--no-warn-conflicts", "--disable-pip-version-check"]
    command = [sys.executable, "-m", "pip", "install", *quiet, "--no-deps", "--target", str(site)]
    if machine.wheels:
        platform = ["--platform", machine.wheels, "--only-binary", ":all:", "--python-version", VERSION]
        run([*command, *platform, *PACKAGES])
        return
    sources = ["--no-cache-dir", "--no-binary", "msgspec,crcmod-plus"]
    run([*command, *sources, *PACKAGES], env=cross_compiler(machine, machine.folder / "packages", "O2"))


def build(machine, level):
    """The packages, their hot modules translated by Cython here and compiled with `level`.

    Returns where they are.
    """
    base = machine.folder / level
    where = ["--build-base", str(base), "--build-lib", str(base / "lib")]
    run([sys.executable, "setup.py", "-q", "build", *where], env=cross_compiler(machine, base, level))
    return base / "lib"


def copy(machine):
    """The packages as sources, for the uncompiled engine. Returns where they are."""
    lib = machine.folder / "python" / "lib"
    run([sys.executable, "setup.py", "-q", "build_py", "--build-lib", str(lib)])
    return lib


def digests(machine, lib, names, which):
    """Of the runs so named, by a processor of that machine with the packages in `lib`. Raises Refused."""
    root = machine.folder / "root"
    python = [str(root / "usr" / "bin" / f"python{VERSION}"), "-m", "tests.sim.digests"]
    command = [machine.emulator, "-L", str(root), *python, "--engine", which, *names]
    path = os.pathsep.join((str(lib), str(machine.folder / "site"), str(ROOT)))
    # The sources come last: their `mirotwin` has no hot modules for that machine, and lies in the working folder.
    env = {"PYTHONPATH": path, "PYTHONSAFEPATH": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    return run(command, env=env).split()


def run(command, cwd=ROOT, env=None):
    """What it prints. Raises Refused, or Missing with the end of its complaint if it fails."""
    done = children.run(command, cwd=cwd, env={**os.environ, **(env or {})}, capture_output=True, text=True)
    if done.returncode == REFUSED:
        raise Refused(done.stderr.strip())
    if done.returncode:
        end = "\n".join((done.stderr or done.stdout).splitlines()[-20:])
        raise Missing(f"{' '.join(command[:3])} .. failed with {done.returncode}:\n{end}")
    return done.stdout


def prepare(machine, which, level):
    """Its whole installation, for the engine `which`. Returns where the packages are."""
    check_tools(machine)
    install_python(machine)
    install_packages(machine)
    return copy(machine) if which == "python" else build(machine, level)


def arguments():
    """Those of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("machine", choices=MACHINES)
    parser.add_argument("--engine", choices=engine.ENGINES, default="compiled")
    parser.add_argument(
        "--beside", action="append", default=[], metavar="NAME",
        help="also this run, compared with this machine's own digest; like 'fig8 6 s seed 3'; repeatable",
    )  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="-O0")
    parser.add_argument(
        "--whole-runs", action="store_true", help="all runs of both tables, not only the short ones"
    )
    options = parser.parse_args()
    try:
        for name in options.beside:
            parse(name)
    except ValueError as error:
        parser.error(str(error))
    return options


def wanted(options):
    """Name of a run -> digest that it must have."""
    golden = table_in(GOLDEN) | table_in(BOARDS)
    if not options.whole_runs:
        golden = {name: golden[name] for name in (SHORT, *SHORT_BOARDS)}
    command = [sys.executable, "-m", "tests.sim.digests", "--engine", options.engine]
    return golden | {name: run([*command, name]).strip() for name in options.beside}


def main():
    """Prints a line for each run; exit code 1 if a digest differs, 2 if something is missing."""
    options = arguments()
    machine = MACHINES[options.machine]
    begin = time.monotonic()
    try:
        lib = prepare(machine, options.engine, "O0" if options.quick else "O2")
        built = time.monotonic()
        expected = wanted(options)
        found = digests(machine, lib, list(expected), options.engine)
    except Refused as refused:
        print(f"{machine.name}, {options.engine}: refused: {refused}")
        return 0
    except Missing as error:
        print(f"{machine.name}: {error}", file=sys.stderr)
        return 2
    for name, digest in zip(expected, found, strict=True):
        print(f"{name}: {digest} {'equal' if digest == expected[name] else 'DIFFERS from ' + expected[name]}")
    times = f"built in {built - begin:.0f} s, ran in {time.monotonic() - built:.0f} s"
    print(f"{machine.name}, {options.engine}: {times}")
    return 0 if found == list(expected.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
