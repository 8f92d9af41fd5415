"""The PC's end of the band up: a UART that turns the level into symbols.

It waits for a falling edge, samples the start bit in its middle (1250 ticks on; mark there is a false start), then
eight data bits and the stop bit 2500 ticks apart (another fraction of ticks where baud rate or crystals are off), and
waits for the next falling edge after the stop bit's sample. A symbol is known at that sample.
"""

from __future__ import annotations

from miro_exact.clock import CHARACTER_BITS, NEVER_TICK
from miro_exact.state import FLAG, TICK
from miro_sim.radio.band import Band
from miro_sim.radio.params import Radio

_STOP = 9  # number of the stop bit, the start bit being 0
assert CHARACTER_BITS == _STOP + 1


class Uplink:
    """The PC's reception from the robots of one network; the errors come from the stream NAME/errors.

    `now`: everything below this tick has been received. `bit_errors`: samples taken of an inverted level.
    The robots' wires are this object's to forget: edges that it has come past are dropped from them.
    """

    STATE = {
        "now": TICK,
        "before": FLAG,
        "start_tick": ("q", -1, NEVER_TICK),
        "bit": ("i", 0, 10),
        "shift": ("i", 0, 0xFF),
        "bit_errors": TICK,
        "band": Band,
    }
    NOT_STATE = ("denominator", "name", "numerator")

    def __init__(self, params: Radio, seed: int, name: str) -> None:
        self.name = name
        self.band = Band(params, seed, name)
        self.numerator = params.bit_ticks.numerator
        self.denominator = 2 * params.bit_ticks.denominator  # of half a bit
        self.now = 0
        self.before = 1  # level just before `now`, while waiting for a start bit
        self.start_tick = -1  # falling edge of the character being received, -1 while waiting for one
        self.bit = 0  # number of the bit to be sampled next
        self.shift = 0  # data bits so far, first one lowest
        self.bit_errors = 0

    def __repr__(self) -> str:
        return f"Uplink({self.name!r}, now={self.now}, start_tick={self.start_tick}, bit={self.bit})"

    def receive(self, until_tick: int) -> list[tuple[int, bool, int]]:
        """Symbols (byte, stop bit good, tick of the start bit's edge) known before `until_tick`.

        Never looks past the ticks up to which the wires are settled; what comes later is left for the next
        call.
        """
        until = min(until_tick, self.band.limit())
        symbols: list[tuple[int, bool, int]] = []
        while self.now < until:
            if self.start_tick < 0:
                self.hunt(until)
            else:
                self.sample(until, symbols)
        self.band.hear(self.now)
        return symbols

    def known_tick(self, start_tick: int) -> int:
        """The first tick at which a symbol is known whose start bit began at `start_tick`."""
        return start_tick + (2 * _STOP + 1) * self.numerator // self.denominator + 1

    def hunt(self, until: int) -> None:
        """Goes on to the next falling edge, or a place without one."""
        level = self.band.level(self.now) & 1
        if self.before == 1 and level == 0:
            self.start_tick = self.now
            self.bit = 0
            self.shift = 0
        else:
            self.now = min(self.band.change_tick, until)
        self.before = level

    def sample(self, until: int, symbols: list[tuple[int, bool, int]]) -> None:
        """Takes the bits of the character, each in its middle, up to `until`."""
        while self.start_tick >= 0:
            middle = self.start_tick + (2 * self.bit + 1) * self.numerator // self.denominator
            if middle >= until:
                self.now = until
                return
            self.now = middle + 1
            level = self.band.level(middle)
            self.bit_errors += level >> 1
            level &= 1
            if 0 < self.bit < _STOP:
                self.shift |= level << (self.bit - 1)
            elif self.bit == _STOP:
                symbols.append((self.shift, level == 1, self.start_tick))
            if self.bit == _STOP or (self.bit == 0 and level == 1):
                self.start_tick = -1
                self.before = level
            self.bit += 1

    def after_load(self) -> None:
        """Raises ValueError for a character that would be over already, or has not begun."""
        if self.start_tick > self.now:
            raise ValueError(f"a character begins at tick {self.start_tick}, after {self.now}")
        if self.start_tick >= 0 and self.now - self.start_tick > self.numerator * 22 // self.denominator:
            raise ValueError(f"a character that began at tick {self.start_tick} is over at {self.now}")
        self.band.hear(self.now)
