"""The radio's two bands as functions of time, one tick at a time, and a UART that reads such a function.

Written from the definitions in `miro_sim.radio`; draws come from the naive streams. Everything is evaluated
from the beginning at every call.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from miro_sim.radio import RadioParams

from tests.naive import rng

Sent = list[tuple[int, bytes]]  # (tick of the first start bit at the transmitter, bytes)
Edges = list[tuple[int, int]]  # (tick, level)
Symbol = tuple[int, bool, int]


def wire_bits(data: bytes) -> list[int]:
    """8N1, least significant bit first."""
    return [bit for byte in data for bit in (0, *(byte >> i & 1 for i in range(8)), 1)]


def downlink_bit(tick: int, params: RadioParams, sent: Sent) -> tuple[int, int] | None:
    """(level as sent, tick at the transmitter at which the bit began), or None between transmissions."""
    for start, data in sent:
        number = (tick - params.latency_ticks - start) // 2500
        if 0 <= number < 10 * len(data):
            return wire_bits(data)[number], start + 2500 * number
    return None


def downlink_level(tick: int, params: RadioParams, seed: int, name: str, sent: Sent) -> int:
    """The level on the RXD wire of the robot called `name`."""
    bit = downlink_bit(tick, params, sent)
    if bit is not None:
        level, began = bit
        wrong = rng.u32(seed, f"{name}/errors", began // 2500) < params.error_threshold
        return level ^ wrong
    u = tick - params.latency_ticks
    keyed = any(start - params.keyup_ticks <= u < start for start, _ in sent)
    if keyed or params.carrier == "on" or params.squelch:
        return 1
    return rng.bit(seed, f"{name}/noise", tick // 2500)


def downlink_edges(until: int, params: RadioParams, seed: int, name: str, sent: Sent) -> Edges:
    """Every change of the level before `until`, the wire being at mark before tick 0."""
    ticks = set(range(0, until, 2500))
    for start, data in sent:
        begin = start + params.latency_ticks
        ticks |= {begin - params.keyup_ticks} | {begin + 2500 * i for i in range(10 * len(data) + 1)}
    return changes(
        lambda tick: downlink_level(tick, params, seed, name, sent), (t for t in ticks if 0 <= t < until)
    )


def uplink_level(tick: int, params: RadioParams, seed: int, name: str, wires: list[Edges]) -> int:
    """The level at the PC's receiver; `wires` are the TXD edges of each robot."""
    u = tick - params.latency_ticks
    levels = []
    for edges in wires:
        past = [edge for edge in edges if edge[0] <= u]
        if past and u < past[-1][0] + 50_000:
            levels.append(past[-1][1])
    if not levels:
        return 1
    wrong = rng.u32(seed, f"{name}/errors", u // 2500) < params.error_threshold
    return min(levels) ^ wrong


def uplink_edges(until: int, params: RadioParams, seed: int, name: str, wires: list[Edges]) -> Edges:
    """Every change of the level before `until`."""
    latency = params.latency_ticks
    ticks = {slot + latency for slot in range(0, until, 2500)}
    for tick in (edge[0] for edges in wires for edge in edges):
        ticks |= {tick + latency, tick + latency + 50_000}
    return changes(
        lambda tick: uplink_level(tick, params, seed, name, wires), (t for t in ticks if 0 <= t < until)
    )


def changes(level: Callable[[int], int], ticks: Iterable[int]) -> Edges:
    edges = [(-1, 1)]
    for tick in sorted(ticks):
        if level(tick) != edges[-1][1]:
            edges.append((tick, 1 - edges[-1][1]))
    return edges[1:]


def level_at(edges: Edges, tick: int) -> int:
    return ([1] + [level for edge, level in edges if edge <= tick])[-1]


def receive(edges: Edges, until: int, bit_ticks: int = 2500) -> list[Symbol]:
    """What a UART makes of a level: every symbol whose stop bit is sampled before `until`."""
    symbols = []
    free = 0
    for start, level in edges:
        if level == 1 or start < free:
            continue
        samples = [start + bit_ticks // 2 + bit_ticks * i for i in range(10)]
        if samples[0] < until and level_at(edges, samples[0]) == 1:
            free = samples[0] + 1
            continue
        if samples[9] >= until:
            break
        bits = [level_at(edges, tick) for tick in samples]
        symbols.append((sum(bit << i for i, bit in enumerate(bits[1:9])), bits[9] == 1, start))
        free = samples[9] + 1
    return symbols
