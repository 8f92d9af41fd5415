"""Guards a real robot, which can hurt: refuses motion unless it is allowed, and speeds above the limit.

A robot takes the last 17 characters for a frame (25 in a network of five) if they begin with the sync and their CRC is
good. The PC does not know which pauses the robot refuses and which frames it has lost. So every window of both lengths
is checked, across transmissions, pauses and overlapping frames. Without `--allow-motion` the payload of such a frame,
of any type, must be zeros except for the slot of a ping: velocities 0, no gains, no acceleration. A window with a bad
CRC is no frame: receivers notice any 1 to 4 wrong bits. A robot whose firmware accepts it may misread it; no guard can
prevent that.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Annotated, NamedTuple

from miro_exact.bad_input import BadInput
from miro_host.wheels import Wheels
from miro_protocol.crc import crc16
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.table import DOWNLINK, FRESH_STEPS, ROBOT_COUNTS, SEQ_MODULUS, FrameType
from miro_protocol.whitening import whiten
from mirotwin.shell.command import Option, Options
from mirotwin.shell.options import FiniteNumber, PathType

MAX_SPEED_M_S = 0.5
"""Limit of each wheel, in m/s, unless another one is given. A third of the robot's top speed."""
STOP_FRAMES = 3
"""With the numbers that follow; further ones are fresh after any other number (`Guard.stop_frames`)."""
LONGEST = max(form.size for form in DOWNLINK.values())
"""Characters of the longest window."""
KEPT = 8192
"""Characters that are remembered: more than a port's driver holds back."""
WHEELS = Wheels()
_WHERE = "Talk to a robot: /dev/ttyUSB0, or any URL that pyserial knows."
_MOTION = "Send what moves a robot, too. Without it only what lets it stand is sent."
_FASTEST = "Refuse what makes a wheel faster, in m/s."
_URL = PathType(readable=False)  # the port's own error names the remedy
_SPEED = FiniteNumber(0.0, WHEELS.limit_m_s)


class DeskOptions(Options, frozen=True, kw_only=True):
    """Address of a robot, and permissions. `port` None: no robot, only its twin."""

    HEADING = "A robot at a port"
    port: Annotated[str | None, Option(type=_URL, metavar="URL", help=_WHERE)] = None
    allow_motion: Annotated[bool, Option(needs="port", help=_MOTION)] = False
    max_speed: Annotated[float, Option(type=_SPEED, metavar="M_S", needs="port", help=_FASTEST)] = (
        MAX_SPEED_M_S
    )


class FrameSent(NamedTuple):
    """A window that robots of a network of `robots` take for a frame. `body`: HDR and payload in clear."""

    end: int
    robots: int
    body: bytes

    @property
    def kind(self) -> int:
        return self.body[0] // SEQ_MODULUS

    @property
    def seq(self) -> int:
        return self.body[0] % SEQ_MODULUS

    def speeds(self) -> list[tuple[float, float]]:
        """The velocities for each robot's wheels, in m/s; none in a frame without velocities."""
        if self.kind not in (FrameType.TEAM, FrameType.TEAM_ASK):
            return []
        words = struct.iter_unpack("<hh", self.body[1:])
        return [(left / WHEELS.units_per_m_s, right / WHEELS.units_per_m_s) for left, right in words]

    def moves(self) -> str:
        """The effect on a robot beyond standing with its gains, in words; "" for none."""
        slot, *rest = self.body[1:]
        if not any(rest) and (not slot or (self.kind == FrameType.SERVICE and slot < self.robots)):
            return ""
        for place, (left, right) in enumerate(self.speeds()):
            if left or right:
                return f"robot {place} told {left:.3f} and {right:.3f} m/s"
        if self.kind == FrameType.SERVICE:
            return f"service frame with opcode {self.body[2]}"
        return f"frame of type {self.kind}, which no host sends"


