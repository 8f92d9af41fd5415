"""The folder of a campaign, by files:

OUT/
  crashes/NAME.stream      a case: `mirotwin replay` gives the verdict again
  crashes/NAME.input       the minimised input, for --corpus
  crashes/NAME.txt         the same as readable lines
  crashes/NAME.info        its coverage, as an lcov tracefile
  unconfirmed/NAME.*       failures that a world did not confirm: the same files, and a stream without a check
  covering/SYMBOL.*        the input that reached a function (--covering)
  corpus/                  inputs that found something new
  seeds/, dictionary       the start of the campaign
  engine/                  the engine's own
  coverage.info            coverage of all inputs
  summary.json
"""

from __future__ import annotations

import glob
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from miro_exact.bad_input import BadInput
from miro_exact.inputs import replace_file
from mirotwin.shell.outputs import (
    OutputError,
    entries,
    locked_folder,
    not_empty,
    refused,
    some,
    told_when_full,
)

FOLDERS = ("crashes", "unconfirmed", "covering", "corpus", "seeds", "engine")
FILES = ("coverage.info", "coverage.info.lst", "summary.json", "dictionary")
SCRATCH = ("corpus", "seeds", "engine")
"""Folders of these that are taken away where a campaign breaks off with an error."""
OPTION = "--out"


class CampaignFolder:
    """The folder `path` of a campaign, locked while it is written (`filled`). Raises OutputError if another process
    writes to it, or if it is not empty. With `force` the files of an earlier campaign are removed; a folder with any
    other file is still refused.
    """

    def __init__(self, path: Path, force: bool = False) -> None:
        self.path = path
        self._force = force
        entries(path, OPTION)
        if path.is_dir():
            with locked_folder(path):
                pass
        self._replaceable()

    def _replaceable(self) -> list[str]:
        """Names of the files that an earlier campaign left. Raises OutputError if they must stay."""
        present = entries(self.path, OPTION)
        others = [name for name in present if name not in (*FOLDERS, *FILES)]
        if present and not self._force:
            remedy = f"choose another with {OPTION}, or replace an earlier campaign with --force"
            raise not_empty(self.path, present, remedy)
        if others:
            reason = f"holds what no campaign leaves ({some(others)})"
            raise OutputError(self.path, reason, f"choose another folder with {OPTION}")
        return present

    def _empty(self) -> None:
        """Removes the files of an earlier campaign."""
        for name in self._replaceable():  # again: another campaign may have filled it since
            if (self.path / name).is_dir() and not (self.path / name).is_symlink():
                shutil.rmtree(self.path / name)
            else:
                (self.path / name).unlink()

    def folder(self, name: str) -> Path:
        """Creates and returns one of its subfolders."""
        assert name in FOLDERS
        path = self.path / name
        path.mkdir(parents=True, exist_ok=True)
        return path

    def write(self, folder: str, name: str, data: bytes | str) -> Path:
        """Writes a file whole or not at all; returns where it is."""
        path = (self.folder(folder) if folder else self.path) / name
        replace_file(path, data.encode("utf-8", "surrogateescape") if isinstance(data, str) else data)
        return path

    @contextmanager
    def filled(self) -> Iterator[None]:
        """Makes the folder, and holds it while the campaign writes there. Raises OutputError.

        A full disk leaves crashes only, or no folder.
        """
        with ExitStack() as held:
            with refused(self.path, f"choose another folder with {OPTION}"):
                self.path.mkdir(parents=True, exist_ok=True)
                held.enter_context(locked_folder(self.path))
                self._empty()
            try:
                with told_when_full(self.path, OPTION):
                    yield
            except OutputError:
                self._leave_crashes()
                raise

    def _leave_crashes(self) -> None:
        for name in SCRATCH:
            shutil.rmtree(self.path / name, ignore_errors=True)
        for name in FILES:
            (self.path / name).unlink(missing_ok=True)
        for path in (*self.path.rglob("*"), self.path):
            with suppress(OSError):  # a folder with crashes in it, or a crash
                path.rmdir()

    def remove(self, folder: str, name: str) -> None:
        """Takes away the files of a crash."""
        for path in self.folder(folder).glob(f"{glob.escape(name)}.*"):
            path.unlink()


def unused(path: Path) -> Path:
    """`path`, or the first empty one of `path-2`, `path-3`, .., so that no earlier result is lost."""
    number, free = 1, path
    while free.is_dir() and any(free.iterdir()):
        number += 1
        free = path.with_name(f"{path.name}-{number}")
    return free


def check_outside(path: Path, corpus: Path | None) -> None:
    """Refuses a corpus that the campaign would take away. Raises BadInput."""
    if corpus is not None and path.exists() and corpus.resolve().is_relative_to(path.resolve()):
        reason = f"lies in {path}, which the campaign replaces"
        raise BadInput(corpus, "--corpus", reason, f"choose another folder with {OPTION}")
