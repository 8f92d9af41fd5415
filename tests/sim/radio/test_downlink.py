"""The band down: levels as defined, whatever the chunks, and errors and noise as often as they should be."""

import struct
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import NEVER_TICK, ROBOT_BIT_TICKS
from miro_protocol.transmission import Transmission
from miro_robot.mcs51.line import Line
from miro_sim.radio.downlink import Downlink
from tests.naive import radio as naive
from tests.sim.radio.radios import clean, cuts, flawed, neighbours, params, seeds
from tests.states import restore, snapshot

UNTIL = 1_500_000


def band(radio, seed=0, robots=(0,)):
    downlink = Downlink(radio, seed, "net")
    lines = {robot: Line() for robot in robots}
    for robot, line in lines.items():
        downlink.listen(robot, line)
    return downlink, lines


def shared(radio, seed, others, robots=(0,)):
    """A network with others on its frequency; returns all downlinks, its own first, and its wires."""
    downlink, lines = band(radio, seed, robots)
    links = [downlink]
    for number, (its, _) in enumerate(others):
        links.append(Downlink(its, seed, f"other{number}"))
        downlink.overhear(links[-1])
    return links, lines


def announcements(radio, sent, others):
    """(tick at which the carrier comes up here, link number, start, bytes, bad stops) of all networks, in order."""
    waiting = []
    for number, (its, its_sent) in enumerate([(radio, sent), *others]):
        lead = 0 if its.carrier == "on" else its.keyup_ticks
        waiting += [(one[0] - lead + its.latency_ticks, number, *one) for one in its_sent]
    return sorted(waiting)


@pytest.mark.slow
@settings(max_examples=60)
@given(params, seeds, flawed(), neighbours)
def test_every_robot_hears_what_the_naive_twin_evaluates_from_the_definitions(radio, seed, sent, others):
    links, lines = shared(radio, seed, others, (0, 2))
    for _, link, *one in announcements(radio, sent, others):
        links[link].send(*one)
    links[0].settle(UNTIL)
    heard = [(its, f"other{number}", its_sent) for number, (its, its_sent) in enumerate(others)]
    for robot, line in lines.items():
        assert line.edges() == naive.downlink_edges(
            UNTIL, radio, seed, "net", f"net/robot{robot}", sent, heard
        )
        assert line.settled_tick == UNTIL


@pytest.mark.slow
@settings(max_examples=200)
@given(params, seeds, flawed(), neighbours, cuts(UNTIL), st.data())
def test_edges_errors_and_snapshots_do_not_depend_on_how_settling_is_cut(
    radio, seed, sent, others, ticks, data
):
    (whole, *whole_others), whole_lines = shared(radio, seed, others)
    (cut, *cut_others), cut_lines = shared(radio, seed, others)
    for _, link, *one in announcements(radio, sent, others):
        [whole, *whole_others][link].send(*one)
    whole.settle(UNTIL)
    waiting = announcements(radio, sent, others)
    for tick in ticks:
        while waiting and (waiting[0][0] < tick or data.draw(st.booleans())):
            _, link, *one = waiting.pop(0)
            [cut, *cut_others][link].send(*one)
        cut.settle(tick)
    for _, link, *one in waiting:
        [cut, *cut_others][link].send(*one)
    assert cut_lines[0].edges() == whole_lines[0].edges()
    assert snapshot(cut) == snapshot(whole)


@given(params, seeds, flawed(), neighbours, st.integers(1, UNTIL))
def test_a_snapshot_at_any_tick_carries_the_bytes_in_the_air(radio, seed, sent, others, tick):
    links, first_lines = shared(radio, seed, others)
    for _, link, *one in announcements(radio, sent, others):
        links[link].send(*one)
    first = links[0]
    first.settle(tick)
    (second, *_), second_lines = shared(radio, seed, others)
    restore(second, snapshot(first))
    restore(second_lines[0], snapshot(first_lines[0]))
    for downlink in (first, second):
        downlink.settle(UNTIL)
    assert second_lines[0].edges() == first_lines[0].edges()
    assert snapshot(second) == snapshot(first)


def test_a_snapshot_does_not_fit_a_network_of_another_size():
    with pytest.raises(ValueError, match="bytes"):
        restore(band(clean())[0], snapshot(band(clean(), robots=(0, 1))[0]))


