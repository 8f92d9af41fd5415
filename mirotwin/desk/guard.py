"""What may be sent to a robot that can hurt: nothing that moves it unless that is allowed, and nothing too fast.

The guard reads what is to be sent as a robot of either layout would, before it is sent. A robot that takes damaged
frames may still make something else of them: no guard on this side of the radio can know that.
"""

from __future__ import annotations

import msgspec

from miro_exact.bad_input import BadInput
from miro_host.wheels import Wheels
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.frames import ContentError, ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.table import ROBOT_COUNTS, SEQ_MODULUS, FrameType, Opcode

MAX_SPEED_M_S = 0.5
"""Of each wheel, unless another limit is given. A third of what the robot can do."""
STOP_FRAMES = 3
UNITS_PER_M_S = Wheels().units_per_m_s


class MotionLimits(msgspec.Struct, frozen=True):
    """What the user allows. Without `motion` all velocities have to be 0, and no gains may be set."""

    motion: bool = False
    max_speed_m_s: float = MAX_SPEED_M_S


class Guard:
    """Checks what is sent to the robots of one port. `layout`: robots of the network that was spoken to last."""

    def __init__(self, limits: MotionLimits, path: str = "") -> None:
        self.limits = limits
        self.path = path
        self.layout = 0
        self.last_seq = 0
        self._decoders = {count: Decoder(count) for count in ROBOT_COUNTS}

    def check(self, data: bytes, place: str = "") -> None:
        """Reads what is about to be sent. Raises BadInput for what is not allowed."""
        for count, decoder in self._decoders.items():
            for event in decoder.feed(data):
                if isinstance(event, Received):
                    try:
                        message = event.message(count)
                    except ContentError:
                        continue
                    if not isinstance(message, TelemetryFrame):
                        self._check(message, place)
                        self.layout, self.last_seq = count, message.seq

    def _check(self, message: TeamFrame | ServiceFrame, place: str) -> None:
        what = _moves(message)
        if what and not self.limits.motion:
            remedy = "clear its way or lift its wheels off the ground, then give --allow-motion"
            raise BadInput(self.path, place, f"{what}, which may move a real robot", remedy)
        if isinstance(message, TeamFrame):
            fastest = max(abs(word) for pair in message.velocities for word in pair) / UNITS_PER_M_S
            if fastest > self.limits.max_speed_m_s:
                most = f"at most {self.limits.max_speed_m_s:g} m/s are allowed"
                raise BadInput(self.path, place, f"a wheel at {fastest:.3f} m/s; {most}", "raise --max-speed")

    def stop_frames(self) -> bytes:
        """Frames that tell all robots to stand, in numbers that are fresh after what was sent."""
        layouts = (self.layout,) if self.layout else ROBOT_COUNTS
        found = b""
        for count in layouts:
            for step in range(1, STOP_FRAMES + 1):
                seq = (self.last_seq + step) % SEQ_MODULUS
                found += encode(TeamFrame(FrameType.TEAM, seq, ((0, 0),) * count), count)
        return found


def _moves(message: TeamFrame | ServiceFrame) -> str:
    """What moves a robot, or may: "" for a frame that does not."""
    if isinstance(message, ServiceFrame):
        return "" if message.opcode == Opcode.PING else f"service frame with opcode {message.opcode}"
    for slot, (left, right) in enumerate(message.velocities):
        if left or right:
            speeds = f"{left / UNITS_PER_M_S:.3f} and {right / UNITS_PER_M_S:.3f} m/s"
            return f"robot {slot} told {speeds}"
    return ""
