"""Interprets a fuzz input as the input of a robot: characters, pauses, bad stop bits, resets.

    BYTES       each byte is a character; all follow each other without a pause
    FRAMES      HDR and payload of one frame after the other, sealed. Bits 7 and 6 of HDR are the type, bits 2 to 0 how
                many steps the number goes on (1 to 8)
    SESSION     operations: a byte whose low nibble chooses, then its arguments; what is missing at the end is 0

    nibble  operation       arguments
    0 1 2   TEAM            own left, own right (int16, low byte first); the other robots stop
    3 4     ASK             the same as a question to robot (number mod N)
    5       SERVICE         payload
    6       FULL            payload of a team frame
    7       FRAME           HDR as it is (its number is not counted), payload
    8       AGAIN           - the wire bytes of the last frame once more
    9       RAW             count - 1 (low 5 bits), so many characters
    A       PAUSE           0.1 ms to 25.6 ms, in steps of 0.1 ms
    B       SILENCE         3 ms to 768 ms, in steps of 3 ms
    C       DAMAGE          place in the next frame, bits to turn over
    D       CUT             characters that the next frame has
    E       STOP_BIT        place in the next frame of a bad stop bit
    F       RESET           - the reset pin, right after the characters so far, and 5 ms to come up before the pauses

Velocity -32768 is an encoding error, which no host sends: -32767 goes out in its place.

A wire format of somebody else's comes in as `repair`, a function from a frame's body to its characters; its bodies are
a count - 1 (low 5 bits, times 8 if the upper 3 are 1) and so many bytes, or what is left, for all frame operations.

On a board with values of parts and pins that somebody can put, nibbles 1 to 4 of a session put one of them, and take
480 ticks; where there are none of one kind, all four put the other:

    1 2 3    PUT            which value (mod their number), 16 bits, low byte first
    4        PIN            which pin (mod their number), 16 bits
"""

from __future__ import annotations

from collections.abc import Callable

from miro_exact.clock import TICKS_PER_SECOND
from miro_protocol import crc
from miro_protocol.table import SEQ_MODULUS, FrameType, downlink
from miro_protocol.whitening import STRING

BYTES, FRAMES, SESSION = range(3)
INPUTS = ("bytes", "frames", "session")
"""By these numbers."""
OPERATIONS = (
    *("team", "team", "team", "ask", "ask", "service", "full", "frame"),
    *("again", "raw", "pause", "silence", "damage", "cut", "stop bit", "reset"),
)
"""By nibble."""

MOST_CHARACTERS = 2048
MOST_PUTS = 256
MOST_TICKS = 3 * TICKS_PER_SECOND
RESET_TICKS = 48
"""Length of a reset pulse in ticks: two machine cycles are enough, these are four (AT89C52 data sheet 0313H)."""
UP_TICKS = 5 * TICKS_PER_SECOND // 1000
PUT_TICKS = 480
"""A put comes in the middle: 240 ticks after the last character, and before the next, which is known so long before."""

_MOST = MOST_CHARACTERS
_MOST_TICKS = MOST_TICKS
_MOST_RESETS = 16
_MOST_PUTS = MOST_PUTS
_PAUSE = TICKS_PER_SECOND // 10_000
_SILENCE = 3 * TICKS_PER_SECOND // 1000
_RESET_TICKS, _UP_TICKS, _PUT_TICKS = RESET_TICKS, UP_TICKS, PUT_TICKS
_BYTES, _FRAMES, _SESSION = BYTES, FRAMES, SESSION
_TEAM, _SERVICE, _ASK = FrameType.TEAM, FrameType.SERVICE, FrameType.TEAM_ASK
_PAIR = downlink(3).payload_size // 3  # two int16
_XOR_OUT = crc.XOR_OUT
_WHITE = STRING
_BAD_STOP, _RESET = 1, 2
_LONG = 0xE0  # counts of eight bytes each, in a foreign body


