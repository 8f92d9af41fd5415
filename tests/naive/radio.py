"""The radio's two bands as functions of time, one segment after the other, and a UART that reads such a function.

Written from the definitions in `miro_sim.radio` and its README; draws come from the naive streams. Everything is
evaluated from the beginning at every call.
"""

from bisect import bisect_right
from fractions import Fraction
from functools import cache
from typing import NamedTuple

from miro_exact.clock import ticks
from miro_sim.radio.params import margin_table, threshold
from tests.naive import rng

Symbol = tuple[int, bool, int]
NO_OTHERS = []


def wire_bits(data):
    """8N1, least significant bit first."""
    return [bit for byte in data for bit in (0, *(byte >> i & 1 for i in range(8)), 1)]


@cache
def chain_states(params, seed, name, slots):
    """Bad or good in slots 0 .. slots-1, by the book: step by step from a good start."""
    bad, states = False, []
    enter, leave = params.chances()
    for slot in range(slots):
        draw = rng.u32(seed, name, slot)
        bad = draw < 2**32 - leave if bad else draw < enter
        states.append(bad)
    return states


def chain_bad(params, seed, name, slot):
    return params is not None and chain_states(params, seed, name, slot - slot % 256 + 256)[slot]


class OnAir(NamedTuple):
    """What a sender has on the air: `bit` is the number of a data bit, or None for the idle carrier.

    `back`: a bad stop bit has gone back to mark.
    """

    level: int
    begin: int
    bit: int | None = None
    arrival: int = 0
    back: bool = False


