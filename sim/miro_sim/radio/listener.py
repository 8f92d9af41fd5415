"""One robot's receiver: from what is on the air to the level on its RXD wire, by the chain in the README.

Idle carrier goes through the same chain, in slots of 2500 ticks of absolute time. Error draws of a bit are numbered by
the time at its transmitter, so that no two bits share one; all others by the slot (tick // 2500) in which the bit
begins here. So everything depends on what was sent and on the tick alone, not on how often or up to where one asked.
"""

from __future__ import annotations

from miro_exact.clock import CHARACTER_BITS, HOST_BIT_TICKS
from miro_exact.rng import Stream
from miro_exact.state import TICK
from miro_robot.mcs51.line import Line
from miro_sim.radio.chain import Chain
from miro_sim.radio.params import DOWN, NOISE, RXD_STATES, UP, Radio, threshold
from miro_sim.radio.sender import Sender
from miro_sim.radio.slicer import Slicer

_BIT = 2500
_CHARACTER = 10
_ONE = 1 << 32
_DOWN, _NOISE = DOWN, NOISE
_INVERTED, _AT_1 = RXD_STATES.index("inverted"), RXD_STATES.index("1")
assert (HOST_BIT_TICKS, CHARACTER_BITS) == (_BIT, _CHARACTER)


