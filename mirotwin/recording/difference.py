"""A value in which two runs differ, as a line and as JSON."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import msgspec

from miro_exact.clock import TICKS_PER_SECOND
from mirotwin.recording.channels import PERIOD, topic_name

WORDS = ("recorded", "replayed")
"""Names of the two runs of a replay; `mirotwin diff` has A and B."""


DIGEST = "digest"
"""The channel of the states' digests. A digest may differ although no recorded value does."""


class Difference(msgspec.Struct, frozen=True):
    """A value of two runs at `tick`, in control period `period`.

    `channel` as in a recording, with the field: `lm629 left status`, `wire`. `slot` -1: the whole network; `network`
    -1: the whole world. `recorded`, `replayed`: numbers, or text for characters and commands; None: missing. `clock`:
    ticks per second.
    """

    tick: int
    period: int
    network: int
    slot: int
    channel: str
    recorded: int | float | str | None
    replayed: int | float | str | None
    clock: int = TICKS_PER_SECOND

    @property
    def topic(self) -> str:
        if self.network < 0:
            return f"{PERIOD} {self.channel}"
        return topic_name(self.channel, self.network, self.slot)

    def values(self) -> tuple[str, str]:
        """The recorded and the replayed value as text."""
        if self.channel == DIGEST:
            return f"{self.recorded}"[:12], f"{self.replayed}"[:12]
        return shown(self.recorded), shown(self.replayed)

    def line(self, names: tuple[str, str] = WORDS) -> str:
        """The difference in one line; `names`: of the two runs."""
        recorded, replayed = self.values()
        values = f"{names[0]} {recorded}, {names[1]} {replayed}"
        return f"{moment(self.tick, self.clock)}, {self.topic}: {values}"

    def __str__(self) -> str:
        return self.line()

    def as_json(self, names: tuple[str, str] = WORDS) -> dict[str, Any]:
        """For `--json`."""
        return {
            "tick": self.tick,
            "t_s": self.tick / self.clock,
            "period": self.period,
            "network": None if self.network < 0 else self.network,
            "slot": None if self.slot < 0 else self.slot,
            "channel": self.channel,
            names[0]: self.recorded,
            names[1]: self.replayed,
        }


def first_per_channel(differences: Iterable[Difference]) -> list[tuple[Difference, int]]:
    """The first difference of each channel of each robot, and the channel's number of differences, in their order."""
    by_channel: dict[tuple[int, int, str], list[Difference]] = {}
    for difference in differences:
        by_channel.setdefault((difference.network, difference.slot, difference.channel), []).append(
            difference
        )
    return [(alike[0], len(alike)) for alike in by_channel.values()]


def moment(tick: int, clock: int) -> str:
    """A tick in words, with its time by the clock of its world."""
    return f"tick {tick} ({tick / clock:.6f} s)"


def shown(value: object) -> str:
    """A value in the words of a recording."""
    return "nothing" if value is None else str(value)
