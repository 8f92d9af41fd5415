"""What a tracker did with one picture, for a person to look at: the windows it read, and the pair that is each robot.

They are no state: a tracker that takes notes finds what one without them finds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from miro_host.eye.tracker import Pair


class Window(NamedTuple):
    """A window that was read, in pixels of the picture; `slot`: of the robot it is for, -1 in a search for all."""

    left: int
    top: int
    width: int
    height: int
    slot: int


class Notes:
    """Notes of the last picture. `tick`: of its exposure, -1 before the first. `pairs`: by slot, None: lost."""

    NOT_STATE = ("tick", "windows", "pairs")

    def __init__(self) -> None:
        self.tick = -1
        self.windows: list[Window] = []
        self.pairs: list[Pair | None] = []

    def __repr__(self) -> str:
        return f"Notes(tick={self.tick}, {len(self.windows)} windows, {self.pairs!r})"

    def begin(self, tick: int) -> None:
        """A new picture."""
        self.tick = tick
        self.windows = []
        self.pairs = []
