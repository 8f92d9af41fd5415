"""A character display with an HD44780U: 2 rows of 16 characters, or 1, 2, 4 rows of up to 40; `lcd2004` has 4 of 20.

     ┌───────────────────────────────┐
     │ row1                          │   rs      0: instructions, busy flag; 1: data
     │ row2                          │   rw      1: read; not connected, it is tied to ground
     └┬──┬──┬──┬──┬──┬──┬──┬──┬──┬──┬┘   e       a write is taken when it falls, a read lasts while it is high
      rs rw e  d0 d1 d2 d3 d4 d5 d6 d7   d0..d3  not connected with four wires: the chip pulls them high

          ┌─────┐         ┌─────┐
    E   ──┘     └─────────┘     └────       four wires: the upper half of a byte, then the lower one
    D7..D4  7..4            3..0            busy after the last fall: 37 us, clear and home 1.52 ms

A byte that is written while it is busy is lost and counted in `lost`; its halves count all the same. A pulse that
breaks the bus timing is counted in `short_pulses` and taken all the same; of signals that change on the tick on which E
falls, what they were before. From a processor of 12 ticks a cycle E is never too short below 48 MHz: what is left is
RS, R/W or data that are written by the same instruction as E.

For `reset_ms` after power-on it takes nothing. A processor whose reset pin hangs on a capacitor begins later than that:
`reset_ms = 0` is then what its program finds.

A program that reads the busy flag while its port still drives data low works against the display's outputs: contention,
a fault. They source 0.2 mA (DC characteristics), so the port wins; `allow_contention = ["P0"]` lets it be.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import IN, RELEASED, TWO_WAY, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_RS, _SELECT, _RW, _E, _DATA = 0b1, 0b11, 0b10, 0b100, 0xFF << 3
_D0, _D7 = 3, 10
_NEVER = NEVER_TICK
_TIMES_US = 37.0, 1520.0, 1500.0 / 270.0
"""At 270 kHz: an instruction; clear and home (table 6); the address counter after the busy flag (figure 10)."""
_BUS_NS = 230, 500, 40, 80
"""PW_EH, t_cycE, t_AS, t_DSW: bus timing at 4.5 to 5.5 V."""
_ROM = (
    2 * "⓪①②③④⑤⑥⑦"
    + 16 * " "
    + "".join(map(chr, range(0x20, 0x7E))).replace("\\", "¥")
    + "→←"
    + 33 * " "
    + "".join(map(chr, range(0xFF61, 0xFFA0)))
    + "αäβεμσρg√\ufffdjˣ¢£ñöpqθ∞ΩüΣπ\ufffdy千万円÷ █"  # noqa: RUF001
)
"""By code: ROM A00 (table 4). Those of CGRAM are numbers in circles; FFFDh: Unicode has no such character."""


class Lcd1602(PartKeys, frozen=True, kw_only=True, tag="lcd1602"):
    """A character display with an HD44780U. `rows`, `columns`; `clock_khz`: its oscillator.

    `clock_khz` is 190 to 350 with the usual 91 kohm. `reset_ms`: it is busy after power-on (10 ms after 4.5 V; how
    fast the supply rises is up to the board).
    Raises ValueError for more than 80 characters.
    """

    PINS = (
        Pin("rs"),
        Pin("rw", IN, optional=True, level=0),
        Pin("e"),
        *(Pin(f"d{bit}", TWO_WAY, optional=bit < 4) for bit in range(8)),
    )
    READS = {
        "text": "all rows as they are shown, spaces kept, with line ends between them",
        **{f"row{number}": f"row {number} as it is shown" for number in range(1, 5)},
        "on": "whether it shows anything",
        "cursor": "ROW:COLUMN, from 1 on, of a cursor that is shown, or nothing",
        "blink": "whether the character at the cursor blinks",
        "busy": "whether it would lose what is written now",
        "lost": "bytes that were written while it was busy",
        "short_pulses": "how often E was too short, or RS, R/W or the data changed too late or too early",
    }
    SHEET = "Hitachi HD44780U, ADE-207-272: function description, instructions, reset function, bus timing"

    rows: Literal[1, 2, 4] = 2
    columns: Annotated[int, Meta(ge=8, le=40)] = 16
    clock_khz: Annotated[int, Meta(ge=125, le=350)] = 270
    reset_ms: Annotated[float, Meta(ge=0, le=100)] = 10.0

    def __post_init__(self) -> None:
        if self.rows * self.columns > 80:
            raise ValueError(f"{self.rows} rows of {self.columns}: an HD44780 has 80 characters")

    @property
    def pulled_up(self) -> tuple[str, ...]:
        """All but E (I/O pin configuration)."""
        return tuple(pin.name for pin in self.PINS if pin.name != "e")

    def make(self, place: Place) -> Part:
        return Lcd1602Part(self, place)


class Lcd2004(Lcd1602, frozen=True, kw_only=True, tag="lcd2004"):
    """A display of 4 rows of 20; rows 3 and 4 go on in memory where rows 1 and 2 end. Other keys: see lcd1602."""

    rows: Literal[1, 2, 4] = 4
    columns: Annotated[int, Meta(ge=8, le=40)] = 20


class Lcd1602Part(Part):
    """`entry`, `display`, `function`: the last instruction of each kind. `data`: its data register."""

    STATE: dict[str, Any] = {
        "powered": FLAG,
        "entry": ("i", 0, 3),  # I/D, S
        "display": ("i", 0, 7),  # D, C, B
        "function": ("i", 0, 31),  # DL, N, F, x, x
        "in_cgram": FLAG,
        "address": ("i", 0, 127),
        "old_address": ("i", 0, 127),  # is read up to `count_tick`
        "shift": ("i", 0, 79),
        "data": ("i", 0, 255),
        "upper": ("i", 0, 255),
        "half": FLAG,  # of four wires: the upper half is there
        "busy_tick": TICK,
        "count_tick": TICK,
        "rise_tick": TICK,  # of E
        "select_tick": TICK,  # RS or R/W changed
        "data_tick": TICK,
        "lost": TICK,
        "short_pulses": TICK,
        "ddram": "128B",
        "cgram": "64B",
    }
    NOT_STATE = (
        *("rows", "columns", "reset_ticks", "short_ticks", "long_ticks", "count_ticks"),
        *("width_ticks", "cycle_ticks", "select_ticks", "data_ticks"),
    )

    def __init__(self, keys: Lcd1602, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.rows, self.columns = keys.rows, keys.columns
        self.reset_ticks = self.ticks(1000.0 * keys.reset_ms)
        times = [self.ticks(time_us * 270.0 / keys.clock_khz) for time_us in _TIMES_US]
        self.short_ticks, self.long_ticks, self.count_ticks = times
        limits = [-(-limit_ns * self.crystal_hz // 1_000_000_000) for limit_ns in _BUS_NS]  # rounded up
        self.width_ticks, self.cycle_ticks, self.select_ticks, self.data_ticks = limits
        self.powered = 0
        self.entry = self.display = self.function = 0
        self.in_cgram = self.address = self.old_address = self.shift = 0
        self.data = self.upper = self.half = 0
        self.busy_tick = self.count_tick = 0
        self.rise_tick = self.select_tick = self.data_tick = 0
        self.lost = self.short_pulses = 0
        self.ddram = [0] * 128
        self.cgram = [0] * 64

    def start(self, tick: int) -> None:
        """The internal reset."""
        self.powered = 1
        for instruction in (0b1, 0b110000, 0b1000, 0b110):  # clear, eight wires and one line, off, increment
            self._execute(instruction, tick)
        self.data = self.half = 0
        self.busy_tick = tick + self.reset_ticks
        self.count_tick = 0
        self.rise_tick = _NEVER  # ports are high from power-on on: that E falls within the reset is no pulse
        self._answer(tick)

    def supply(self, on: int, tick: int) -> None:
        self.powered = self.display = 0
        Part.supply(self, on, tick)

    # The bus

    def changed(self, pins: int, tick: int) -> None:
        if not self.powered:
            return
        if pins & _E:
            if self.levels & _E:
                self._rose(pins, tick)
            else:
                self._fell(pins, tick)
        if pins & (_E | _SELECT):
            self._answer(tick)
        if pins & _SELECT:
            self.select_tick = tick
        if pins & _DATA:
            self.data_tick = tick

    def due(self, tick: int) -> None:
        """The busy flag falls, or the address moves on, while they are read."""
        self._answer(tick)

    def _answer(self, tick: int) -> None:
        """Drives the data pins while it is read."""
        self.next_tick = _NEVER
        if ~self.levels & (_E | _RW):
            if self.wanted[_D7] != RELEASED:
                for pin in range(_D0, _D7 + 1):
                    self.drive(pin, RELEASED)
            return
        value = self.data
        if not self.levels & _RS:
            value = self.address
            if tick < self.count_tick:
                value = self.old_address
                self.next_tick = self.count_tick
            if tick < self.busy_tick:
                value |= 0x80
                self.next_tick = self.busy_tick
        if self.half:
            value <<= 4
        first = _D0 if self.function & 0b10000 else _D0 + 4
        for pin in range(first, _D7 + 1):
            self.drive(pin, value >> (pin - _D0) & 1)

    def _rose(self, pins: int, tick: int) -> None:
        late = pins & _SELECT or tick - self.select_tick < self.select_ticks
        if late or tick - self.rise_tick < self.cycle_ticks:
            self.short_pulses += 1
        self.rise_tick = tick

    def _fell(self, pins: int, tick: int) -> None:
        """E falls: a byte, or half of one, has come or gone."""
        if self.rise_tick == _NEVER:
            self.rise_tick = 0
            if tick < self.busy_tick:
                return
        before = self.levels ^ pins
        is_read = before & _RW
        late = not is_read and (pins & (_SELECT | _DATA) or tick - self.data_tick < self.data_ticks)
        if late or tick - self.rise_tick < self.width_ticks:
            self.short_pulses += 1
        byte = before >> _D0 & 0xFF
        if not self.function & 0b10000:
            self.half ^= 1
            if self.half:
                self.upper = byte & 0xF0
                return
            byte = self.upper | byte >> 4
        if tick < self.busy_tick:
            self.lost += 0 if is_read else 1
        elif not before & _RS:
            if not is_read:
                self._execute(byte, tick)
        elif is_read:
            self._count(tick)
            self._load()
        else:
            self._store(byte)
            self._count(tick)

    # What it does

    def _execute(self, byte: int, tick: int) -> None:
        """An instruction (table 6): its kind is the highest bit that is set."""
        self.busy_tick = tick + (self.long_ticks if 0 < byte < 4 else self.short_ticks)
        self.count_tick = 0
        if byte & 0x80:
            self._go_to(0, byte & 0x7F)
        elif byte & 0x40:
            self._go_to(1, byte & 0x3F)
        elif byte & 0x20:
            self.function = byte & 0x1F
            self.shift %= self._line()
        elif byte & 0x10:
            step = 1 if byte & 4 else -1
            if byte & 8:
                self._scroll(-step)
            else:
                self._go_to(self.in_cgram, self._next(step))
        elif byte & 0x08:
            self.display = byte & 7
        elif byte & 0x04:
            self.entry = byte & 3
        elif byte:
            self.shift = 0
            if byte == 1:
                self.entry |= 2
                for place in range(128):
                    self.ddram[place] = 0x20
            self._go_to(0, 0)

    def _go_to(self, in_cgram: int, address: int) -> None:
        self.in_cgram, self.address = in_cgram, address
        self._load()

    def _load(self) -> None:
        self.data = self.cgram[self.address & 0x3F] if self.in_cgram else self.ddram[self.address]

    def _store(self, byte: int) -> None:
        self.data = byte
        if self.in_cgram:
            self.cgram[self.address & 0x3F] = byte
        else:
            self.ddram[self.address] = byte
            if self.entry & 1:
                self._scroll(1 if self.entry & 2 else -1)

    def _count(self, tick: int) -> None:
        """A byte was written or read: the address counter moves on, a little later than the busy flag falls."""
        self.old_address = self.address
        self.address = self._next(1 if self.entry & 2 else -1)
        self.busy_tick = tick + self.short_ticks
        self.count_tick = self.busy_tick + self.count_ticks

    def _next(self, step: int) -> int:
        """The address after this one: from the end of a line to the start of the next one."""
        if self.in_cgram:
            return (self.address + step) & 0x3F
        last = 0x67 if self.function & 0b1000 else 0x4F
        if self.address == (last if step > 0 else 0):
            return 0 if step > 0 else last
        if self.function & 0b1000 and self.address == (0x27 if step > 0 else 0x40):
            return 0x40 if step > 0 else 0x27
        return (self.address + step) & 0x7F

    def _line(self) -> int:
        """Characters of a line in memory."""
        return 40 if self.function & 0b1000 else 80

    def _scroll(self, step: int) -> None:
        self.shift = (self.shift + step + self._line()) % self._line()

    # What is seen

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name == "text":
            return "\n".join([self._row(number) for number in range(self.rows)])
        if name.startswith("row"):
            return self._row(int(name[3:]) - 1)
        if name == "on":
            return self.display >> 2
        if name == "blink":
            return self.display & 0b101 == 0b101
        if name == "busy":
            return tick < self.busy_tick
        return self._cursor() if name == "cursor" else Part.read(self, name, tick)

    def _places(self, row: int) -> list[int]:
        """DDRAM addresses of the characters of a row, from 0 on; none where it does not drive that row."""
        two_lines = self.function >> 3 & 1
        if row >= self.rows or row & 1 > two_lines:
            return []
        first = self.shift + (self.columns if row > 1 else 0)
        return [0x40 * (row & 1) + (first + column) % self._line() for column in range(self.columns)]

    def _row(self, row: int) -> str:
        codes = [self.ddram[place] for place in self._places(row)] if self.display & 4 else []
        width = self.columns if row < self.rows else 0
        return "".join([_ROM[code] for code in codes]).ljust(width)

    def _cursor(self) -> str:
        for row in range(self.rows if self.display > 4 and not self.in_cgram else 0):
            places = self._places(row)
            if self.address in places:
                return f"{row + 1}:{places.index(self.address) + 1}"
        return ""