class Sender:
    """Everything that a transmitter ever sends, as it arrives at robots with the crystal of `listener`."""

    def __init__(self, params, listener, seed, name, sent):
        self.params = params
        own = Fraction(2500 * (10**6 + params.crystal_offset_ppm), 10**6 + params.baud_offset_ppm)
        self.bit_ticks = Fraction(
            2500 * (10**6 + listener.crystal_offset_ppm), 10**6 + params.baud_offset_ppm
        )
        # arrival, bits, ticks at which they begin, and for bad stop bits the tick at which they go back to mark
        self.arrivals = []
        over = 0
        for start, data, *bad_stop in sent:
            late = rng.u32(seed, f"{name}/jitter", start // 2500) * (ticks(params.jitter_s) + 1) // 2**32
            arrival = max(start + params.latency_ticks + late, over)
            bits = wire_bits(data)
            begins = [arrival + int(number * self.bit_ticks) for number in range(len(bits) + 1)]
            backs = {}
            for place in bad_stop[0] if bad_stop else ():
                number = 10 * place + 9
                bits[number] = 0
                backs[number] = arrival + int((number + Fraction(3, 4)) * self.bit_ticks)
            if rng.u32(seed, f"{name}/lost_frames", start // 2500) >= threshold(params.lost_frames):
                self.arrivals.append((arrival, bits, begins, backs))
            over = arrival + max(25_000 * len(data), int(10 * len(data) * own))

    def on_air(self, tick):
        for arrival, bits, begins, backs in self.arrivals:
            if begins[0] <= tick < begins[-1]:
                number = bisect_right(begins, tick) - 1
                if tick >= backs.get(number, tick + 1):
                    return OnAir(1, begins[number], number, arrival, True)
                return OnAir(bits[number], begins[number], number, arrival)
        keyed = any(0 < arrival - tick <= self.params.keyup_ticks for arrival, *_ in self.arrivals)
        return OnAir(1, tick - tick % 2500) if keyed or self.params.carrier == "on" else None

    def event_ticks(self):
        ticks = set()
        for arrival, _, begins, backs in self.arrivals:
            ticks |= {arrival - self.params.keyup_ticks, *begins, *backs.values()}
        return ticks


class Slicer:
    """Its threshold as the mean of what came in, in steps of at most a bit time."""

    def __init__(self, params, eb_n0_db):
        self.params = params
        self.thresholds = () if eb_n0_db is None else margin_table(eb_n0_db)
        self.mean = self.signal = self.tick = 0

    def hear(self, tick, signal):
        if self.params is None:
            return
        target = self.signal * 65536 + self.params.offset_units if self.signal else 0
        for step in [2500] * ((tick - self.tick) // 2500) + [(tick - self.tick) % 2500]:
            self.mean += ((target - self.mean) * (self.params.gain * step // 2500)) // 65536
        self.tick, self.signal = tick, signal

    def chance(self, level):
        assert self.params is not None
        margin = 65536 - (2 * level - 1) * (self.mean - self.params.offset_units)
        return self.thresholds[min(max((margin + 65536) // 512, 0), 512)]


def downlink_edges(until, params, seed, name, robot, sent, others=NO_OTHERS):
    """Every change of the level on a robot's RXD wire before `until`, the wire being at mark before tick 0."""
    senders = [Sender(params, params, seed, name, sent)]
    senders += [Sender(its, params, seed, its_name, its_sent) for its, its_name, its_sent in others]
    ticks = set(range(0, until, 2500)).union(*(sender.event_ticks() for sender in senders))
    slicer = Slicer(params.slicer, params.eb_n0_db)
    decided = {}
    levels = {}
    for tick in sorted(tick for tick in ticks if 0 <= tick < until):
        rank, on_air = next(
            ((rank, found) for rank, sender in enumerate(senders) if (found := sender.on_air(tick))),
            (-1, None),
        )
        key = (
            rank,
            None if on_air is None else on_air._replace(level=0, back=False),
            tick // 2500 if on_air is None else 0,
        )
        if key not in decided:
            decided[key] = decide(tick, rank, on_air, senders, params, slicer, seed, robot)
        levels[tick] = 1 if on_air is not None and on_air.back else decided[key]
    return changes(levels.__getitem__, levels)


def decide(tick, rank, on_air, senders, params, slicer, seed, robot):
    """What a receiver puts out from `tick` on for a bit, or for a slot of idle carrier or of none."""

    def silence(tick, slot):
        if slicer.signal:
            slicer.hear(tick, 0)
        return 1 if params.squelch else rng.bit(seed, f"{robot}/noise", slot)

    if on_air is None:
        return silence(tick, tick // 2500)
    slot, level = on_air.begin // 2500, on_air.level
    lost = False
    if on_air.bit is not None:
        number = (on_air.arrival - senders[rank].params.latency_ticks) // 2500 + on_air.bit
        character = number - on_air.bit % 10
        lost = rng.u32(seed, f"{robot}/lost", character) < threshold(params.lost_character_rate)
    if chain_bad(params.dropouts, seed, f"{robot}/dropouts", slot):
        level = silence(tick if on_air.bit is None else on_air.begin, slot)
        return 1 if lost else level
    rivals = [found for sender in senders[rank + 1 :] if (found := sender.on_air(on_air.begin))]
    if any(rival.level != level for rival in rivals):
        level = rng.bit(seed, f"{robot}/collision", slot)
    if tick == on_air.begin or (on_air.bit is None and slicer.signal != 2 * level - 1):
        slicer.hear(tick, 2 * level - 1)
    bad = chain_bad(params.bursts, seed, f"{robot}/bursts", slot)
    if on_air.bit is None:
        chance = params.false_start_threshold + (slicer.chance(level) if params.slicer else 0)
        chance = params.burst_threshold if bad else chance
        return level ^ (rng.u32(seed, f"{robot}/idle", slot) < chance)
    chance = slicer.chance(level) if params.slicer else params.error_threshold
    chance = params.burst_threshold if bad else chance
    level ^= rng.u32(seed, f"{robot}/errors", number) < chance
    return 1 if lost else level


def uplink_level(tick, params, seed, name, wires):
    """The level at the PC's receiver; `wires` are the TXD edges of robots 0, 1, .."""
    u = tick - params.latency_ticks
    levels = []
    threshold = params.error_threshold
    for robot, edges in enumerate(wires):
        past = [edge for edge in edges if edge[0] <= u]
        on_air = past and u < past[-1][0] + 50_000
        if on_air and not chain_bad(params.dropouts, seed, f"{name}/robot{robot}/dropouts", u // 2500):
            levels.append(past[-1][1])
            if chain_bad(params.bursts, seed, f"{name}/robot{robot}/bursts", u // 2500):
                threshold = params.burst_threshold
    if not levels:
        return 1
    wrong = rng.u32(seed, f"{name}/errors", u // 2500) < threshold
    return min(levels) ^ wrong


def uplink_edges(until, params, seed, name, wires):
    """Every change of the level before `until`."""
    latency = params.latency_ticks
    ticks = {slot + latency for slot in range(0, until, 2500)}
    for tick in (edge[0] for edges in wires for edge in edges):
        ticks |= {tick + latency, tick + latency + 50_000}
    return changes(
        lambda tick: uplink_level(tick, params, seed, name, wires), (t for t in ticks if 0 <= t < until)
    )


def changes(level, ticks):
    edges = [(-1, 1)]
    for tick in sorted(ticks):
        if level(tick) != edges[-1][1]:
            edges.append((tick, 1 - edges[-1][1]))
    return edges[1:]


def level_at(edges, tick):
    return ([1] + [level for edge, level in edges if edge <= tick])[-1]


def receive(edges, until, bit_ticks=Fraction(2500)):
    """What a UART makes of a level: every symbol whose stop bit is sampled before `until`."""
    symbols = []
    free = 0
    for start, level in edges:
        if level == 1 or start < free:
            continue
        samples = [start + int((i + Fraction(1, 2)) * bit_ticks) for i in range(10)]
        if samples[0] < until and level_at(edges, samples[0]) == 1:
            free = samples[0] + 1
            continue
        if samples[9] >= until:
            break
        bits = [level_at(edges, tick) for tick in samples]
        symbols.append((sum(bit << i for i, bit in enumerate(bits[1:9])), bits[9] == 1, start))
        free = samples[9] + 1
    return symbols
