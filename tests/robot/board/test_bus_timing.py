"""The LM629's bus limits: each at its last tick that is too short and its first that is long enough."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_robot.lm629.bus_timing import LIMITS, BusTiming
from tests.naive.lm629_bus_timing import NaiveBusTiming

IDLE = (1, 1, 1, 0, 0xFF)
SELECTED = (0, 1, 1, 0, 0x02)
WRITING = (0, 1, 0, 0, 0x02)
READING = (0, 0, 1, 0, 0x02)


def broken_by(*edges):
    """Names of the limits that a list of edges breaks, from pins at rest."""
    timing = BusTiming()
    timing.rest(0, 0, 0, 0xFF)
    return [LIMITS[limit].name for tick, pins in edges if (limit := timing.pins(tick, *pins))]


def test_the_limits_in_ticks_are_those_of_the_timing_page():
    assert {limit.name: limit.ticks for limit in LIMITS if limit.name} == {
        "read access": 7,  # 180 ns, and the 90 ns by which the CPU samples earlier than its fifth clock
        "/WR pulse": 5,  # 100 ns, and 100 ns by which a /WR of 6 clocks may be shorter
        "write data set-up": 2,  # 50 ns
        "write data hold": 4,  # 120 ns, and 25 ns by which the data may go before the next clock
        "PS set-up": 1,  # 30 ns
        "PS hold": 1,
        "recovery between two accesses": 3,  # 120 ns
        "/RST pulse": 32,  # 8 clocks of 6 MHz
    }


def test_no_limit_reaches_from_one_instruction_into_the_next():
    """Pins move when an instruction ends; in the next one, at the earliest, a MOVX puts out its address at tick 8."""
    assert max(limit.ticks for limit in LIMITS if limit.name != "/RST pulse") < 8


@pytest.mark.parametrize(
    ("name", "enough", "edges"),
    [
        ("/WR pulse", 5, lambda t: [(0, SELECTED), (20, WRITING), (20 + t, SELECTED)]),
        ("write data set-up", 2, lambda t: [(0, (0, 1, 0, 0, 0x55)), (20, WRITING), (20 + t, SELECTED)]),
        ("write data hold", 4, lambda t: [(0, SELECTED), (20, WRITING), (40, SELECTED), (40 + t, IDLE)]),
        ("PS set-up", 1, lambda t: [(0, (0, 1, 1, 1, 2)), (20, SELECTED), (20 + t, WRITING)]),
        ("PS hold", 1, lambda t: [(20, READING), (40, SELECTED), (40 + t, (0, 1, 1, 1, 2))]),
        ("recovery between two accesses", 3, lambda t: [(20, READING), (40, SELECTED), (40 + t, READING)]),
    ],
)
def test_a_limit_is_broken_up_to_its_last_tick_and_not_after(name, enough, edges):
    assert broken_by(*edges(enough)) == []
    assert broken_by(*edges(enough - 1)) == [name]


def test_a_reading_has_to_wait_for_the_access_time():
    timing = BusTiming()
    timing.pins(100, *READING)
    assert LIMITS[timing.sampled(106)].name == "read access"
    assert timing.ticks == 6
    assert timing.sampled(107) == 0
    timing.pins(120, *SELECTED)
    assert timing.sampled(121) == 0  # it drives nothing


def test_a_breach_says_what_the_data_sheets_say():
    assert LIMITS[1].breach(5) == "read access 118 ns, 180 ns needed"
    assert LIMITS[4].breach(1) == "write data hold 17 ns, 120 ns needed"
    assert LIMITS[8].breach(12) == "/RST pulse 500 ns, 1333 ns needed"


LEVEL = st.integers(0, 1)
PINS = st.tuples(LEVEL, LEVEL, LEVEL, LEVEL, st.sampled_from([0x02, 0xFF]))


@settings(max_examples=300)
@given(st.lists(st.tuples(st.integers(0, 12), PINS), max_size=40))
def test_any_edges_break_what_they_break_for_one_who_keeps_them_all(edges):
    ours, theirs, tick = BusTiming(), NaiveBusTiming(), 0
    for pause, pins in edges:
        tick += pause
        broken = theirs.pins(tick, pins)
        found = ours.pins(tick, *pins)
        assert LIMITS[found].name == (broken[0] if broken else "")


def test_pins_that_move_on_one_tick_have_no_time_between_them():
    assert broken_by((20, (0, 1, 0, 1, 0x02))) == ["PS set-up"]  # PS together with /WR
    assert broken_by((20, WRITING), (40, (1, 1, 1, 1, 0x02))) == ["PS hold"]  # MOV P2,#0FFh
    assert broken_by((20, WRITING), (40, (1, 1, 1, 0, 0xFF))) == ["write data hold"]
    assert broken_by((20, READING), (40, WRITING)) == ["recovery between two accesses"]


def test_ps_must_not_move_while_a_strobe_is_low():
    assert broken_by((20, WRITING), (40, (0, 1, 0, 1, 0x02))) == ["PS hold"]


def test_chip_select_makes_a_strobe_as_well_as_rd_and_wr():
    assert broken_by((0, (1, 1, 0, 0, 2)), (20, WRITING), (23, (1, 1, 0, 0, 2))) == ["/WR pulse"]
    assert (
        broken_by((0, (1, 1, 0, 0, 2)), (9, (1, 1, 1, 1, 7)), (10, (1, 0, 1, 0, 5))) == []
    )  # no chip is selected
