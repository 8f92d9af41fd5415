"""What a robot received as events: valid frames, fresh or not, and damage.

Characters are those that the robot's own serial port delivered, so radio noise is in them already.
"""

from __future__ import annotations

from collections.abc import Iterator

from miro_protocol.events import Received
from miro_protocol.robot_receiver import RobotReceiver
from miro_sim.world.events import Event


def receptions(receiver: RobotReceiver, received: Event) -> Iterator[Event]:
    """The `frame` and `damaged` events that a `received` one completes, at its tick."""
    for found, fresh in receiver.character(received.value, received.good_stop, received.tick):
        frame = found if isinstance(found, Received) else None
        yield Event(
            tick=received.tick,
            what="damaged" if frame is None else "frame",
            network=received.network,
            slot=received.slot,
            value=int(bool(fresh)),
            data=found.data,
            frame=frame,
        )
