"""The band up: the PC's UART on the mix of the robots' wires."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_robot.mcs51.line import Line
from miro_sim.radio.uplink import Uplink
from tests.naive import radio as naive
from tests.sim.radio.radios import clean, cuts, params, seeds, transmissions
from tests.states import restore, snapshot

UNTIL = 1_500_000
CLEAN = clean()


def txd(sent, bit_ticks=2496):
    """A robot's TXD wire with the transmissions on it, and its edges."""
    line = Line()
    for start, data in sent:
        for number, level in enumerate(naive.wire_bits(data)):
            line.append(start + number * bit_ticks, level)
    line.settled_tick = 1 << 40
    return line, line.edges()


def band(radio, seed, wires):
    uplink = Uplink(radio, seed, "net")
    for robot, sent in enumerate(wires):
        uplink.band.add(robot, txd(sent)[0])
    return uplink


def bytes_of(symbols):
    assert all(stop_good for _, stop_good, _ in symbols)
    return bytes(byte for byte, _, _ in symbols)


networks = st.lists(transmissions(), min_size=1, max_size=3)


@pytest.mark.slow
@settings(max_examples=60)
@given(params, seeds, networks)
def test_symbols_are_those_of_a_naive_uart_on_a_naively_mixed_level(radio, seed, wires):
    edges = naive.uplink_edges(UNTIL, radio, seed, "net", [txd(sent)[1] for sent in wires])
    assert band(radio, seed, wires).receive(UNTIL) == naive.receive(edges, UNTIL, radio.bit_ticks)


@given(params, seeds, networks, cuts(UNTIL))
def test_symbols_and_snapshots_do_not_depend_on_how_receiving_is_cut(radio, seed, wires, ticks):
    whole, cut = band(radio, seed, wires), band(radio, seed, wires)
    symbols = [symbol for tick in ticks for symbol in cut.receive(tick)]
    assert symbols == whole.receive(UNTIL)
    assert snapshot(cut) == snapshot(whole)


@pytest.mark.slow
@given(params, seeds, networks, st.integers(1, UNTIL))
def test_a_snapshot_at_any_tick_carries_the_half_received_character(radio, seed, wires, tick):
    first = Uplink(radio, seed, "net")
    second = Uplink(radio, seed, "net")
    lines = [txd(sent)[0] for sent in wires]
    for robot, line in enumerate(lines):
        first.band.add(robot, line)
    first.receive(tick)
    for robot, line in enumerate(lines):
        copy = Line()
        restore(copy, snapshot(line))
        second.band.add(robot, copy)
    restore(second, snapshot(first))
    assert second.receive(UNTIL) == first.receive(UNTIL)
    assert snapshot(second) == snapshot(first)


def test_a_snapshot_does_not_fit_a_network_of_another_size():
    with pytest.raises(ValueError, match="bytes"):
        restore(band(CLEAN, 0, [[]]), snapshot(band(CLEAN, 0, [[], []])))


@given(transmissions(), st.sampled_from([2440, 2496, 2500, 2550]))
def test_without_errors_every_byte_arrives_at_any_clock_within_two_percent(sent, bit_ticks):
    spaced = [(start + index * 20_000, data) for index, (start, data) in enumerate(sent)]
    uplink = Uplink(CLEAN, 0, "net")
    uplink.band.add(0, txd(spaced, bit_ticks)[0])
    assert bytes_of(uplink.receive(2 * UNTIL)) == b"".join(data for _, data in sent)


def test_a_symbol_carries_the_tick_of_its_start_edge_at_the_pc():
    uplink = band(clean(latency_ticks=700), 0, [[(10_000, b"\x00\xff")]])
    assert uplink.receive(UNTIL) == [(0x00, True, 10_700), (0xFF, True, 10_700 + 24_960)]


def test_two_robots_at_once_are_mixed_and_space_wins():
    uplink = band(CLEAN, 0, [[(10_000, b"\x0f")], [(10_000, b"\x3c")]])
    assert uplink.receive(UNTIL) == [(0x0F & 0x3C, True, 10_000)]


def test_a_symbol_is_known_at_the_middle_of_its_stop_bit():
    uplink = band(CLEAN, 0, [[(10_000, b"A")]])
    assert uplink.receive(10_000 + 1250 + 9 * 2500) == []
    assert uplink.receive(10_000 + 1250 + 9 * 2500 + 1) == [(ord("A"), True, 10_000)]


def test_nothing_is_received_from_a_wire_that_is_not_settled_yet():
    line, _ = txd([(10_000, b"A")])
    line.settled_tick = 30_000
    uplink = Uplink(CLEAN, 0, "net")
    uplink.band.add(0, line)
    assert uplink.receive(UNTIL) == []
    assert uplink.now == 30_000
    line.settled_tick = UNTIL
    assert uplink.receive(UNTIL) == [(ord("A"), True, 10_000)]


@pytest.mark.parametrize(
    ("edges", "symbols"),
    [
        ([(10_000, 0), (40_000, 1), (50_000, 0), (52_496, 1)], [(0, False, 10_000), (0xFF, True, 50_000)]),
        ([(10_000, 0), (11_249, 1)], []),
        ([(10_000, 0)], [(0, False, 10_000)]),
    ],
    ids=["a missing stop bit", "a pulse of half a bit", "a wire stuck at space"],
)
def test_the_next_falling_edge_that_lasts_starts_a_character(edges, symbols):
    line = Line()
    for tick, level in edges:
        line.append(tick, level)
    line.settled_tick = UNTIL
    uplink = Uplink(CLEAN, 0, "net")
    uplink.band.add(0, line)
    assert uplink.receive(UNTIL) == symbols


def test_the_bit_error_rate_of_the_samples_is_the_one_asked_for():
    uplink = Uplink(clean(bit_error_rate=1e-2), 3, "net")
    line = Line()
    uplink.band.add(0, line)
    received = 0
    for start in range(0, 400 * 700_000, 700_000):
        for number, level in enumerate(naive.wire_bits(bytes(range(25)))):
            line.append(start + number * 2496, level)
        line.settled_tick = start + 700_000
        received += len(uplink.receive(start + 700_000))
    assert abs(uplink.bit_errors / (10 * received) - 1e-2) < 1.5e-3
    assert len(line.edges()) < 10


def test_an_uplink_shows_where_it_is():
    uplink = band(CLEAN, 0, [[(10_000, b"A")]])
    uplink.receive(20_000)
    assert repr(uplink) == "Uplink('net', now=20000, start_tick=10000, bit=4)"
