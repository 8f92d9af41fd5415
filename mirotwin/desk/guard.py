"""What may be sent to a robot that can hurt: nothing that moves it unless that is allowed, and nothing too fast.

The guard reads what is to be sent as a robot of either layout would, before it is sent. A robot that takes damaged
frames may still make something else of them: no guard on this side of the radio can know that.
"""

from __future__ import annotations

from typing import Annotated

from miro_exact.bad_input import BadInput
from miro_host.wheels import Wheels
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.frames import ContentError, ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.table import ROBOT_COUNTS, SEQ_MODULUS, FrameType, Opcode
from mirotwin.shell.command import Option, Options
from mirotwin.shell.options import FiniteNumber, PathType

MAX_SPEED_M_S = 0.5
"""Of each wheel, unless another limit is given. A third of what the robot can do."""
STOP_FRAMES = 3
WHEELS = Wheels()
_WHERE = "Talk to a robot: /dev/ttyUSB0, or any URL that pyserial knows."
_MOTION = "Send what moves a robot, too. Without it only what lets it stand is sent."
_FASTEST = "Refuse what makes a wheel faster, in m/s."
_URL = PathType(readable=False)  # who may not open it is told by the port what to do
_SPEED = FiniteNumber(0.0, WHEELS.limit_m_s)


class DeskOptions(Options, frozen=True, kw_only=True):
    """Where a robot is, and what may be done to it. `port` None: no robot, only its twin."""

    HEADING = "A robot at a port"
    port: Annotated[str | None, Option(type=_URL, metavar="URL", help=_WHERE)] = None
    allow_motion: Annotated[bool, Option(needs="port", help=_MOTION)] = False
    max_speed: Annotated[float, Option(type=_SPEED, metavar="M_S", needs="port", help=_FASTEST)] = (
        MAX_SPEED_M_S
    )


class Guard:
    """Checks what is sent to the robots of one port. `layout`: robots of the network that was spoken to last."""

    def __init__(self, desk: DeskOptions, path: str = "") -> None:
        self.desk = desk
        self.path = path
        self.layout = 0
        self.last_seq = 0
        self._decoders = {count: Decoder(count) for count in ROBOT_COUNTS}

    def check(self, data: bytes, place: str = "") -> list[int]:
        """Reads what is about to be sent; the numbers of its frames. Raises BadInput for what is not allowed."""
        numbers = []
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
                        numbers.append(message.seq)
        return numbers

    def _check(self, message: TeamFrame | ServiceFrame, place: str) -> None:
        moves, fastest = "", 0.0
        if isinstance(message, ServiceFrame) and message.opcode != Opcode.PING:
            moves = f"service frame with opcode {message.opcode}"
        for slot, pair in enumerate(message.velocities if isinstance(message, TeamFrame) else ()):
            left, right = (word / WHEELS.units_per_m_s for word in pair)
            fastest = max(fastest, abs(left), abs(right))
            if any(pair) and not moves:
                moves = f"robot {slot} told {left:.3f} and {right:.3f} m/s"
        if moves and not self.desk.allow_motion:
            remedy = "clear its way or lift its wheels off the ground, then give --allow-motion"
            raise BadInput(self.path, place, f"{moves}, which may move a real robot", remedy)
        if fastest > self.desk.max_speed:
            most = f"at most {self.desk.max_speed:g} m/s are allowed"
            raise BadInput(self.path, place, f"a wheel at {fastest:.3f} m/s; {most}", "raise --max-speed")

    def stop_frames(self) -> bytes:
        """Frames that tell all robots to stand, in numbers that are fresh after what was sent."""
        stop = FrameType.TEAM
        return b"".join(
            encode(TeamFrame(stop, (self.last_seq + step) % SEQ_MODULUS, ((0, 0),) * count), count)
            for count in ((self.layout,) if self.layout else ROBOT_COUNTS)
            for step in range(1, STOP_FRAMES + 1)
        )
