"""A board's reports to a recorder of its wires, with exact ticks.

A probe reads levels off the board and its chips and changes nothing; a board without one pays a test per event.
"""

from __future__ import annotations


class Probe:
    """Put into `Board.probe`. The calls come in order of their ticks."""

    def moved(self, tick: int) -> None:
        """The CPU has changed pins of an LM629 at `tick`; all levels of the board are those of `tick`."""

    def hi_fell(self, tick: int) -> None:
        """HI of a chip fell on its own at `tick`. The plant may be behind, and the CPU's pins ahead of that."""

    def passed(self, tick: int) -> None:
        """Plant and chips have done all that happens up to `tick`; levels are those of `tick`.

        The plant has reported every encoder edge up to `tick`.
        """
