"""A DS18B20: a thermometer on one wire, which others may share; each has a number of its own.

reset     |__480 us or more__|~~30~~|__120__|~~~   the last low is the presence pulse: somebody is there
write 1   |_5_|~~~~~~~~~~~~~~                      a slot of 60 us or more begins when the wire falls;
write 0   |________60________|~                    the chip looks after `slot_us`
read      |_2_|..............                      for a 0 the chip holds the wire low for `slot_us`

    reset, presence, ROM command (who is meant), function command, bytes; the lowest bit first

A conversion takes the temperature of its begin, and after 94 to 750 ms it is in the scratchpad; before the first one
it is 85 degrees. A conversion that is going on is not begun anew by another command to convert (chosen: the sheet does
not say; programs that ask again every 20 ms are common, and their displays show the temperature). With parasite power
the wire must stay high meanwhile: where it falls the chip has no supply, and 85 degrees is what it says then (chosen).
Whether the wire is high strongly enough is not judged. Limits of the master's times other than the reset's are not
judged: a slot that is too short is misread, as by the chip.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta

from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import LOW, OPEN_DRAIN, RELEASED, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_NEVER = 1 << 62
_RESET_US, _WAIT_US, _PRESENCE_US = 480, 30.0, 120.0  # t_RSTL, t_PDHIGH (15 to 60), t_PDLOW (60 to 240)
_CONVERT_US, _COPY_US = 93_750.0, 10_000.0  # t_CONV of 9 bits, t_WR
_IDLE, _PRESENCE, _ROM, _MATCH, _FUNCTION, _WRITE, _SEARCH, _READ_ROM, _SEND, _STATUS, _POWER = range(11)
"""Phases; from `_SEARCH` on it sends."""
_ALARM_SEARCH, _CONVERT, _READ_SCRATCHPAD, _COPY, _RECALL = 0xEC, 0x44, 0xBE, 0x48, 0xB8
_ROM_COMMANDS = {0x33: _READ_ROM, 0x55: _MATCH, 0xCC: _FUNCTION, 0xF0: _SEARCH, 0xEC: _SEARCH}
_COMMANDS = {0x44: _STATUS, 0x4E: _WRITE, 0xBE: _SEND, 0x48: _STATUS, 0xB8: _STATUS, 0xB4: _POWER}
"""Command to the phase that it begins."""
_NOT_CONVERTED = 0x0550
_FAMILY = 0x28
_BROKEN = ("none", "missing", "crc", "low")
_MISSING, _CRC, _SHORT = 1, 2, 3


class Ds18b20(PartKeys, frozen=True, kw_only=True, tag="ds18b20"):
    """A thermometer. `serial`: twelve hex digits, as a master sends them; left out, the part's name makes them.

    `slot_us`: after which the chip looks at a slot, and for which it holds a 0: 15 for the fastest, 60 for the slowest.
    `power`: over its own pin, or parasite. `eeprom`: TH, TL and configuration, kept without supply.
    """

    PINS = (Pin("dq", OPEN_DRAIN),)
    PUTS = {
        "temperature_c": Annotated[float, Meta(ge=-55.0, le=125.0)],
        "broken": Literal["none", "missing", "crc", "low"],
    }
    READS = {
        "temperature_c": "of the place where it is",
        "scratchpad_c": "what it would tell now: 85 before the first conversion",
        "converting": "whether a conversion is going on",
        "conversions": "conversions begun",
        "rom": "its eight bytes as they are sent, as hex digits",
        "broken": "none, missing, crc (of the scratchpad is wrong), low (the wire is shorted)",
    }
    SHEET = (
        "Maxim 19-7487, DS18B20: measuring temperature, 64-bit ROM code, memory, ROM commands, function commands, "
        "1-Wire signaling, AC electrical characteristics"
    )

    serial: str = ""
    slot_us: Annotated[float, Meta(ge=15.0, le=60.0)] = 30.0
    power: Literal["vdd", "parasite"] = "vdd"
    eeprom: str = "4b467f"

    def __post_init__(self) -> None:
        _bytes_of(self.serial or "000000000000", 6, "serial")
        _bytes_of(self.eeprom, 3, "eeprom")

    def make(self, place: Place) -> Part:
        return Ds18b20Part(self, place)


def _bytes_of(text: str, count: int, key: str) -> bytes:
    """Parses `count` bytes in hex digits; raises ValueError for any other text."""
    digits = text.strip().lower()
    if len(digits) != 2 * count or digits.strip("0123456789abcdef"):
        raise ValueError(f"{key} is {text!r}, not {2 * count} hex digits")
    return bytes.fromhex(digits)


def crc8(values: list[int]) -> int:
    """X^8 + X^5 + X^4 + 1 over bytes, lowest bit first."""
    crc = 0
    for value in values:
        crc ^= value
        for _ in range(8):
            crc = crc >> 1 ^ (0x8C if crc & 1 else 0)
    return crc


class Ds18b20Part(Part):
    """`done`: slots of this phase. `byte`: the bits received. `raw`: in the scratchpad; `sample`: of a conversion."""

    STATE = {
        "phase": ("i", 0, _POWER),
        "done": ("i", 0, 192),
        "byte": ("i", 0, 0xFF),
        "fall_tick": TICK,
        "temperature_c": ("d", -55.0, 125.0),
        "raw": ("i", -0x8000, 0x7FFF),
        "sample": ("i", -0x8000, 0x7FFF),
        "has_sample": FLAG,
        "has_alarm": FLAG,
        "ready_tick": TICK,
        "copied_tick": TICK,
        "conversions": TICK,
        "user": "3B",  # TH, TL, configuration
        "kept": "3B",
        "sent": "9B",
        "broken": ("i", 0, _SHORT),
    }
    NOT_STATE = (
        *("rom", "is_parasite", "reset_ticks", "wait_ticks", "presence_ticks", "slot_ticks"),
        *("convert_ticks", "copy_ticks"),
    )

    def __init__(self, keys: Ds18b20, place: Place) -> None:
        Part.__init__(self, keys, place)
        name = place.name.encode().rjust(6, b"\0")
        rom = [_FAMILY, *(bytes.fromhex(keys.serial) or name[len(name) - 6 :])]
        self.rom = [*rom, crc8(rom)]
        self.is_parasite = 1 if keys.power == "parasite" else 0
        self.reset_ticks = -(-_RESET_US * self.crystal_hz // 1_000_000)  # rounded up
        self.wait_ticks, self.presence_ticks = self.ticks(_WAIT_US), self.ticks(_PRESENCE_US)
        self.slot_ticks = self.ticks(keys.slot_us)
        self.convert_ticks = [self.ticks(_CONVERT_US * (1 << bits)) for bits in range(4)]
        self.copy_ticks = self.ticks(_COPY_US)
        self.temperature_c = 20.0
        self.kept = list(bytes.fromhex(keys.eeprom))
        self.user = [0, 0, 0]
        self.sent = [0] * 9
        self.phase = self.done = self.byte = self.broken = 0
        self.raw = self.sample = self.has_sample = self.has_alarm = 0
        self.fall_tick = self.ready_tick = self.copied_tick = self.conversions = 0

    def start(self, tick: int) -> None:
        self.fall_tick = tick
        self.next_tick = _NEVER
        self._lose()
        self.drive(0, LOW if self.broken == _SHORT else RELEASED)

    def _lose(self) -> None:
        """Resets to the state after power-on."""
        self.phase = _IDLE
        self._recall()
        self.raw = _NOT_CONVERTED
        self.has_sample = self.has_alarm = 0
        self.ready_tick = self.copied_tick = 0

    def _recall(self) -> None:
        for index in range(3):
            self.user[index] = self.kept[index]

    # The wire

    def changed(self, pins: int, tick: int) -> None:
        if self.levels & 1:
            if tick - self.fall_tick >= self.reset_ticks:
                self._reset(tick)
            return
        self.fall_tick = tick
        if self.is_parasite and self.has_sample and tick < self.ready_tick:
            self._lose()
        if self.phase == _IDLE or self.next_tick != _NEVER:
            return
        self.next_tick = tick + self.slot_ticks
        self.reach_tick = _NEVER
        if self._sends() and not self._bit(tick):
            self.reach_tick = 0
            self.drive(0, LOW)

    def _reset(self, tick: int) -> None:
        self.phase, self.next_tick, self.reach_tick = _IDLE, _NEVER, 0
        if self.broken != _MISSING:
            self.phase = _PRESENCE
            self.next_tick = tick + self.wait_ticks

    def due(self, tick: int) -> None:
        """A slot is over for the chip, or its presence pulse begins or ends."""
        self.next_tick = _NEVER
        if self.phase == _PRESENCE:
            if self.wanted[0] != LOW:
                self.drive(0, LOW)
                self.next_tick = tick + self.presence_ticks
                return
            self._go_to(_ROM)
        elif self._sends():
            self._sent_one()
        else:
            self._take(self.levels & 1, tick)
        self.drive(0, RELEASED)

    def _go_to(self, phase: int) -> None:
        self.phase = phase
        self.done = 0

    def _sends(self) -> int:
        return 1 if self.phase >= _SEARCH and not (self.phase == _SEARCH and self.done % 3 == 2) else 0

    def _rom_bit(self, number: int) -> int:
        return int(self.rom[number >> 3 & 7]) >> (number & 7) & 1

    def _bit(self, tick: int) -> int:
        """The bit that it sends in this slot."""
        if self.phase == _SEARCH:
            return self._rom_bit(self.done // 3) ^ self.done % 3
        if self.phase == _READ_ROM:
            return self._rom_bit(self.done)
        if self.phase == _SEND:
            return self.sent[self.done >> 3] >> (self.done & 7) & 1 if self.done < 72 else 1
        if self.phase == _POWER:
            return 1 - self.is_parasite
        return 1 if tick >= self.ready_tick and tick >= self.copied_tick else 0

    def _sent_one(self) -> None:
        if (self.phase < _STATUS and self.done < 72) or self.phase == _SEARCH:
            self.done += 1
        if self.phase == _READ_ROM and self.done == 64:
            self._go_to(_FUNCTION)

    def _take(self, level: int, tick: int) -> None:
        """The master has written a bit."""
        number = self.done
        self.done += 1
        if self.phase == _MATCH or self.phase == _SEARCH:
            if level != self._rom_bit(number if self.phase == _MATCH else number // 3) or self.done == 192:
                self.phase = _IDLE
            elif self.phase == _MATCH and self.done == 64:
                self._go_to(_FUNCTION)
            return
        self.byte = self.byte >> 1 | level << 7
        if self.done & 7:
            return
        if self.phase != _WRITE:
            self._command(tick)
            return
        self.user[min(number >> 3, 2)] = self.byte if number < 16 else self.byte & 0x60 | 0x1F
        if number > 16:
            self.phase = _IDLE

    # Commands

    def _command(self, tick: int) -> None:
        """A command is there: a ROM command, or what those that are meant shall do."""
        self._finish(tick)
        command = self.byte
        if self.phase == _ROM:
            self._go_to(_ROM_COMMANDS.get(command, _IDLE))
            if command == _ALARM_SEARCH and not self.has_alarm:
                self.phase = _IDLE
            return
        self._go_to(_COMMANDS.get(command, _IDLE))
        if command == _CONVERT:
            self._convert(tick)
        elif command == _READ_SCRATCHPAD:
            self._load()
        elif command == _COPY:
            for index in range(3):
                self.kept[index] = self.user[index]
            self.copied_tick = tick + self.copy_ticks
        elif command == _RECALL:
            self._recall()

    def _convert(self, tick: int) -> None:
        if self.has_sample:
            return
        bits = self.user[2] >> 5 & 3
        sixteenths = int(self.temperature_c * 16.0 + 0x8000 + 0.5) - 0x8000  # rounded half up
        self.sample = sixteenths & ~((1 << (3 - bits)) - 1)
        self.has_sample = 1
        self.ready_tick = tick + self.convert_ticks[bits]
        self.conversions += 1

    def _finish(self, tick: int) -> None:
        """A conversion that is over by now has its result in the scratchpad, and the alarm is judged by it."""
        if self.has_sample and tick >= self.ready_tick:
            self.has_sample = 0
            self.raw = self.sample
            degrees = self.raw >> 4
            high, low = (self.user[0] ^ 0x80) - 0x80, (self.user[1] ^ 0x80) - 0x80
            self.has_alarm = 1 if degrees >= high or degrees <= low else 0

    def _load(self) -> None:
        values = [self.raw & 0xFF, self.raw >> 8 & 0xFF, self.user[0], self.user[1], self.user[2]]
        values += [0xFF, 0x0C, 0x10]
        values.append(crc8(values) ^ (0xFF if self.broken == _CRC else 0))
        for index in range(9):
            self.sent[index] = values[index]

    # Tests

    def put(self, name: str, value: Any, tick: int) -> None:
        """A temperature holds from the next conversion on; what is missing has no supply either."""
        if name == "temperature_c":
            self.temperature_c = value
            return
        was_short = self.broken == _SHORT
        self.broken = _BROKEN.index(value)
        if self.broken == _MISSING:
            self._lose()
        if self.broken != _CRC or was_short:
            self.phase, self.next_tick = _IDLE, _NEVER
            self.drive(0, LOW if self.broken == _SHORT else RELEASED)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        is_over = self.has_sample and tick >= self.ready_tick
        if name == "scratchpad_c":
            return (self.sample if is_over else self.raw) / 16.0
        if name == "converting":
            return bool(self.has_sample and not is_over)
        if name == "rom":
            return "".join([f"{self.rom[number]:02x}" for number in range(8)])
        return _BROKEN[self.broken] if name == "broken" else Part.read(self, name, tick)
