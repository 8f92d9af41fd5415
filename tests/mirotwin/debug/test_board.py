"""Parts and nets of a board in the debugger: printed, waited for, and as they were where it goes back."""

import re

import pytest

from miro_exact.bad_input import BadInput
from miro_protocol.actions import Put
from miro_robot.image.debug_info import Sources
from miro_robot.image.symbol_files import Symbol
from mirotwin.debug.board_values import names_on
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.session import Session
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.debug.verbs import do
from mirotwin.runs.inspected_run import InspectedRun
from tests.mirotwin.boards import CRYSTAL_HZ, world_of

PRESSED_TICK = CRYSTAL_HZ // 4 + 7


@pytest.fixture
def session():
    script = (Put(PRESSED_TICK, 0, 0, "key.pressed", True),)
    run = InspectedRun(world_of(script, duration_ticks=CRYSTAL_HZ))
    return Session(Debugger(Timeline(run), Symbols(run.image, Sources([]), names_on(run.device.board))))


def said(session, line):
    do(session, line)
    return "\n".join(session.lines)


def test_values_of_parts_nets_and_pins_are_printed(session):
    said(session, "goto 500ms")
    assert said(session, "print lamp.on") == "lamp.on = 1"
    assert said(session, "print KEY") == "KEY = 0   (driven by key.pin)"
    assert said(session, "print P3.2") == "P3.2 = 1   (the latch; on the pins is 0xfb)"
    assert said(session, "print pins.P3.2") == "pins.P3.2 = 0"
    assert said(session, "print nets.P1.0") == "nets.P1.0 = 0   (driven by P1.0)"
    assert said(session, "print parts").split("\n") == [
        "parts.key.pressed = 1",
        "parts.key.closed = 1",
        "parts.lamp.on = 1",
        "parts.lamp.flashes = 1",
    ]


def test_until_stops_before_the_first_instruction_at_which_it_is_true_and_going_back_takes_the_parts_along(
    session,
):
    assert "lamp.on == 1 is true" in said(session, "until lamp.on == 1")
    tick = session.timeline.tick
    assert PRESSED_TICK < tick < PRESSED_TICK + 12 * 12
    do(session, "stepi")
    do(session, "rstepi")
    assert session.timeline.tick == tick
    do(session, "rstepi")
    assert said(session, "print lamp.on") == "lamp.on = 0"
    assert said(session, "print key.pressed") == "key.pressed = 1"
    do(session, "goto 1ms")
    assert said(session, "print key.pressed") == "key.pressed = 0"
    assert "lamp.on is true" in said(session, "until lamp.on")
    assert session.timeline.tick == tick
    assert "lamp.on is true here" in said(session, "until lamp.on")
    assert "lamp.flashes > 1 is not true before the end" in said(session, "until lamp.flashes > 1")


def test_an_event_is_told_without_the_place_which_a_board_alone_does_not_have(session):
    assert re.search(r"  tick \d+: edge P1\.0 to 0: 0x", said(session, "until edge pin=P1.0 level=0"))


@pytest.mark.parametrize("word", ["1", "1.0", "true", "0x1"])
def test_an_event_of_a_value_takes_numbers_and_truths(session, word):
    assert "value lamp.on = 1" in said(session, f"until value of=lamp.on equals={word}")


@pytest.fixture
def session_of_namesakes(monkeypatch):
    """A program with a function `lamp` and a variable `key`."""
    run = InspectedRun(world_of((Put(PRESSED_TICK, 0, 0, "key.pressed", True),), duration_ticks=CRYSTAL_HZ))
    symbols = Symbols(run.image, Sources([]), names_on(run.device.board))
    names = {"lamp": Symbol(0x0D, "code"), "key": Symbol(0x30, "iram")}
    monkeypatch.setattr(run.image.symbols, "find", names.get)
    return Session(Debugger(Timeline(run), symbols))


def test_a_part_is_found_by_its_values_where_the_program_has_its_name(session_of_namesakes):
    session = session_of_namesakes
    assert said(session, "print lamp").startswith("lamp = 13")
    assert "lamp.on == 1 is true" in said(session, "until lamp.on == 1")
    assert said(session, "print key.pressed") == "key.pressed = 1"
    with pytest.raises(BadInput, match="key has no member on"):
        do(session, "print key.on")


def test_a_breakpoint_may_ask_for_parts(session):
    do(session, "break 0x0d if lamp.on && key.pressed")
    assert "breakpoint 1" in said(session, "continue")
    assert session.timeline.tick > PRESSED_TICK


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("print lamp.off", "lamp has no member off; it has on, flashes"),
        ("print lamq.on", "there is no lamq here; did you mean lamp?"),
        ("until lamq.on", "there is no lamq; did you mean lamp?"),
        ("until lamq", "is no condition and no name"),
        ('until lamp.on == "yes"', "compares a text and a number"),
    ],
)
def test_what_no_part_has_is_said_with_what_it_has(session, line, why):
    with pytest.raises(BadInput) as error:
        do(session, line)
    assert why in str(error.value).replace("\n", " ")