class Listener:
    """One robot's receiver. `bit_errors` counts the wrong bits of its own network so far.

    Characters that its module lost are not counted, nor bits of other networks. `rxd_state`: a fault of the wire, of
    `RXD_STATES`.
    """

    STATE = {
        "link_state": ("i", 0, NOISE),
        "bit_errors": TICK,
        "slicer": Slicer,
        "rxd_state": ("i", 0, len(RXD_STATES) - 1),
    }
    NOT_HASHED = ("rxd_state",)  # what comes through the wire is hashed
    NOT_STATE = (
        "burst_threshold", "bursts", "collision", "dropouts", "errors", "false_start", "idle", "line", "lost",
        "lost_threshold", "noise", "noise_alone", "squelch", "threshold",
    )  # fmt: skip

    def __init__(self, line: Line, params: Radio, seed: int, name: str) -> None:
        self.line = line
        self.errors = Stream(seed, f"{name}/errors")
        self.noise = Stream(seed, f"{name}/noise")
        self.idle = Stream(seed, f"{name}/idle")
        self.lost = Stream(seed, f"{name}/lost")
        self.collision = Stream(seed, f"{name}/collision")
        self.squelch = params.squelch
        self.threshold = params.error_threshold
        self.burst_threshold = params.burst_threshold
        self.false_start = params.false_start_threshold
        self.lost_threshold = threshold(params.lost_character_rate)
        self.bursts = None if params.bursts is None else Chain(params.bursts, seed, f"{name}/bursts")
        self.dropouts = None if params.dropouts is None else Chain(params.dropouts, seed, f"{name}/dropouts")
        self.slicer: Slicer | None = None
        if params.slicer is not None and params.eb_n0_db is not None:
            self.slicer = Slicer(params.slicer, params.eb_n0_db)
        self.noise_alone = self.bursts is None and self.dropouts is None and self.slicer is None
        self.link_state = UP
        self.rxd_state = 0
        self.bit_errors = 0

    def __repr__(self) -> str:
        return f"Listener({self.errors.name!r}, bit_errors={self.bit_errors}, slicer={self.slicer!r})"

    def reseed(self, seed: int, tick: int) -> None:
        """The noise of another seed from `tick` on."""
        for stream in (self.errors, self.noise, self.idle, self.lost, self.collision):
            stream.reseed(seed)
        for chain in (self.bursts, self.dropouts):
            if chain is not None:
                chain.reseed(seed, tick // _BIT)

    def fill_broken(self, tick: int, until: int, senders: list[Sender], rank: int) -> None:
        """`fill` on a wire that is broken: inverted, or at one level."""
        line, self.line = self.line, Line()
        self.fill(tick, until, senders, rank)
        heard, self.line = self.line, line
        if self.rxd_state != _INVERTED:
            line.append(tick, 1 if self.rxd_state == _AT_1 else 0)
            return
        line.append(tick, 1 - heard.level_at(tick))
        for edge, level in heard.edges():
            line.append(edge, 1 - level)

    def fill(self, tick: int, until: int, senders: list[Sender], rank: int) -> None:
        """The wire's edges from `tick` up to `until`, as `senders[rank:]` have it: the first one on the air wins.

        The others are heard in its pauses, and spoil its bits (`mixed`).
        """
        if self.link_state == _NOISE:
            self.hear_noise(tick, until)
            return
        if rank == len(senders) or self.link_state == _DOWN:
            level = self.silence(tick, tick // _BIT)
            if self.squelch:
                self.line.append(tick, level)
            else:
                self.hear_noise(tick, until)
            return
        sender = senders[rank]
        for index in range(len(sender.transmissions)):
            start, data, stops = sender.transmissions[index]
            tick = self.pause(tick, min(until, start - sender.keyup), senders, rank)
            stop = min(until, start)
            if tick < stop:
                self.hear_idle(tick, stop, senders, rank)
                tick = stop
            stop = min(until, sender.end(start, len(data)))
            if tick < stop:
                self.hear_data(tick, stop, start, data, stops, senders, rank)
                tick = stop
        self.pause(tick, until, senders, rank)

    def pause(self, tick: int, until: int, senders: list[Sender], rank: int) -> int:
        """Receives the pause between the transmissions of `senders[rank]`; returns the tick reached."""
        if tick >= until:
            return tick
        sender = senders[rank]
        if sender.always_on:
            self.hear_idle(tick, until, senders, rank)
        else:
            self.fill(tick, until, senders, rank + 1)
        return until

    def hear_noise(self, tick: int, until: int) -> None:
        """Random levels, from the receiver itself, or from noise on the frequency that is stronger than any carrier."""
        slot = tick // _BIT
        bits = self.noise.bits(slot)
        before = -1
        while tick < until:
            if slot & 31 == 0:
                bits = self.noise.bits(slot)
            level = bits >> (slot & 31) & 1
            if level != before:
                self.line.append(tick, level)
                before = level
            slot += 1
            tick = slot * _BIT

    def silence(self, tick: int, slot: int) -> int:
        """The level without a carrier."""
        if self.slicer is not None and self.slicer.signal:
            self.slicer.hear(tick, 0)
        if self.squelch:
            return 1
        return self.noise.bit(slot)

    def hear_idle(self, tick: int, until: int, senders: list[Sender], rank: int) -> None:
        """A carrier without data from `tick` to `until`."""
        slot = tick // _BIT
        if self.noise_alone and not self.false_start and rank + 1 == len(senders):
            self.line.append(tick, 1)
            return
        while tick < until:
            self.line.append(tick, self.idle_level(tick, slot, senders, rank))
            slot += 1
            tick = slot * _BIT

    def idle_level(self, tick: int, slot: int, senders: list[Sender], rank: int) -> int:
        """The level in a slot of idle carrier, or in what is left of it at `tick`."""
        if self.dropouts is not None and self.dropouts.bad(slot):
            return self.silence(tick, slot)
        level = 1
        if rank + 1 < len(senders):
            level = self.mixed(1, slot * _BIT, senders, rank)
        chance = self.false_start
        if self.slicer is not None:
            if tick == slot * _BIT or self.slicer.signal != 2 * level - 1:  # else asked before in this slot
                self.slicer.hear(tick, 2 * level - 1)
            chance += self.slicer.threshold(level)
        if self.bursts is not None and self.bursts.bad(slot):
            chance = self.burst_threshold
        if chance and self.idle.below(slot, min(chance, _ONE)):
            level ^= 1
        return level

    def hear_data(
        self, tick: int, until: int, start: int, data: bytes, stops: bytes, senders: list[Sender], rank: int
    ) -> None:
        """Part of a transmission whose first start bit arrives at `start`."""
        sender = senders[rank]
        count = sender.number(until - 1 - start) + 1
        begun = sender.number(tick - start)
        step = sender.numerator if sender.denominator == 1 else 0
        first = (start - sender.latency) // _BIT  # number of the first error draw
        place = begun % _CHARACTER
        levels = sender.levels(data, stops, begun)
        before = -1
        judged = self.next_judged(first, begun, count, stops, senders, rank)
        for number in range(begun, count):
            if place == _CHARACTER:
                place = 0
                levels = sender.levels(data, stops, number)
            level = levels >> place & 1
            place += 1
            if level == before and number != judged:
                continue
            begin = start + number * step if step else sender.begin(start, number)
            if number == judged:
                level = self.bit(begin, level, first, number, begin >= tick, senders, rank)
                judged = self.next_judged(first, number + 1, count, stops, senders, rank)
                if level == 0 and sender.bad_stop(stops, number):
                    self.hear_bad_stop(tick, until, begin, sender.back(start, number))
                    level = before = 1
            if level != before:
                self.line.append(max(begin, tick), level)
                before = level

    def next_judged(
        self, first: int, number: int, count: int, stops: bytes, senders: list[Sender], rank: int
    ) -> int:
        """The next bit from `number` on, before `count`, that may not be heard as it was sent."""
        if not self.noise_alone or self.lost_threshold or len(stops) > 0 or rank + 1 < len(senders):
            return number
        return self.errors.next_below(first + number, first + count, self.threshold) - first

    def hear_bad_stop(self, tick: int, until: int, begin: int, back: int) -> None:
        """Space from `begin` to `back`, then mark, as far as that lies in `tick` to `until`."""
        if tick < back:
            self.line.append(max(begin, tick), 0)
        if back < until:
            self.line.append(max(back, tick), 1)

    def bit(
        self, begin: int, sent: int, first: int, number: int, fresh: bool, senders: list[Sender], rank: int
    ) -> int:
        """The level in a bit that begins at `begin`; not `fresh`: it was evaluated before, or is cut off."""
        level = sent
        if self.dropouts is not None and self.dropouts.bad(begin // _BIT):
            level = self.silence(begin, begin // _BIT)
        else:
            if rank + 1 < len(senders):
                level = self.mixed(level, begin, senders, rank)
            chance = self.threshold
            if self.slicer is not None:
                if fresh:
                    self.slicer.hear(begin, 2 * level - 1)
                chance = self.slicer.threshold(level)
            if self.bursts is not None and self.bursts.bad(begin // _BIT):
                chance = self.burst_threshold
            if self.errors.below(first + number, chance):
                level ^= 1
        if level != sent and fresh and rank == 0:
            self.bit_errors += 1
        if self.lost_threshold and self.lost.below(first + number - number % _CHARACTER, self.lost_threshold):
            return 1
        return level

    def mixed(self, level: int, begin: int, senders: list[Sender], rank: int) -> int:
        """The level of `senders[rank]` at `begin`, or a fair coin if another one on the air has the other."""
        for index in range(rank + 1, len(senders)):
            sender = senders[index]
            if sender.level(begin) == 1 - level:
                return self.collision.bit(begin // _BIT)
        return level
