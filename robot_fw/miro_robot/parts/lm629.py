"""An LM629 on a board: motion controller of one motor, with a host bus of eight bits.

            +------------------+
    d0..d7  |                  | hi     to an interrupt input: by an inverter to /INT0
        ps  |      LM629N      |
     rd wr  |     (at 6 MHz)   | mag    PWM: to EN of a bridge
    cs rst  |                  | sign   1: negative torque
      a b  in                  |
            +------------------+

What it does is `lm629/chip.py`; here are its pins, and what firmware must not do to it: write while it is busy, break a
limit of its bus, read two chips at once. Several chips may share d0 to d7 and strobes; what firmware does to all of
them at once is one fault. They pull the data bus low and leave its high level to resistors, and see what others put
there, not what chips do. A drive is wired to `a` and `b`, or whatever else makes edges; without wires they are high.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.plugins import PluginError
from miro_exact.state import FLAG
from miro_robot.faults import FaultKind
from miro_robot.lm629.bus_timing import LIMITS, RESET_PULSE, BusTiming
from miro_robot.lm629.chip import Lm629
from miro_robot.lm629.options import Lm629Options
from miro_robot.parts.keys import IN, LOW, RELEASED, STRONG, TWO_WAY, PartKeys, Pin, Place
from miro_robot.parts.part import Part

CRYSTAL_HZ = 24_000_000
"""Crystal of the board: the chip's time is counted in its ticks."""
_PS, _RD, _WR, _CS, _RST, _HI, _MAG, _SIGN, _A, _B, _IN = range(8, 19)
_BUS, _PHASES, _INDEX = 0x1FFF, 3 << _A, 1 << _IN  # as bits
_STROBES, _READS = 0x0E00, 0x0400  # /RD /WR /CS; as they are while the chip is read
_RESET_TICKS = LIMITS[RESET_PULSE].ticks
_TIMING, _BUSY, _CONTENTION = FaultKind.LM629_TIMING, FaultKind.LM629_BUSY, FaultKind.BUS_CONTENTION
_KEPT = 1000  # commands that nobody takes


class Lm629Keys(PartKeys, frozen=True, kw_only=True, tag="lm629"):
    """An LM629 at 6 MHz. `options`: readings of what its sheets leave open."""

    PINS = (
        *(Pin(f"d{bit}", TWO_WAY) for bit in range(8)),
        *(Pin(name, IN) for name in ("ps", "rd", "wr", "cs", "rst")),
        *(Pin(name, STRONG, optional=True) for name in ("hi", "mag", "sign")),
        *(Pin(name, IN, optional=True) for name in ("a", "b", "in")),
    )
    READS = {
        "position": "counts, at the last sample",
        "velocity": "counts per sample, measured",
        "desired_position": "counts, of the profile",
        "desired_velocity": "counts per sample, of the profile",
        "pwm": "-127 to 127, in 1/128 of a period",
        "status": "bits 7 to 1 of the status byte",
        "hi": "level of the interrupt output",
    }
    SHEET = "LM629 data sheet SNVS781C: pins, host interface, AC characteristics"

    options: Lm629Options = Lm629Options()

    def make(self, place: Place) -> Part:
        if place.crystal_hz != CRYSTAL_HZ:
            reason = f"part {place.name!r} (lm629): its time is counted in ticks of 24 MHz"
            raise PluginError(reason, f"set crystal_hz = {CRYSTAL_HZ}")
        return Lm629Part(self, place)


