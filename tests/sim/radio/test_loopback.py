"""Down and up joined: what is sent is received, whole at no errors, and busy networks equally in both engines."""

import hashlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.rng import Stream
from miro_robot.mcs51.line import Line
from miro_sim.radio.downlink import Downlink
from miro_sim.radio.params import Bursts, Dropouts, Radio, SlicerParams
from miro_sim.radio.uplink import Uplink
from tests.children import uncompiled
from tests.naive.radio import wire_bits
from tests.sim.radio.radios import clean, seeds, transmissions
from tests.states import snapshot

ROBOTS = 3
PERIOD = 800_800


PLAIN = clean(latency_s=0.0001, bit_error_rate=1e-2)
EVERYTHING = clean(
    latency_s=0.0001,
    jitter_s=0.001,
    eb_n0_db=9.0,
    baud_offset_ppm=777,
    crystal_offset_ppm=-51,
    bursts=Bursts(good_to_bad=1e-3, bad_to_good=1e-2),
    dropouts=Dropouts(every_s=0.3, length_s=0.02),
    slicer=SlicerParams(settle_s=0.004, offset=-0.5),
    false_starts_hz=100.0,
    lost_character_rate=0.02,
    lost_frames=0.1,
)


def exercise(seed, radio):
    """Everything that three robots and their PC hear, with a neighbour on the frequency."""
    down, up = Downlink(radio, seed, "down"), Uplink(radio, seed, "up")
    neighbour = Downlink(EVERYTHING, seed, "neighbour")
    if radio is not PLAIN:
        down.overhear(neighbour)
    rxd, txd = [Line() for _ in range(ROBOTS)], [Line() for _ in range(ROBOTS)]
    for robot in range(ROBOTS):
        down.listen(robot, rxd[robot])
        up.band.add(robot, txd[robot])
    payload = Stream(seed, "payload")
    heard = hashlib.sha256()
    for period in range(15):
        begin = period * PERIOD
        data = bytes(payload.u32(period * 23 + i) & 255 for i in range(23))
        bad_stop = tuple(i for i in range(23) if period % 2 and data[i] % 4 == 0)
        down.send(begin + 96_000, data, bad_stop)
        neighbour.send(begin + 350_000, data[::-1], bad_stop)
        for i, level in enumerate(wire_bits(data[:19])):
            txd[period % ROBOTS].append(begin + 1000 + 2496 * i, level)
        for until in (begin + 123_456, begin + PERIOD):
            down.settle(until)
            for line in txd:
                line.settled_tick = until
            heard.update(repr(up.receive(until)).encode())
        for line in rxd:
            heard.update(repr(line.edges()).encode())
            line.forget(begin + PERIOD)
        heard.update(repr([snapshot(down), snapshot(up)]).encode())
    return heard.hexdigest()


def echo(params, seed, sent, until):
    """The symbols that come back when a robot's RXD is wired to its TXD."""
    line = Line()
    down, up = Downlink(params, seed, "down"), Uplink(Radio(bit_error_rate=0.0), seed, "up")
    down.listen(0, line)
    up.band.add(0, line)
    for start, data in sent:
        down.send(start, data)
    down.settle(until)
    return up.receive(until)


@given(seeds, transmissions(), st.integers(0, 30_000))
def test_a_wire_down_and_up_is_the_identity_on_bytes_and_their_ticks(seed, sent, latency):
    params = clean(squelch=True, latency_ticks=latency)
    expected = [
        (byte, True, start + latency + 25_000 * i) for start, data in sent for i, byte in enumerate(data)
    ]
    assert echo(params, seed, sent, 2_500_000) == expected


@given(seeds, st.binary(min_size=1, max_size=20))
def test_a_character_of_marks_brings_the_uart_into_step_after_noise(seed, data):
    """A start bit of noise may begin just before the carrier; FFh outlasts the character it belongs to."""
    start = 200_000
    sent = [(start, b"\x55\x55\xff" + data)]
    until = start + 25_000 * (3 + len(data))
    symbols = echo(clean(), seed, sent, until)
    assert bytes(byte for byte, _, tick in symbols if tick >= start + 75_000) == data


@pytest.mark.parametrize("radio", ["PLAIN", "EVERYTHING"])
def test_both_engines_hear_the_same_network(radio):
    code = f"from tests.sim.radio import test_loopback as test; print(test.exercise(77, test.{radio}))"
    assert uncompiled(code).strip() == exercise(77, globals()[radio])
