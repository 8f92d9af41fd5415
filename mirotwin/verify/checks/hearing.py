"""What a robot's receiver heard: its characters as valid frames, fresh or not, and as damage.

Characters are those that the robot's own serial port delivered, so radio noise is in them already. The port sets RI in
the stop bit; the rules count from the start bit.
"""

from __future__ import annotations

from collections.abc import Iterator

from miro_protocol.decoder import Decoder, Received
from miro_protocol.freshness import Freshness
from miro_protocol.robot_rules import TO_RI_TICKS
from miro_sim.world.events import Event


class Hearing:
    """The frames that robot `slot` of `network` hears, in a network of `robots`."""

    def __init__(self, network: int, slot: int, robots: int) -> None:
        self.network = network
        self.slot = slot
        self.decoder = Decoder(robots)
        self.freshness = Freshness()

    def take(self, received: Event) -> Iterator[Event]:
        """The `frame` and `damaged` events that a `received` one completes, at its tick."""
        symbol = (received.value, received.good_stop, received.tick - TO_RI_TICKS)
        for found in self.decoder.feed_symbols([symbol]):
            frame = found if isinstance(found, Received) else None
            fresh = frame is not None and self.freshness.judge(frame.seq, frame.last_tick)
            yield Event(
                tick=received.tick,
                what="damaged" if frame is None else "frame",
                network=self.network,
                slot=self.slot,
                value=int(fresh),
                data=found.data,
                frame=frame,
            )
