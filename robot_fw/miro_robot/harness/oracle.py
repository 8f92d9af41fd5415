"""What looks for mistakes of a machine in a harness while it runs."""

from __future__ import annotations


class LiveOracle:
    """`code`: 0, or the kind of what it found first, by the names that it has for them; `tick`: of that."""

    NOT_STATE: tuple[str, ...] = ("code", "tick")

    def __init__(self) -> None:
        self.code = 0
        self.tick = 0

    def begin(self, tick: int) -> None:
        """The machine was put back to where it was at `tick`."""
        self.code = 0
        self.tick = 0

    def restarted(self, tick: int) -> None:
        """The processor was reset."""

    def look(self, tick: int) -> None:
        """The machine has run to `tick`."""

    def waits(self) -> bool:
        """Whether something is still to come, so that the run must not end."""
        return False