class Program:
    """Reads inputs for robot `slot` of `robots`. After `read`: `count` characters, each with the pause before it, and
    the pause after the last one, `trailing_ticks`.

    `how` is BYTES, FRAMES or SESSION. `repair`: another wire format. `character_ticks`: of the line. `choices`,
    `pins`: how many values and pins can be put; pins are numbered behind the values. Of each of the `puts`: the
    character after it, ticks since the begin, which, what.
    """

    NOT_STATE = ("*",)

    def __init__(
        self,
        how: int,
        slot: int = 0,
        robots: int = 3,
        repair: Callable[[bytes], bytes] | None = None,
        character_ticks: int = 0,
        choices: int = 0,
        pins: int = 0,
    ) -> None:
        if not BYTES <= how <= SESSION:
            raise ValueError(f"how = {how}: give BYTES, FRAMES or SESSION")
        form = downlink(robots)
        self.how = how
        self.slot = slot
        self.robots = robots
        self.repair = repair
        self.character_ticks = character_ticks or form.character_ticks
        self.characters = bytearray(2048)
        self.flaws = bytearray(2048)  # bad stop bit; reset before it
        self.pauses = [0] * 2048
        self.choices = choices
        self.pins = pins
        self.put_places = [0] * 256
        self.put_ticks = [0] * 256
        self.put_choices = [0] * 256
        self.put_values = [0] * 256
        self._frame = bytearray(64)  # the next one of our own
        self._head = len(form.lead + form.sync)  # where HDR stands in it
        for place, value in enumerate(form.lead + form.sync):
            self._frame[place] = value
        self._payload = form.payload_size
        self._layout = crc.register(bytes([form.layout]))
        self._table = crc.table_of(8)
        self._first = 0  # where the last frame begins
        self._damage = 0
        self.read(b"")

    def read(self, data: bytes | bytearray | memoryview) -> int:
        """Any bytes at all; what is too much is left out. Returns how many characters there are."""
        self.count = 0
        self.puts = 0
        self.frames = 0  # how many frames were sealed
        self.length = 0  # ticks from the begin to the end of the last character, without waiting at the end
        self._data = data
        self._place = 0
        self._end = len(data)
        self._seq = 0
        self._size = 0
        self._forget_flaws()
        self.trailing_ticks = 0
        self._flags = 0
        self._resets = 0
        while self._place < self._end and self._has_room():
            if self.how == _BYTES:
                self._put(self._next())
            elif self.how == _FRAMES:
                self._one_frame()
            else:
                self._operation(self._next() & 0x0F)
        return self.count

    def ends_with_reset(self) -> bool:
        """True if the reset pin goes up after the last character."""
        return self._flags & _RESET != 0

    def opens_with(self, characters: bytes) -> bool:
        """True if these come first, without a pause, a bad stop bit or a reset."""
        size = len(characters)
        if self.count < size:
            return False
        for place in range(size):
            if self.characters[place] != characters[place] or self.flaws[place] or self.pauses[place]:
                return False
        return True

    def character(self, place: int) -> tuple[int, bool, bool, int]:
        """Value, whether its stop bit is bad, whether a reset comes before it, and the pause before it in ticks."""
        flaws = self.flaws[place]
        return self.characters[place], bool(flaws & _BAD_STOP), bool(flaws & _RESET), self.pauses[place]

    def put(self, number: int) -> tuple[int, int, int, int]:
        """Entry `number` of the puts: index of the character after it, ticks since the begin, index of the value,
        value.
        """
        if not 0 <= number < self.puts:
            raise IndexError(f"put {number} of {self.puts}")
        place, ticks = self.put_places[number], self.put_ticks[number]
        return place, ticks, self.put_choices[number], self.put_values[number]

    def _has_room(self) -> bool:
        return self.count < _MOST and self.length < _MOST_TICKS

    def _next(self) -> int:
        """The next byte of the input, 0 after its end."""
        if self._place >= self._end:
            return 0
        value = self._data[self._place]
        self._place += 1
        return value

    def _put(self, value: int) -> None:
        """Appends one character."""
        if self._has_room():
            self.characters[self.count] = value
            self.flaws[self.count] = self._flags
            self.pauses[self.count] = self.trailing_ticks
            self.length += self.trailing_ticks + self.character_ticks
            self.trailing_ticks = 0
            self._flags = 0
            self.count += 1

    def _pause(self, ticks: int) -> None:
        if self.length + self.trailing_ticks + ticks <= _MOST_TICKS:
            self.trailing_ticks += ticks

    def _forget_flaws(self) -> None:
        self._damage_at = -1
        self._cut = -1
        self._stop_at = -1

    # ---- operations ----------------------------------------------------------------------------------------

    def _one_frame(self) -> None:
        """FRAMES: HDR and payload."""
        if self.repair is not None:
            self._foreign()
        else:
            hdr = self._next()
            self._seq = (self._seq + (hdr & 7) + 1) % SEQ_MODULUS
            self._payload_from_input()
            self._seal((hdr & 0xC0) | self._seq)

    def _operation(self, kind: int) -> None:
        if self.choices + self.pins and 1 <= kind <= 4:
            self._one_put(kind == 4)
        elif kind < 9 and kind != 8:
            self._frame_operation(kind)
        elif kind == 8:
            if self._size:
                self._send(bytes(self.characters[self._first : self._first + self._size]))
        elif kind == 9:
            for _ in range((self._next() & 0x1F) + 1):
                self._put(self._next())
        elif kind == 10:
            self._pause((self._next() + 1) * _PAUSE)
        elif kind == 11:
            self._pause((self._next() + 1) * _SILENCE)
        elif kind == 12:
            self._damage_at = self._next()
            self._damage = self._next()
        elif kind == 13:
            self._cut = self._next()
        elif kind == 14:
            self._stop_at = self._next()
        elif self._resets < _MOST_RESETS and not self._flags & _RESET and not self._has_put():
            self._resets += 1
            self._pause(_UP_TICKS + _RESET_TICKS)
            self._flags |= _RESET

    def _one_put(self, pin: bool) -> None:
        which = self._next()
        if self.pins and (pin or not self.choices):
            which = self.choices + which % self.pins
        else:
            which %= self.choices
        value = self._next()
        value |= self._next() << 8
        ticks = self.length + self.trailing_ticks
        if self.puts < _MOST_PUTS and ticks + _PUT_TICKS <= _MOST_TICKS:
            self.put_places[self.puts] = self.count
            self.put_ticks[self.puts] = ticks
            self.put_choices[self.puts] = which
            self.put_values[self.puts] = value
            self.puts += 1
            self._pause(_PUT_TICKS)

    def _has_put(self) -> bool:
        """True if a value was put since the last character: a reset comes right after that one."""
        return self.puts > 0 and self.put_places[self.puts - 1] == self.count

    def _frame_operation(self, kind: int) -> None:
        if self.repair is not None:
            self._foreign()
        elif kind == 7:
            hdr = self._next()
            self._payload_from_input()
            self._seal(hdr)
        else:
            self._seq = (self._seq + 1) % SEQ_MODULUS
            if kind >= 5:
                self._payload_from_input()
            else:
                self._own_velocities()
            self._seal((_SERVICE if kind == 5 else _ASK if kind in (3, 4) else _TEAM) << 6 | self._seq)

    def _payload_from_input(self) -> None:
        for place in range(self._payload):
            self._frame[self._head + 1 + place] = self._next()

    def _own_velocities(self) -> None:
        for place in range(self._payload):
            self._frame[self._head + 1 + place] = 0
        for place in range(_PAIR):
            value = self._next()
            if self.slot < self.robots:
                self._frame[self._head + 1 + _PAIR * self.slot + place] = value

    # ---- frames --------------------------------------------------------------------------------------------

    def _seal(self, hdr: int) -> None:
        """HDR, CRC and whitening, and out it goes."""
        frame = self._frame
        first = self._head
        end = first + 1 + self._payload  # of what the CRC is of
        frame[first] = hdr
        if hdr >> 6 in (_TEAM, _ASK):
            for place in range(first + 1, end, 2):
                if frame[place] == 0 and frame[place + 1] == 0x80:
                    frame[place] = 1  # -32768
        register = self._layout
        for place in range(first, end):
            register = (register >> 8) ^ self._table[(register ^ frame[place]) & 0xFF]
        register ^= _XOR_OUT
        frame[end] = register & 0xFF
        frame[end + 1] = register >> 8
        for place in range(first, end + 2):
            frame[place] ^= _WHITE[place - first]
        self._send(bytes(frame[: end + 2]))

    def _foreign(self) -> None:
        """A frame of a wire format that Python repairs."""
        count = self._next()
        size = (count & 0x1F) + 1
        if count >= _LONG:
            size *= 8
        left = self._end - self._place
        if size > left:
            size = left if left > 0 else 1
        body = bytearray(size)
        for place in range(size):
            value = self._next()  # on its own: Cython 3.2 would call it three times in the next line
            body[place] = value
        assert self.repair is not None
        self._send(self.repair(bytes(body)))

    def _send(self, frame: bytes) -> None:
        """The characters of a frame, with what is to be wrong with it."""
        self._first = self.count
        self._size = 0
        self.frames += 1
        for value in frame:
            if self._size == self._cut or not self._has_room():
                break
            if self._size == self._damage_at:
                value ^= self._damage
            if self._size == self._stop_at:
                self._flags |= _BAD_STOP
            self._put(value)
            self._size += 1
        self._forget_flaws()
