"""The camera of one network of a world, as one looks at it: each frame as a PNG, with or without the overlay.

What belongs here: asking a world's camera for its pictures. What does not: how they are drawn (`overlay`), files
(`frame_folder`). It changes no bit of a run: notes and the picture are no state.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from miro_exact.bad_input import BadInput
from miro_exact.clock import seconds
from miro_host.eye.notes import Notes
from miro_sim.world.network import Network
from miro_sim.world.sight import PixelSight
from mirotwin.looking.picture import Picture, png, taken

NO_PIXELS = 'choose kind = "pixels" in [camera] (--set camera.kind=pixels)'


class View:
    """Looks at every frame of a network from now on and hands it to `show(view)`. `label` begins the caption.

    `frame`, `tick`: of the last frame; `missed`: the PC never got it (dropped, or the one before came again).
    """

    def __init__(self, sight: PixelSight, label: str, show: Callable[[View], None]) -> None:
        self.sight = sight
        self.label = label
        self.show = show
        self.notes = sight.tracker.notes = Notes()
        self.frame = 0
        self.tick = 0
        self.missed = False
        sight.watch = self._watch

    def __repr__(self) -> str:
        return f"View({self.label!r}, frame={self.frame})"

    def _watch(self, frame: int, tick: int) -> None:
        self.frame, self.tick = frame, tick
        self.missed = self.notes.tick != tick
        if self.missed:
            self.sight.picture_at(frame, tick)
        self.show(self)

    def picture(self) -> Picture:
        """The frame that is being shown."""
        return taken(self.sight.eye)

    def png(self, plain: bool) -> bytes:
        """It as a file: `plain`, or enlarged with the overlay."""
        picture = self.picture()
        if plain:
            return png(picture.image())
        from mirotwin.looking.overlay import draw

        return png(draw(picture, self.sight.tracker, None if self.missed else self.notes, self.caption()))

    def caption(self) -> str:
        """What the line below the picture says."""
        missed = "   not received by the PC" if self.missed else ""
        team = self.sight.tracker.team
        return f"{self.label}   {team}   frame {self.frame}   {seconds(self.tick):.3f} s{missed}"


def sight_of(networks: Sequence[Network], index: int, origin: str) -> PixelSight:
    """The camera of a network. Raises BadInput if there is none, or none with pixels."""
    if not 0 <= index < len(networks):
        there = f"0 to {len(networks) - 1}" if len(networks) > 1 else "only 0"
        raise BadInput(origin, f"--network {index}", "there is no such network", f"there is {there}")
    sight = networks[index].sight
    if not isinstance(sight, PixelSight):
        raise BadInput(origin, "camera.kind", "this camera renders no pixels", NO_PIXELS)
    return sight