def test_a_keyed_carrier_is_noise_then_mark_then_data_then_noise():
    downlink, lines = band(clean(latency_ticks=100), seed=4)
    downlink.send(100_000, b"\x55")
    downlink.settle(250_000)
    edges = [tick for tick, _ in lines[0].edges()]
    before, after = ([tick for tick in edges if tick < 76_100], [tick for tick in edges if tick > 125_100])
    assert edges[len(before) : -len(after)] == [100_100 + 2500 * i for i in range(10)]
    assert lines[0].level_at(76_100) == 1
    assert all(tick % 2500 == 0 for tick in before + after)
    assert before


def test_latency_moves_the_errors_with_the_bits():
    heard = []
    for latency in (0, 3210):  # more than a bit
        downlink, lines = band(clean(latency_ticks=latency, bit_error_rate=0.05, squelch=True), seed=5)
        downlink.send(50_000, bytes(range(20)))
        downlink.settle(700_000)
        heard.append([(tick - latency, level) for tick, level in lines[0].edges()])
    assert heard[0] == heard[1]


def test_errors_hit_each_robot_on_its_own_and_as_often_as_the_rate_says():
    radio = clean(bit_error_rate=1e-2, carrier="on")
    downlink, lines = band(radio, seed=9, robots=(0, 1, 2))
    for start in range(0, 400 * 25_000 * 25, 25_000 * 25):
        downlink.send(start, bytes(25))
        downlink.settle(start + 25_000 * 25)
        for line in lines.values():
            line.forget(downlink.settled_tick)
    counts = [listener.bit_errors for listener in downlink.listeners.values()]
    assert all(abs(count - 1000) < 4 * 31.5 for count in counts)
    assert len(set(counts)) == 3


def test_a_transmission_must_be_announced_before_its_carrier_comes_up():
    downlink, _ = band(clean(keyup_ticks=1000, latency_ticks=10))
    downlink.settle(50_010)
    with pytest.raises(ValueError, match=r"tick 50999 reaches the robots at tick 50009.*settled up to 50010"):
        downlink.send(50_999, b"x")
    assert downlink.send(51_000, b"x") == 76_000


def test_a_carrier_that_is_always_on_needs_no_announcement_before_the_start_bit():
    downlink, _ = band(clean(carrier="on"))
    downlink.settle(50_000)
    downlink.send(50_000, b"x")
    with pytest.raises(ValueError, match="busy until 75000"):
        downlink.send(74_999, b"y")
    downlink.send(75_000, b"y")


def test_an_empty_transmission_is_refused():
    with pytest.raises(ValueError, match="at least one byte"):
        band(clean())[0].send(100_000, b"")


def test_a_wire_that_was_open_is_settled_by_the_downlink_only():
    line = Line()
    line.settled_tick = NEVER_TICK
    Downlink(clean(), 0, "net").listen(0, line)
    assert line.settled_tick == 0


def test_a_downlink_shows_what_it_is_about_to_send():
    downlink, _ = band(clean())
    downlink.send(100_000, b"\x55\xff")
    assert repr(downlink) == "Downlink('net', robots [0], settled_tick=0, [(100000, '55 ff')])"


def test_a_bad_stop_bit_is_space_for_three_quarters_of_a_bit():
    downlink, lines = band(clean(carrier="on"))
    downlink.send(100_000, b"\xff\xff", (0,))
    downlink.settle(200_000)
    bad = 100_000 + 9 * 2500
    assert lines[0].edges() == [
        *((100_000, 0), (102_500, 1), (bad, 0), (bad + 1875, 1)),
        *((125_000, 0), (127_500, 1)),
    ]


@given(flawed())
def test_a_plain_uart_hears_the_characters_and_which_stop_bits_were_bad(sent):
    downlink, lines = band(clean(carrier="on"))
    for one in sent:
        downlink.send(*one)
    downlink.settle(UNTIL)
    symbols = [symbol for one in sent for symbol in Transmission(one[0], ">", one[1], 0, one[2]).symbols()]
    assert naive.receive(lines[0].edges(), UNTIL, Fraction(ROBOT_BIT_TICKS)) == symbols


@pytest.mark.parametrize("stops", [b"\1", b"\1\0\0"])
def test_stops_of_another_length_are_no_state(stops):
    downlink = band(clean())[0]
    downlink.send(100_000, b"ab", (1,))
    saved = snapshot(downlink)
    sent = struct.pack("<I", 4) + b"ab\0\1"
    assert saved.count(sent) == 1
    with pytest.raises(ValueError, match="stop bits of 2 characters"):
        restore(downlink, saved.replace(sent, struct.pack("<I", 2 + len(stops)) + b"ab" + stops))
    assert snapshot(downlink) == saved
