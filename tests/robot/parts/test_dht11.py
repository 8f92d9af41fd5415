"""What a DHT11 and a DHT22 answer, and when."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.parts.dht11 import Dht11, Dht22
from tests.example_count import examples
from tests.robot.parts.wires import MS, US, Wires

SECOND = 1000 * MS


def sensor(keys=Dht11, begun=True):
    wire = Wires(keys(), {"data": "data"}, ["data"])
    if begun:
        wire.later(SECOND)
    return wire


def ask(wire, ms=None):
    """The answer's edges, in us after the wire was let go: (us, level)."""
    wire.set(data=0)
    wire.later(int((ms or (20 if wire.named["chip"].keys.name == "dht11" else 1)) * MS))
    wire.set(data=None)
    begin, seen = wire.tick, len(wire.edges_of("data"))
    wire.later(10 * MS)
    return [((tick - begin) / US, level) for tick, level in wire.edges_of("data")[seen:]]


def bits_of(edges):
    """As a program finds them: by the length of the highs."""
    rises = [us for us, level in edges if level][1:-1]
    falls = [us for us, level in edges if not level][2:]
    return "".join("1" if fall - rise > 48 else "0" for rise, fall in zip(rises, falls, strict=True))


def answer(wire):
    """The five bytes of the second of two answers: what it is like now."""
    ask(wire)
    wire.later(2 * SECOND)
    bits = bits_of(ask(wire))
    wire.later(2 * SECOND)
    assert len(bits) == 40
    return [int(bits[first : first + 8], 2) for first in range(0, 40, 8)]


def test_it_answers_30_us_after_the_start_signal_with_40_bits_of_two_lengths():
    edges = ask(sensor())
    assert edges[:4] == [(30, 0), (110, 1), (190, 0), (240, 1)]
    lengths = {round(fall - rise) for (rise, _), (fall, _) in zip(edges[3:-1:2], edges[4::2], strict=True)}
    assert lengths == {26, 70}
    assert {round(rise - fall) for (fall, _), (rise, _) in zip(edges[2::2], edges[3::2], strict=True)} == {50}
    assert (len(edges), edges[-1][1]) == (84, 1)


@pytest.mark.parametrize(("keys", "least_ms"), [(Dht11, 18), (Dht22, 0.8)])
def test_a_start_signal_that_is_too_short_asks_nothing(keys, least_ms):
    wire = sensor(keys)
    assert ask(wire, least_ms - 0.01) == []
    assert wire.value("refused") == 0
    assert len(ask(wire, least_ms)) == 84


@pytest.mark.parametrize(
    ("keys", "celsius", "percent", "values"),
    [
        (Dht11, 23.4, 53.5, [54, 0, 23, 0, 77]),
        (Dht11, 0.0, 90.0, [90, 0, 0, 0, 90]),
        (Dht22, 35.1, 65.2, [0x02, 0x8C, 0x01, 0x5F, 0xEE]),
        (Dht22, -10.1, 65.2, [0x02, 0x8C, 0x80, 0x65, 0x73]),
        (Dht22, -0.04, 100.0, [0x03, 0xE8, 0x00, 0x00, 0xEB]),
    ],
)
def test_it_sends_humidity_degrees_and_their_sum(keys, celsius, percent, values):
    wire = sensor(keys)
    wire.put("chip.temperature_c", celsius)
    wire.put("chip.humidity_percent", percent)
    assert answer(wire) == values


def test_what_it_sends_was_measured_after_the_answer_before():
    wire = sensor(begun=False)
    wire.put("chip.temperature_c", 30.0)
    wire.later(SECOND + 1)  # it measures for the first time
    wire.put("chip.temperature_c", 40.0)
    seen = []
    for _ in range(3):
        seen.append(int(bits_of(ask(wire))[16:24], 2))
        wire.later(SECOND)
    assert seen == [30, 40, 40]


@pytest.mark.parametrize(("keys", "seconds"), [(Dht11, 1), (Dht22, 2)])
def test_it_refuses_to_be_asked_too_soon(keys, seconds):
    wire = sensor(keys, begun=False)
    assert ask(wire) == []
    wire.later(SECOND)
    assert len(ask(wire)) == 84
    begun = wire.tick - 10 * MS
    wire.run(begun + seconds * SECOND - 30 * MS)
    assert ask(wire) == []
    wire.run(begun + seconds * SECOND)
    assert len(ask(wire)) == 84
    assert (wire.value("answers"), wire.value("refused")) == (2, 2)


def test_one_that_is_broken_is_missed_or_sends_a_wrong_sum():
    wire = sensor()
    wire.put("chip.broken", "sum")
    assert len(ask(wire)) == 84  # at once
    wire.later(SECOND)
    *values, check = answer(wire)
    assert check == sum(values) ^ 0xFF
    wire.put("chip.broken", "missing")
    assert ask(wire) == []
    wire.put("chip.broken", "none")
    wire.later(SECOND)
    *values, check = answer(wire)
    assert (sum(values), wire.value("broken")) == (check, "none")


def test_it_begins_anew_with_its_supply():
    wire = sensor()
    wire.set(data=0)
    wire.later(20 * MS)
    wire.set(data=None)
    wire.later(100 * US)
    wire.power(0)
    assert wire.level("data") == 1
    wire.power(1)
    assert ask(wire) == []
    seen = len(wire.edges_of("data"))
    wire.later(SECOND)
    assert len(wire.edges_of("data")) == seen
    assert len(ask(wire)) == 84


@given(st.floats(-40, 80), st.floats(0, 100))
@examples(20)
def test_a_dht22_tells_tenths_that_a_program_gets_back(celsius, percent):
    wire = sensor(Dht22)
    wire.put("chip.temperature_c", celsius)
    wire.put("chip.humidity_percent", percent)
    high, low, sign, degrees, check = answer(wire)
    assert (high + low + sign + degrees) & 0xFF == check
    tenths = ((sign & 0x7F) << 8 | degrees) * (-1 if sign & 0x80 else 1)
    assert abs(tenths - 10 * celsius) <= 0.5 + 1e-9
    assert abs((high << 8 | low) - 10 * percent) <= 0.5 + 1e-9


def level_at(us, edges):
    """The level of the wire that these edges of the sensor make, which begins high."""
    return [1, *(level for at, level in edges if at <= us)][-1]


@given(st.integers(0, 255), st.integers(0, 255))
@examples(10)
def test_a_program_that_looks_40_us_into_each_high_reads_the_same_as_one_that_measures_it(one, other):
    wire = sensor()
    wire.put("chip.temperature_c", one % 51)
    wire.put("chip.humidity_percent", 20 + other % 71)
    ask(wire)
    wire.later(SECOND)
    edges = ask(wire)
    rises = [us for us, level in edges if level][1:-1]
    assert "".join(str(level_at(rise + 40, edges)) for rise in rises) == bits_of(edges)