class Lm629Part(Part):
    """`chip`: the LM629. `contention`: it is read together with another chip. `powered`: it has its supply."""

    STATE = {"chip": Lm629, "contention": FLAG, "powered": FLAG}
    NOT_STATE = ("timing", "others_on_bus", "pulled", "pulses_reach")
    SENSES_DRIVE = True  # who puts data on the bus is seen, though the chip pulls it low at the time

    def __init__(self, keys: Lm629Keys, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.chip = Lm629(keys.options)
        self.chip.pulses = 1 if _MAG in place.connected else 0
        for pin in (_HI, _MAG, _SIGN):
            self.drives[pin] = self.wanted[pin] = (
                LOW  # as the chip has them: a motor must not start before it does
            )
        self.timing = BusTiming()
        self.others_on_bus: list[Lm629Part] = []
        self.pulled = 0  # of d0 to d7, those that the chip pulls low
        self.pulses_reach = 0  # edges of `mag` and `sign` may come to the host
        self.contention = 0
        self.powered = 1

    def start(self, tick: int) -> None:
        place = self.place
        self.others_on_bus = [other for other, _ in place.peers.get(0, []) if isinstance(other, Lm629Part)]
        at_cpu = _MAG in place.at_cpu or _SIGN in place.at_cpu
        self.pulses_reach = 1 if at_cpu or self._others_at(_MAG) or self._others_at(_SIGN) else 0
        # A drive tells the chip of its edges itself, and where it stands.
        if tick == 0 and self._others_at(_A):
            self._see_encoder(tick, _PHASES)

    def _others_at(self, pin: int) -> list[Part]:
        """Parts on the net of a pin, but for those that move on all the time and pass nothing on."""
        return [part for part, _ in self.place.peers.get(pin, []) if not part.continuous]

    def supply(self, on: int, tick: int) -> None:
        """Without supply it is in reset, and its host is, too: the bus is at rest."""
        self.powered = on
        self.chip.set_reset(tick, self.level(_RST) & on)
        if on:
            self.start(tick)
            self._see_bus(tick)
        else:
            self.chip.set_bus(tick, 1, 1, 1, 1, 0xFF)
            self.timing.rest(0, 0, 1, 0xFF)
            self.contention = 0
        self._answer()

    def due(self, tick: int) -> None:
        self.chip.advance(tick)
        self._answer()

    def changed(self, pins: int, tick: int) -> None:
        if pins & _BUS:
            self._see_bus(tick)
        if pins & self.pulled:  # what changes behind a low of this chip comes to it alone
            self._show_others(tick)
        if pins & (_PHASES | _INDEX):
            self._see_encoder(tick, pins)
        self._answer()

    def _see_bus(self, tick: int) -> None:
        chip, levels = self.chip, self.levels
        data = self._data()
        cs, rd, wr, ps = levels >> _CS & 1, levels >> _RD & 1, levels >> _WR & 1, levels >> _PS & 1
        if chip.port.reading and levels & _STROBES != _READS:
            # A MOVX takes what it reads a tick before /RD rises; after port pins that is never too early.
            broken = self.timing.sampled(tick - 1)
            if broken:
                self.fault(_TIMING, LIMITS[broken].breach(self.timing.ticks), -1, 1)
        broken = self.timing.pins(tick, cs, rd, wr, ps, data)
        if broken:
            self.fault(_TIMING, LIMITS[broken].breach(self.timing.ticks), 0)
        rst = levels >> _RST & self.powered
        if rst != chip.reset_level:
            low_ticks = tick - chip.reset_tick
            if rst and low_ticks < _RESET_TICKS:
                self.fault(_TIMING, LIMITS[RESET_PULSE].breach(low_ticks), 1)
            chip.set_reset(tick, rst)
        lost = chip.writes_while_busy
        chip.set_bus(tick, cs, rd, wr, ps, data)
        if chip.writes_while_busy != lost:
            self.fault(_BUSY, "", 2)
        if self.others_on_bus:
            self._watch_others()
        if len(chip.commands) > _KEPT:
            del chip.commands[: _KEPT // 2]

    def _show_others(self, tick: int) -> None:
        for other in self.others_on_bus:
            other._see_bus(tick)

    def _data(self) -> int:
        """D7 to D0 without what this chip and others drive: of each bit, as who pulls it low sees it."""
        data = self.outside & 0xFF
        for other in self.others_on_bus:
            theirs = other._lows()
            data = data & ~theirs | other.outside & theirs
        return data

    def _lows(self) -> int:
        """Data pins that the chip pulls low."""
        lows = 0
        for pin in range(8):
            if self.drives[pin] == LOW:
                lows |= 1 << pin
        return lows

    def _watch_others(self) -> None:
        """Detects two chips read at a time on a shared bus. Several overlaps at once are one fault."""
        reading = 1 if self.levels & _STROBES == _READS else 0
        for other in self.others_on_bus:
            if other.levels & _STROBES == _READS:
                reading += 1
        contention = 1 if reading > 1 else 0
        if contention and not self.contention:
            self.fault(_CONTENTION, "", 3)
        self.contention = contention
        for other in self.others_on_bus:
            other.contention = contention

    def _see_encoder(self, tick: int, pins: int) -> None:
        if self.chip.next_tick <= tick:
            self.chip.advance(tick)
        if pins & _PHASES:
            self.chip.set_encoder(tick, self.levels >> _A & 1, self.levels >> _B & 1)
        if pins & _INDEX:
            self.chip.set_index(tick, self.levels >> _IN & 1)

    def _answer(self) -> None:
        """The outputs as they are now, and when they may change by themselves."""
        chip = self.chip
        if chip.port.reading or self.pulled:
            self._pull(~chip.port.drive & 0xFF if chip.port.reading else 0)
        if chip.pwm != self.wanted[_MAG]:  # most often: asked first, so that it costs little
            self.drive(_MAG, chip.pwm)
        if chip.sign != self.wanted[_SIGN] or chip.hi != self.wanted[_HI]:
            self.drive(_SIGN, chip.sign)
            self.drive(_HI, chip.hi)
        self.next_tick = min(chip.next_tick, chip.hi_falls_tick)
        if chip.sample_tick == NEVER_TICK or self.pulses_reach:
            self.reach_tick = self.next_tick
        else:
            # Only HI comes to the host: at an unmasked sample, or when it falls.
            self.reach_tick = min(chip.hi_falls_tick, chip.sample_tick if chip.signals.mask else NEVER_TICK)

    def _pull(self, lows: int) -> None:
        """Pulls these data pins low, but for those that another chip pulls: it takes them over when that lets go."""
        for other in self.others_on_bus:
            lows &= ~other.pulled
        if lows != self.pulled:
            self.pulled = lows
            for pin in range(8):
                self.drive(pin, LOW if lows >> pin & 1 else RELEASED)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        chip = self.chip
        values = {
            "position": chip.real_position,
            "velocity": chip.real_velocity,
            "desired_position": chip.desired_position,
            "desired_velocity": chip.desired_velocity / 65536.0,
            "pwm": -chip.pwm_magnitude if chip.sign == chip.negative else chip.pwm_magnitude,
            "status": chip.status,
            "hi": chip.hi,
        }
        return values[name]

    def after_load(self) -> None:
        """The bus is at rest between two instructions. Raises ValueError for a chip at another time."""
        chip = self.chip
        if self.next_tick != min(chip.next_tick, chip.hi_falls_tick):
            raise ValueError(f"{self.name} has its next event at tick {self.next_tick}, its chip has not")
        chip.check_times(self.next_tick)
        self.pulled = self._lows()
        self.timing.rest(chip.port.writing, chip.port.reading, chip.port.ps, chip.port.data)
