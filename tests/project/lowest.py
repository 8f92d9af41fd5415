"""The tests at the lower bounds of `pyproject.toml`: `python -m tests.project.lowest`.

It works in `build/lowest`: a copy of the tree and a `.venv` in it, installed as README says, with every requirement
held to its bound, those of the build too. What requirements themselves require is not held: pip takes the newest that
fits. The copy has its own compiled modules, so the lowest Cython is tried as well. That takes minutes; with `--smoke`
the compiled modules of this tree are copied, and nothing is built. The rest of the command line goes to pytest.
"""

import argparse
import os
import re
import shutil
import sys
import tomllib
import venv
from pathlib import Path

from tests import children

ROOT = Path(__file__).parents[2]
PLACE = ROOT / "build" / "lowest"
PACKAGE_FOLDERS = ("exact", "protocol", "robot_fw", "host", "sim")
ENGINES = ("*.so", "*.pyd")
REQUIREMENT = re.compile(r"(?P<name>[\w.-]+)>=(?P<bound>[\w.]+)(,<[\w.]+)?")
SMOKE = (
    "tests/protocol/test_undetected.py",
    "tests/protocol/test_frames.py",
    "tests/protocol/test_pcapng.py",
    "tests/sim/test_scenario.py",
    "tests/mirotwin/test_recording.py",
    "tests/mirotwin/testing/test_plugin.py",
    "tests/mirotwin/run/test_scenarios_command.py",
)


def bounds(pyproject):
    """Package -> lowest version, of all that is required to build, to run and to test.

    Raises ValueError for a requirement that is not written as `name>=version` with at most an upper bound after it,
    and for one package with two bounds.
    """
    data = tomllib.loads(pyproject)
    project = data["project"]
    found = {}
    groups = [
        data["build-system"]["requires"],
        project["dependencies"],
        *project["optional-dependencies"].values(),
    ]
    for text in (text for group in groups for text in group if not text.startswith(f"{project['name']}[")):
        match = REQUIREMENT.fullmatch(text)
        if match is None:
            raise ValueError(f"{text!r} is not written as name>=version")
        if found.setdefault(match["name"], match["bound"]) != match["bound"]:
            raise ValueError(
                f"{match['name']} has two lower bounds: {found[match['name']]} and {match['bound']}"
            )
    return found


def constraints(lowest):
    """A constraints file for pip."""
    return "".join(f"{name}=={version}\n" for name, version in sorted(lowest.items()))


def tracked():
    """The files of this tree that git tracks."""
    done = children.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True, text=True)
    return [Path(name) for name in done.stdout.split("\0") if name and (ROOT / name).exists()]


def copy_tree(target, patterns):
    """Copies what git tracks, and files of this tree's packages that fit `patterns`."""
    names = tracked()
    for package in (*PACKAGE_FOLDERS, "mirotwin"):
        names += [path.relative_to(ROOT) for pattern in patterns for path in (ROOT / package).rglob(pattern)]
    for name in names:
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, target / name)


def install(tree, python, smoke):
    """Installs the tree at `tree`, editable, at its lower bounds; compiles nothing for the short form."""
    held = tree / "lowest.txt"
    lowest = bounds((tree / "pyproject.toml").read_text(encoding="utf-8"))
    held.write_text(constraints(lowest), encoding="utf-8")
    # pip before 25.3 applies the first to what a build needs, later ones the second
    environment = {**os.environ, "PIP_CONSTRAINT": str(held), "PIP_BUILD_CONSTRAINT": str(held)}
    environment |= {"MIROTWIN_PURE": "1"} if smoke else {}
    command = [str(python), "-m", "pip", "install", "-q", "-e", ".[develop]"]
    children.run(command, cwd=tree, env=environment, check=True)


def main(arguments):
    parser = argparse.ArgumentParser(prog="python -m tests.project.lowest")
    parser.add_argument("--smoke", action="store_true", help="build nothing and by default run few tests")
    options, rest = parser.parse_known_args(arguments)
    shutil.rmtree(PLACE, ignore_errors=True)
    tree = PLACE / "tree"
    copy_tree(tree, ENGINES if options.smoke else ())
    venv.create(tree / ".venv", with_pip=True)
    python = tree / ".venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    install(tree, python, options.smoke)
    tests = rest or (SMOKE if options.smoke else ())
    return children.run([str(python), "-m", "pytest", *tests], cwd=tree, check=False).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
