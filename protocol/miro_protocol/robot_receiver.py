"""What a robot makes of the characters that its serial port receives: frames, fresh or not, and damage."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from miro_protocol.decoder import Decoder
from miro_protocol.events import Event, Received
from miro_protocol.freshness import Freshness
from miro_protocol.robot_rules import TO_RI_TICKS
from miro_protocol.transmission import Transmission

Reception = tuple[Event, bool | None]
"""A valid frame and whether it is fresh, or damaged characters and None."""


class RobotReceiver:
    """The receiver of a robot in a network of `n` robots, as it is at power-on."""

    def __init__(self, n: int) -> None:
        self.decoder = Decoder(n)
        self.freshness = Freshness()

    def __repr__(self) -> str:
        return f"RobotReceiver({self.decoder!r}, {self.freshness!r})"

    def hear(self, sent: Transmission) -> Sequence[Reception]:
        """What the characters of a transmission complete."""
        return self._judged(self.decoder.hear(sent))

    def character(self, value: int, good_stop: bool, ri_tick: int) -> Sequence[Reception]:
        """What a character completes for which the port sets RI at `ri_tick`: in its stop bit."""
        return self._judged(self.decoder.feed_symbols([(value, good_stop, ri_tick - TO_RI_TICKS)]))

    def flush(self) -> Sequence[Reception]:
        """What the characters are that wait for others: nothing more comes."""
        return self._judged(self.decoder.flush())

    def _judged(self, events: Iterable[Event]) -> list[Reception]:
        return [
            (one, self.freshness.judge(one.seq, one.last_tick) if isinstance(one, Received) else None)
            for one in events
        ]
