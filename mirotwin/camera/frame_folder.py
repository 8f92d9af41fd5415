"""A folder that fills with the frames of a run, each a PNG file that is whole as soon as it has its name.

A frame is written as frame-000123.part.png and renamed. A run that is broken off leaves the frames up to then.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from mirotwin.camera.view import View
from mirotwin.shell.outputs import entries, not_empty, part_name, refused

OPTION = "--frames"
_REMEDY = f"choose another folder with {OPTION}"
_OURS = re.compile(r"(net[0-9]+-)?frame-[0-9]{6,}(\.part)?\.png")


class FrameFolder:
    """The folder `path` for the frames of one run, checked at once. Raises OutputError if it is no folder, if it has
    content (unless `force`), and for a full disk. `fill` makes the folder, removes frames of an earlier run, and saves
    the frames of views from then on.
    """

    def __init__(self, path: Path, force: bool = False) -> None:
        self.path = path
        present = entries(path, OPTION)
        if present and not force:
            remedy = f"choose another with {OPTION}, or replace frame-*.png in it with --force"
            raise not_empty(path, present, remedy)

    def __repr__(self) -> str:
        return f"FrameFolder({self.path})"

    def fill(self, views: Sequence[View], undisturbed: AbstractContextManager[object]) -> None:
        """Saves each frame of `views`; a file is written within `undisturbed`. Raises OutputError."""
        self._open()

        def save(view: View) -> None:
            network = f"net{view.network}-" if len(views) > 1 else ""
            self._add(f"{network}frame-{view.frame:06d}.png", view.png(plain=True), undisturbed)

        for view in views:
            view.shows.append(save)

    def _open(self) -> None:
        """Makes the folder and removes frames of an earlier run, so that no old frame lies beside new ones."""
        with refused(self.path, _REMEDY):
            self.path.mkdir(parents=True, exist_ok=True)
            for name in entries(self.path, OPTION):
                if _OURS.fullmatch(name):
                    (self.path / name).unlink()

    def _add(self, name: str, data: bytes, undisturbed: AbstractContextManager[object]) -> None:
        """Writes a file; `undisturbed` delays asynchronous exceptions that would leave it half-written."""
        part = self.path / part_name(name)
        with undisturbed:
            try:
                with refused(self.path, _REMEDY):
                    part.write_bytes(data)
                    os.replace(part, self.path / name)
            finally:
                part.unlink(missing_ok=True)
