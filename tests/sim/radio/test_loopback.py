"""Down and up joined: what is sent is received, whole at no errors, and equally in both engines."""

import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.mcs51.line import Line
from miro_sim.radio.downlink import Downlink
from miro_sim.radio.params import Radio
from miro_sim.radio.uplink import Uplink
from tests import children
from tests.naive import radio as naive
from tests.sim.radio import exercise
from tests.sim.radio.radios import clean
from tests.sim.radio.strategies import seeds, transmissions


def echo(params, seed, sent, until):
    """The symbols that come back when a robot's RXD is wired to its TXD."""
    line = Line()
    down, up = Downlink(params, seed, "down"), Uplink(Radio.ideal(), seed, "up")
    down.listen(0, line)
    up.listen(line)
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


def test_the_measured_bit_error_rate_is_the_one_asked_for():
    params = clean(bit_error_rate=1e-2, carrier="on")
    line = Line()
    downlink = Downlink(params, 21, "down")
    downlink.listen(0, line)
    wrong = total = 0
    for start in range(0, 400 * 625_000, 625_000):
        bits = naive.wire_bits(bytes(i * 73 & 255 for i in range(25)))
        downlink.send(start, bytes(i * 73 & 255 for i in range(25)))
        downlink.settle(start + 625_000)
        wrong += sum(line.level_at(start + 2500 * i + 1250) != bit for i, bit in enumerate(bits))
        total += len(bits)
        line.forget(start + 625_000)
    assert wrong == downlink.listeners[0].bit_errors
    assert abs(wrong - total * 1e-2) < 4 * (total * 1e-2) ** 0.5


@pytest.mark.parametrize("radio", ["PLAIN", "EVERYTHING"])
def test_both_engines_hear_the_same_network(radio):
    script = (
        "from miro_exact import engine; engine.select('python');"
        f"from tests.sim.radio import exercise; print(exercise.exercise(77, exercise.{radio}))"
    )
    root = Path(__file__).parents[3]
    done = children.run([sys.executable, "-c", script], cwd=root, capture_output=True, text=True)
    assert done.stderr == ""
    assert done.stdout.strip() == exercise.exercise(77, getattr(exercise, radio))
