"""Evaluates a condition at marked instructions; between marks the CPU runs at full speed."""

from __future__ import annotations

from collections.abc import Callable, Collection

from miro_robot.mcs51.cpu import BREAKPOINT, Cpu


class MarkInspector:
    """Runs `cpu` as its `run` does, and calls `ask` before each instruction at one of `addresses`; true ends that.

    `others`: where the owner of the CPU sets marks itself for each run, None where it sets none.
    """

    def __init__(
        self,
        cpu: Cpu,
        addresses: Collection[int],
        ask: Callable[[], bool],
        others: Callable[[], Collection[int]] | None = None,
    ) -> None:
        self.cpu = cpu
        self.marked = dict.fromkeys(addresses)
        self.ask = ask
        self.others = others
        cpu.mark(tuple(self.marked))
        cpu.inspector = self

    def run(self, until_cycle: int) -> int:
        """See `Cpu.run`."""
        if self.others is not None:
            self.cpu.mark(_shared(self.others(), self.marked))  # the owner took them away
        reason = self.cpu.run_alone(until_cycle)
        return self._pass_marks(until_cycle) if reason == BREAKPOINT else reason

    def _pass_marks(self, until_cycle: int) -> int:
        cpu = self.cpu
        others = () if self.others is None else self.others()
        reason = BREAKPOINT
        while reason == BREAKPOINT:
            place = cpu.pc
            if place in self.marked and self.ask():
                cpu.unmark(tuple(self.marked))
                cpu.mark(_shared(others, self.marked))
                self.marked = {}
            if place in others:
                break
            cpu.unmark((place,))
            reason = cpu.run_alone(cpu.cycles + 1)
            if place in self.marked:
                cpu.mark((place,))
            if not reason and cpu.cycles < until_cycle:
                reason = cpu.run_alone(until_cycle)
        return reason

    def detach(self) -> None:
        """Gives the CPU its own loop back."""
        self.cpu.inspector = None
        self.cpu.unmark(tuple(self.marked))


def _shared(others: Collection[int], marked: Collection[int]) -> tuple[int, ...]:
    return tuple(address for address in others if address in marked)
