"""A new environment outside of this tree, and what is installed in it: as a user has it."""

import os
import shutil
import sys
import tarfile
import venv
from pathlib import Path

from tests import children
from tests.project.lowest import ENGINES, PACKAGE_FOLDERS, ROOT, copy_tree

PURE = {"MIROTWIN_PURE": "1"}
"""With this in the environment a build compiles nothing."""


class Clean:
    """A new environment in `folder`/venv; programs run in `folder` unless told, and see nothing of this tree."""

    def __init__(self, folder):
        self.folder = folder
        self.bin = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
        self.environment = {
            **{key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "PYTEST"))},
            "PATH": f"{self.bin}{os.pathsep}{os.environ['PATH']}",
        }

    def make(self, python=""):
        """Makes it, of another Python if one is given."""
        if python:
            self.must(python, "-m", "venv", self.folder / "venv")
        else:
            venv.create(self.folder / "venv", with_pip=True, symlinks=os.name != "nt")

    def run(self, *command, cwd=None, more=None):
        """Exit code, and both outputs. `more`: for its environment."""
        done = children.run(
            [*map(str, command)],
            cwd=cwd or self.folder,
            env={**self.environment, **(more or {})},
            capture_output=True,
            text=True,
        )
        return done.returncode, done.stdout + done.stderr

    def must(self, *command, cwd=None, more=None):
        """The outputs. Raises SystemExit with them for any exit code but 0."""
        code, out = self.run(*command, cwd=cwd, more=more)
        if code:
            raise SystemExit(f"{' '.join(map(str, command))}: exit code {code}\n{out}")
        return out

    def copy_engines(self):
        """Puts the compiled modules of this tree into what was installed."""
        where = "import sysconfig; print(sysconfig.get_path('platlib'))"
        target = Path(self.must(self.bin / "python", "-c", where).strip())
        for package in (*PACKAGE_FOLDERS, "mirotwin"):
            base = ROOT if package == "mirotwin" else ROOT / package
            for path in (one for pattern in ENGINES for one in (ROOT / package).rglob(pattern)):
                shutil.copy2(path, target / path.relative_to(base))


def source_archive(folder):
    """The source archive of what git tracks in this tree, made in `folder`."""
    copy_tree(folder / "tree", ())
    return _made("sdist", folder / "tree", folder / "dist")


def unpacked(archive, folder):
    """The one folder that a source archive has, in `folder`."""
    with tarfile.open(archive) as tar:
        tar.extractall(folder, filter="data")
    (tree,) = folder.iterdir()
    return tree


def pure_wheel(tree, folder):
    """A wheel for every machine, of a tree that is not this one (a build leaves files there), in `folder`."""
    return _made("bdist_wheel", tree, folder, PURE)


def _made(command, tree, folder, more=None):
    """The one file that a command of setup.py leaves in `folder`."""
    line = [sys.executable, "setup.py", "-q", command, "--dist-dir", str(folder)]
    done = children.run(line, cwd=tree, env={**os.environ, **(more or {})}, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(line)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    (made,) = folder.iterdir()
    return made
