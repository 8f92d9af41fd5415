"""The target's side of an I2C bus: a part that derives from it gets bytes instead of edges, and answers with bytes.

     VCC
    [R][R]         master
scl ─┴──│──────────── SCL    open drain: each side pulls low or lets go
sda ────┴──────────── SDA

    SDA ──┐   ┌──┬──┬     ┬──┬───┐  ack  ┌──┬──┬          ┌──
          └───┤A6│A5│ ..  │A0│R/W└───────┤D7│D6│ ..  ─────┘
    SCL ────┐  ┌┐ ┌┐       ┌┐ ┌┐   ┌┐     ┌┐ ┌┐        ┌─────
            └──┘└─┘└─ .. ──┘└─┘└───┘└─────┘└─┘└─  .. ──┘
        start                                           stop

SDA that falls while SCL is high is a start, one that rises a stop. A bit is taken when SCL rises, and the part moves
SDA when SCL falls. Where one write moves both wires, SCL decides: no start, no stop, and the new level of SDA is taken.
Times of SCL that are too short for the part are counted in `short_clocks`; its bits are taken all the same.
"""

from __future__ import annotations

from typing import Any

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import LOW, OPEN_DRAIN, RELEASED, PartKeys, Pin, Place
from miro_robot.parts.part import Part

I2C_PINS = (Pin("scl", OPEN_DRAIN), Pin("sda", OPEN_DRAIN))
"""The first two pins of a target, in this order."""
I2C_SHEET = (
    "NXP UM10204, 3.1: START and STOP conditions, byte format, acknowledge, clock stretching; table 10"
)
_SCL, _SDA = 0, 1  # their numbers
_SCL_BIT, _SDA_BIT = 1, 2
_IDLE, _ADDRESS, _RECEIVES, _SENDS = range(4)  # phases: none of its business, who is meant, a byte each way
_NEVER = NEVER_TICK


class I2cTarget(Part):
    """A target. Override `addressed`, `received`, `transmit`; and `ended`, `woken` if they matter.

    They are called when SCL has fallen after the last bit of a byte, `transmit` when it has fallen after an
    acknowledge. `hold` stretches the clock from within them. Use `wake` in place of `next_tick`.
    """

    STATE: dict[str, Any] = {
        "powered": FLAG,
        "phase": ("i", 0, 3),
        "bits": ("i", 0, 9),  # of a byte and its acknowledge that SCL has clocked
        "byte": ("i", 0, 0xFF),
        "hold_tick": TICK,
        "wake_tick": TICK,
        "clock_tick": TICK,  # of SCL's last edge
        "short_clocks": TICK,
    }
    NOT_STATE: tuple[str, ...] = ("low_ticks", "high_ticks")
    LEAST_LOW_NS, LEAST_HIGH_NS = 1300, 600
    """Shortest low and high time of SCL: those of the fast mode, 400 kHz (UM10204, table 10)."""

    def __init__(self, keys: PartKeys, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.low_ticks = -(-self.LEAST_LOW_NS * self.crystal_hz // 1_000_000_000)  # rounded up
        self.high_ticks = -(-self.LEAST_HIGH_NS * self.crystal_hz // 1_000_000_000)
        self.powered = 0
        self.phase = _IDLE
        self.bits = 0
        self.byte = 0
        self.hold_tick = _NEVER
        self.wake_tick = _NEVER
        self.clock_tick = 0
        self.short_clocks = 0

    # For a part that derives from it

    def addressed(self, byte: int, tick: int) -> int:
        """True if it acknowledges an address byte: seven bits and, lowest, 1 if the master wants to read."""
        raise NotImplementedError

    def received(self, byte: int, tick: int) -> int:
        """True if it acknowledges a byte of the master's."""
        raise NotImplementedError

    def transmit(self, tick: int) -> int:
        """The next byte for the master."""
        raise NotImplementedError

    def ended(self, tick: int) -> None:
        """A stop ended what the master wrote to it, right after an acknowledge."""

    def woken(self, tick: int) -> None:
        """The tick has come for which it called `wake`."""

    def hold(self, until_tick: int) -> None:
        """Keeps SCL low up to a later tick: the master has to wait (clock stretching)."""
        self.hold_tick = until_tick
        self.drive(_SCL, LOW)
        self.next_tick = min(self.hold_tick, self.wake_tick)

    def wake(self, tick: int) -> None:
        """Asks for a call of `woken` at a later tick."""
        self.wake_tick = tick
        self.next_tick = min(self.hold_tick, self.wake_tick)

    # The bus

    def start(self, tick: int) -> None:
        self.powered = 1
        self.phase = _IDLE
        self.bits = self.byte = 0
        self.hold_tick = self.wake_tick = self.next_tick = _NEVER

    def supply(self, on: int, tick: int) -> None:
        self.powered = on
        self.hold_tick = self.wake_tick = _NEVER
        Part.supply(self, on, tick)

    def due(self, tick: int) -> None:
        if self.hold_tick <= tick:
            self.hold_tick = _NEVER
            self.drive(_SCL, RELEASED)
        if self.wake_tick <= tick:
            self.wake_tick = _NEVER
            self.woken(tick)
        self.next_tick = min(self.hold_tick, self.wake_tick)

    def changed(self, pins: int, tick: int) -> None:
        if not self.powered:
            return
        if pins & _SCL_BIT:
            is_high = self.levels & _SCL_BIT
            least = self.low_ticks if is_high else self.high_ticks
            if self.phase != _IDLE:
                if tick - self.clock_tick < least:
                    self.short_clocks += 1
                if is_high:
                    self._rose()
                else:
                    self._fell(tick)
            self.clock_tick = tick
        elif pins & _SDA_BIT and self.levels & _SCL_BIT:
            if not self.levels & _SDA_BIT:
                self.phase = _ADDRESS
                self.bits = self.byte = 0
                return
            # SCL has risen once since the acknowledge: a stop within a byte ends nothing.
            is_whole = self.phase == _RECEIVES and self.bits == 1
            self.phase = _IDLE
            if is_whole:
                self.ended(tick)

    def _rose(self) -> None:
        self.bits = self.bits % 9 + 1
        is_one = self.levels >> _SDA & 1
        if self.phase == _SENDS:
            if self.bits == 9 and is_one:  # the master does not acknowledge: it has had enough
                self.phase = _IDLE
        elif self.bits < 9:
            self.byte = (self.byte << 1 | is_one) & 0xFF

    def _fell(self, tick: int) -> None:
        if self.bits == 8:
            self._acknowledge(tick)
        elif self.bits == 9:
            self._next_byte(tick)
        elif self.phase == _SENDS:
            self._put_bit()

    def _acknowledge(self, tick: int) -> None:
        if self.phase == _SENDS:
            self.drive(_SDA, RELEASED)
        elif self.addressed(self.byte, tick) if self.phase == _ADDRESS else self.received(self.byte, tick):
            self.drive(_SDA, LOW)
        else:
            self.phase = _IDLE

    def _next_byte(self, tick: int) -> None:
        self.bits = 0
        if self.phase == _ADDRESS:
            self.phase = _SENDS if self.byte & 1 else _RECEIVES
        if self.phase == _SENDS:
            self.byte = self.transmit(tick) & 0xFF
            self._put_bit()
        else:
            self.byte = 0
            self.drive(_SDA, RELEASED)

    def _put_bit(self) -> None:
        self.drive(_SDA, RELEASED if self.byte >> (7 - self.bits) & 1 else LOW)