def frames_in(wire: bytes, from_end: int = 0) -> Iterator[FrameSent]:
    """Yields every window of either layout that is a frame and ends behind `from_end`."""
    for robots, form in DOWNLINK.items():
        start = wire.find(form.sync, max(0, from_end - form.size + 1))
        while 0 <= start <= len(wire) - form.size:
            end = start + form.size
            clear = whiten(wire[start + len(form.sync) : end])
            if crc16(bytes([form.layout]) + clear[:-2]) == int.from_bytes(clear[-2:], "little"):
                yield FrameSent(end, robots, clear[:-2])
            start = wire.find(form.sync, start + 1)


class Guard:
    """Checks all characters sent to the robots of one port.

    `last`: number of robots in a network -> number of the last sent frame; the network used last is at the end.
    """

    def __init__(self, desk: DeskOptions, path: str = "") -> None:
        self.desk = desk
        self.path = path
        self.last: dict[int, int] = {}
        self._sent = b""

    def check(self, data: bytes, place: str = "") -> list[int]:
        """Checks the next characters and returns the numbers of their frames.

        Raises BadInput for forbidden content, which then counts as not sent.
        """
        wire, begun = self._sent + data, len(self._sent)
        frames = sorted(frames_in(wire, begun))
        for frame in frames:
            if refused := self._refusal(frame):
                raise BadInput(self.path, place, *refused)
        for frame in frames:
            self.last.pop(frame.robots, None)
            self.last[frame.robots] = frame.seq
        self._sent = wire[-KEPT:]
        return [frame.seq for frame in frames]

    def _refusal(self, frame: FrameSent) -> tuple[str, str] | None:
        """Reason and remedy of a refusal; None if the frame may be sent."""
        moves, where = frame.moves(), f"(frame {frame.seq}, {frame.robots} robots)"
        if moves and not self.desk.allow_motion:
            remedy = "clear its way or lift its wheels off the ground, then give --allow-motion"
            return f"{moves} {where}, which may move a real robot", remedy
        fastest = max((abs(speed) for pair in frame.speeds() for speed in pair), default=0.0)
        if fastest > self.desk.max_speed:
            most = f"at most {self.desk.max_speed:g} m/s are allowed"
            return f"a wheel at {fastest:.3f} m/s {where}; {most}", "raise --max-speed"
        return None

    def stop_frames(self, unsent: int = 0) -> bytes:
        """Frames that stop all robots, in networks of every size used so far, the last used first.

        The first frames have the numbers after the last sent one. The others, in steps of 8, ensure that one is fresh
        for every number that a robot may have accepted last; after jumps in the numbers that is unknown.

        `unsent`: number of the last sent characters that may have been taken back. Wherever they were cut, no window
        over their rest and the frames' first characters may be a frame; if needed, filler characters go between. If no
        filler helps, the next stop frame ends the movement that the first one begins.
        """
        steps = [*range(1, STOP_FRAMES + 1), *range(STOP_FRAMES + FRESH_STEPS, SEQ_MODULUS, FRESH_STEPS)]
        frames = b"".join(
            encode(TeamFrame(FrameType.TEAM, (seq + step) % SEQ_MODULUS, ((0, 0),) * robots), robots)
            for robots, seq in (reversed(self.last.items()) if self.last else ((n, 0) for n in ROBOT_COUNTS))
            for step in steps
        )
        betweens = (b"", *(bytes([character]) * LONGEST for character in range(256)))
        return next(
            (between + frames for between in betweens if self._is_apart(between + frames, unsent)), frames
        )

    def _is_apart(self, frames: bytes, unsent: int) -> bool:
        """True if these characters, behind any cut of the sent ones, contain no frame that moves a robot."""
        first = frames[: LONGEST - 1]
        ends = range(max(0, len(self._sent) - unsent), len(self._sent) + 1)
        across = (
            frame
            for end in ends
            for frame in frames_in(self._sent[max(0, end - LONGEST + 1) : end] + first, min(end, LONGEST - 1))
        )
        return not any(frame.moves() for frame in across) and not any(map(FrameSent.moves, frames_in(frames)))
