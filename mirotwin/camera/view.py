"""The camera of one network of a world, as one looks at it: each frame as a PNG, with or without the overlay.

It changes no bit of a run: notes and the picture are no state.
"""

from __future__ import annotations

from collections.abc import Callable

from miro_exact.bad_input import BadInput
from miro_exact.clock import seconds
from miro_host.eye.tracker import Notes
from miro_sim.world.sight import PixelSight
from miro_sim.world.world import World
from mirotwin.camera.picture import Picture, png, taken

NO_PIXELS = 'choose kind = "pixels" in [camera]; here: --set \'camera={kind="pixels"}\''


class View:
    """Looks at every frame of network `network` from now on; each of `shows` is called with this view.

    `label` begins the caption. `frame`, `tick`: the last frame and its tick; `missed`: the PC did not get it (it was
    dropped, or the previous frame was delivered again).
    """

    def __init__(self, sight: PixelSight, network: int, label: str) -> None:
        self.sight = sight
        self.network = network
        self.label = label
        self.shows: list[Callable[[View], None]] = []
        self.notes = sight.tracker.notes = Notes()
        self.frame = 0
        self.tick = 0
        self.missed = False
        sight.watch = self._watch

    def __repr__(self) -> str:
        return f"View(net{self.network}, frame={self.frame})"

    def _watch(self, frame: int, tick: int) -> None:
        self.frame, self.tick = frame, tick
        self.missed = self.notes.tick != tick
        if self.missed:
            self.sight.picture_at(frame, tick)
        for show in self.shows:
            show(self)

    def picture(self) -> Picture:
        """The frame that is being shown."""
        return taken(self.sight.eye)

    def png(self, plain: bool) -> bytes:
        """The picture as a PNG file: `plain`, or enlarged with the overlay."""
        picture = self.picture()
        if plain:
            return png(picture.image())
        from mirotwin.camera.overlay import draw

        return png(draw(picture, self.sight.tracker, None if self.missed else self.notes, self.caption()))

    def caption(self) -> str:
        """The text of the line below the picture."""
        missed = "   not received by the PC" if self.missed else ""
        team = self.sight.tracker.team
        return f"{self.label}   {team}   frame {self.frame}   {seconds(self.tick):.3f} s{missed}"


def view_of(world: World, index: int, origin: str) -> View:
    """The view of one network. Raises BadInput if it does not exist, or if its camera has no pixels."""
    networks = world.networks
    if not 0 <= index < len(networks):
        there = f"0 to {len(networks) - 1}" if len(networks) > 1 else "only 0"
        raise BadInput(origin, f"--network {index}", "there is no such network", f"there is {there}")
    sight = networks[index].sight
    if not isinstance(sight, PixelSight):
        raise BadInput(origin, "camera.kind", "this camera renders no pixels", NO_PIXELS)
    return View(sight, index, f"{world.scenario.name}   seed {world.seed}   net{index}")


def views_of(world: World, origin: str) -> list[View]:
    """Of all networks. Raises BadInput as `view_of` does."""
    return [view_of(world, index, origin) for index in range(len(world.networks))]
