"""The radio end of the PC: one frame per control period for all robots of a network."""

import struct
from collections import deque
from collections.abc import Sequence

from miro_exact.state import Rows
from miro_protocol import crc
from miro_protocol.frames import ServiceFrame, TeamFrame, encode
from miro_protocol.table import ROBOT_COUNTS, SEQ_MODULUS, SERVICE_EVERY, VELOCITY, FrameType, downlink
from miro_protocol.whitening import STRING

_LOWEST, _HIGHEST = VELOCITY[0].low, VELOCITY[0].high
_SEQ_MODULUS = SEQ_MODULUS
_XOR_OUT = crc.XOR_OUT
assert all((field.size, field.low, field.high) == (2, _LOWEST, _HIGHEST) for field in VELOCITY)


def _split_service(frame: ServiceFrame) -> tuple[int, int, bytes]:
    """Slot, opcode and values, as a saved state holds them; every frame gets its number when it is sent."""
    return frame.slot, frame.opcode, struct.pack(f"<{len(frame.values)}q", *frame.values)


def _make_service(cells: tuple[int, int, bytes]) -> ServiceFrame:
    slot, opcode, data = cells
    if len(data) % 8:
        raise ValueError(f"holds a service frame with {len(data)} bytes of values")
    return ServiceFrame(0, slot, opcode, struct.unpack(f"<{len(data) // 8}q", data))


class Station:
    """Sender of one network of `n` robots (3 or 5).

    Every frame takes the next of 64 sequence numbers, whatever its type. With telemetry every team frame is
    of type 3 and asks robot (seq mod n) to answer; 64 is no multiple of n, so at the wrap some robot's turn
    comes early. A queued service frame replaces a team frame; between two of
    them at least seven team frames go out, so that velocities stay fresh. ValueError for another n.
    """

    STATE = {
        "seq": ("q", 0, SEQ_MODULUS - 1),
        "team_frames_since_service": ("q", 0, SERVICE_EVERY - 1),
        "services": Rows(1 << 16, "B", "B", "s", split=_split_service, make=_make_service),
    }
    NOT_STATE = ("n", "telemetry", "_kind", "_frame", "_size", "_body", "_table", "_start", "_white")

    def __init__(self, n: int, telemetry: bool = True) -> None:
        if n not in ROBOT_COUNTS:
            raise ValueError(f"n = {n}: a network has {' or '.join(map(str, ROBOT_COUNTS))} robots")
        self.n = n
        self.telemetry = telemetry
        self.seq = 0
        self.team_frames_since_service = SERVICE_EVERY - 1
        self.services: deque[ServiceFrame] = deque()
        form = downlink(n)
        self._kind = int(FrameType.TEAM_ASK if telemetry else FrameType.TEAM)
        self._frame = bytearray(64)  # lead and sync, and what was sent last
        self._body = len(form.lead) + len(form.sync)  # where HDR is
        self._size = form.wire_size
        for place, byte in enumerate(form.lead + form.sync):
            self._frame[place] = byte
        self._table = crc.table_of(8)
        self._start = crc.register(bytes([form.layout]))
        self._white = STRING

    def __repr__(self) -> str:
        return f"Station(n={self.n}, telemetry={self.telemetry}, seq={self.seq}, queued={len(self.services)})"

    def request(self, slot: int, opcode: int, values: Sequence[int] = ()) -> None:
        """Queue a service frame; ValueError (from the codec) here and now if it could not be sent."""
        service = ServiceFrame(0, slot, opcode, tuple(values))
        encode(service, self.n)
        self.services.append(service)

    def frame(self, commands: Sequence[tuple[int, int]]) -> bytes:
        """The next frame's bytes, preamble first. `commands` are (left, right) per slot, slot 0 first.

        In a period whose frame is a service frame the commands are checked and dropped; robots keep their velocities.
        ValueError naming slot, value and limits when a command may not be sent; nothing is used up then.
        """
        if self._fill(commands):
            data = bytes(self._frame[: self._size])
        else:
            data = encode(TeamFrame(self._kind, self.seq, tuple(commands)), self.n)
        if self.services and self.team_frames_since_service >= SERVICE_EVERY - 1:
            service = self.services.popleft()
            data = encode(ServiceFrame(self.seq, service.slot, service.opcode, service.values), self.n)
            self.team_frames_since_service = 0
        else:
            self.team_frames_since_service = min(self.team_frames_since_service + 1, SERVICE_EVERY - 1)
        self.seq = (self.seq + 1) % _SEQ_MODULUS
        return data

    def _fill(self, commands: Sequence[tuple[int, int]]) -> bool:
        """Puts a team frame into `_frame`, as `encode` makes it; False for what `encode` has to judge."""
        if len(commands) != self.n:
            return False
        self._frame[self._body] = self._kind * _SEQ_MODULUS + self.seq
        end = self._body + 1
        for pair in commands:
            if type(pair) is not tuple or len(pair) != 2:
                return False
            for value in pair:
                if type(value) is not int or value < _LOWEST or value > _HIGHEST:
                    return False
                word = value
                self._frame[end] = word & 0xFF
                self._frame[end + 1] = word >> 8 & 0xFF
                end += 2
        register = self._start
        for place in range(self._body, end):
            register = register >> 8 ^ self._table[(register ^ self._frame[place]) & 0xFF]
        register ^= _XOR_OUT
        self._frame[end] = register & 0xFF
        self._frame[end + 1] = register >> 8
        for place in range(self._body, self._size):
            self._frame[place] ^= self._white[place - self._body]
        return True

    def after_load(self) -> None:
        """Raises ValueError for a service frame that may not be sent."""
        for service in self.services:
            encode(service, self.n)
