"""Every frame of a run into a folder: `run --frames`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager

from mirotwin.camera.frame_folder import FrameFolder, frame_name
from mirotwin.camera.view import View


class SavedFrames:
    """The frames of all `views`, with the overlay or `plain`."""

    def __init__(self, folder: FrameFolder, views: Sequence[View], plain: bool) -> None:
        self.folder = folder
        self.views = views
        self.plain = plain

    def __repr__(self) -> str:
        return f"SavedFrames({self.folder!r}, {len(self.views)} networks)"

    def begin(self, undisturbed: AbstractContextManager[object]) -> None:
        """From now on each frame is saved; a file is written within `undisturbed`. Raises OutputError."""
        self.folder.open()

        def save(view: View) -> None:
            name = frame_name(view.network if len(self.views) > 1 else None, view.frame)
            self.folder.add(name, view.png(self.plain), undisturbed)

        for view in self.views:
            view.shows.append(save)
