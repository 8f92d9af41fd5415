"""Waits on the pins, the values and the text of a board, against all that its nets did."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import ms
from miro_protocol.actions import Put
from miro_robot.parts.nets import Observer
from miro_sim.world import conditions as wait
from miro_sim.world.waits import WaitExpired
from tests import children
from tests.sim.world.board_rig import BLINKS, CRYSTAL_HZ, HELLO, TABLE, board_world

END = 400_000
GRID = CRYSTAL_HZ // 1000
PIN_WAITS = {
    "edge": wait.Edge(pin="BLINK"),
    "rise": wait.Edge(pin="P1.3", level=1),
    "a port's own pin": wait.Edge(pin="P2.0", level=0),
    "level": wait.Level(pin="lamp.pin", level=0, steady_ms=0.2),
    "pulse": wait.Pulse(pin="BLINK", level=0),
    "frequency": wait.Frequency(pin="BLINK", at_least_hz=1000),
    "duty": wait.Duty(pin="BLINK", at_most=0.7),
}


def put(world, path, value, at_tick=None):
    return world.do(Put(at_tick or world.earliest_action_tick, 0, 0, path, value))


def all_events(world, condition, until_tick):
    found = []
    while True:
        try:
            found.append(world.run_until(condition, within=until_tick - world.tick))
        except WaitExpired:
            return found


def observed(pin, until_tick):
    """All edges of a pin, by an observer of its net."""
    world = board_world()
    nets = world.lines[0].board.nets
    observer = Observer([nets.number(pin)])
    nets.observe(observer)
    world.run_to(until_tick)
    return [(tick, level) for tick, _, level in observer.take(until_tick)]


@pytest.mark.parametrize("pin", ["BLINK", "P1.3", "lamp.pin", "P2.0", "key.pin"])
def test_waits_one_after_the_other_find_every_edge(pin):
    edges = all_events(board_world(), wait.Edge(pin=pin), END)
    assert [(edge.tick, edge.value) for edge in edges] == observed(pin, END)
    assert edges or pin == "key.pin"


@pytest.mark.parametrize("name", PIN_WAITS)
def test_a_wait_on_a_pin_changes_no_bit_of_the_run(name):
    free, world = board_world(), board_world()
    free.run_to(2 * free.period_ticks)
    for _ in range(3):
        world.run_until(PIN_WAITS[name], within=END)
    assert 0 < world.tick < END
    world.run_to(2 * world.period_ticks)
    assert world.digest == free.digest


def test_a_pin_behind_an_inverter_has_the_level_that_the_part_sees():
    worlds = board_world(), board_world()
    ticks = []
    for world, (pin, level) in zip(worlds, (("P1.4", 1), ("dark.pin", 0)), strict=True):
        put(world, "key.pressed", True, 50_000)
        world.run_to(40_000)
        ticks.append(world.run_until(wait.Edge(pin=pin, level=level), within=END).tick)
    assert ticks[0] == ticks[1] > 50_000


def test_a_pin_on_the_tick_of_the_last_wait_is_there_for_the_next():
    both = "loop:\nXRL P1,#28h\nXRL P2,#1\nMOV R7,#40\nDJNZ R7,$\nSJMP loop"
    world = board_world(both)
    with pytest.raises(WaitExpired):  # once named, a pin is known
        world.run_until(wait.Edge(pin="P1.5", level=0), within=1)
    first = world.run_until(wait.Edge(pin="P1.3", level=0), within=END)
    second = world.run_until(wait.Edge(pin="P1.5", level=0), within=END)
    third = world.run_until(wait.Edge(pin="P1.3"), within=END)
    assert second.tick == first.tick < third.tick


def test_a_value_is_seen_on_the_grid_of_a_millisecond_and_right_after_a_put():
    world = board_world()
    lit = world.run_until(wait.Value(of="lamp.on", equals=1), within=END)
    assert (lit.tick % GRID, lit.measured) == (0, 1)
    tick = put(world, "key.pressed", True)
    pressed = world.run_until(wait.Value(of="key.closed", equals=True), within=END)
    assert pressed.tick == tick == world.tick
    assert str(pressed).endswith("value key.closed = True")
    dark = world.run_until(wait.Value(of="dark.on", equals=0), within=END)
    assert dark.tick == (tick // GRID + 1) * GRID  # the program has followed meanwhile


@settings(max_examples=20)
@given(st.lists(st.integers(1, END), max_size=6))
def test_where_a_value_is_seen_does_not_depend_on_where_the_run_stops(stops):
    world = board_world()
    world.lines[0].devices[0].changes.watch_value("lamp.on", 0)
    for tick in sorted(stops):
        world.run_to(tick)
    world.run_to(END)
    free = board_world()
    free.lines[0].devices[0].changes.watch_value("lamp.on", 0)
    free.run_to(END)
    seen = [one.lines[0].devices[0].changes.values.since(0, END) for one in (world, free)]
    assert seen[0] == seen[1] != []


@pytest.mark.parametrize(
    ("condition", "found"),
    [
        (wait.Pulse(pin="BLINK", at_most_us=3), "BLINK: 31 pulses, the last 542.535 us at "),
        (wait.Frequency(pin="BLINK", at_least_hz=1e5), "BLINK: 30 periods, the last 1152 Hz at "),
        (wait.Duty(pin="BLINK", at_least=0.9), "BLINK: 30 periods, the last 0.625 high at "),
        (wait.Level(pin="BLINK", level=1, steady_ms=9), "BLINK: it is at 0, and at 1 for 0.543 ms at most"),
        (wait.Edge(pin="key.pin"), "key.pin: no edge"),
        (wait.Value(of="key.pressed", equals=1), "key.pressed = false"),
        (wait.Text(text="a"), "nothing was sent"),
    ],
    ids=lambda one: one.what if isinstance(one, wait.Condition) else "",
)
def test_a_wait_in_vain_says_what_was_there_instead(condition, found):
    with pytest.raises(WaitExpired) as caught:
        board_world().run_until(condition, within=300_000)
    assert caught.value.found.startswith(found)


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        (wait.Edge(pin="BLNK"), "pin: 'BLNK' is no pin, net or part's pin of this board; did you mean BLINK"),
        (wait.Level(pin="lamp.pun", level=1), "did you mean lamp.pin"),
        (wait.Pulse(pin="left.hi"), "there are P0.0 to P3.7, BLINK"),
        (wait.Value(of="lamp.no", equals=1), "part 'lamp' .led. has no value 'no'; use on or flashes"),
        (wait.Value(of="lamp.on", contains="1"), "of: lamp.on is no text"),
    ],
)
def test_what_the_board_does_not_have_is_refused_before_anything_moves(condition, message):
    world = board_world()
    with pytest.raises(ValueError, match=message):
        world.run_until(condition, within=100)
    assert world.tick == 0


def test_text_is_what_was_sent_since_the_last_wait():
    world = board_world(HELLO)
    world.run_to(ms(2, CRYSTAL_HZ))
    for value in b"abc":
        world.inject(bytes([value]), at_tick=world.earliest_tick() + ms(6 * (value - 96), CRYSTAL_HZ))
    a = world.run_until(wait.Text(text="a="), within=END)
    assert world.tick in (a.tick, a.tick + 1)
    assert world.run_until(wait.Text(pattern="[a-z]=.?"), within=END).measured == "b="
    world.run_to(world.tick + ms(20, CRYSTAL_HZ))  # waits lose nothing
    c = world.run_until(wait.Text(text="\nc="), within=0)
    assert a.tick < c.tick < world.tick
    with pytest.raises(WaitExpired) as caught:
        world.run_until(wait.Text(text="c="), within=END)
    assert caught.value.found == r"1 character: '\n'"


def test_a_board_without_nets_has_the_same_waits_on_its_port_pins():
    bare = board_world(BLINKS, {"crystal_hz": CRYSTAL_HZ, "nets": {"BLINK": "P1.3"}})
    wired = board_world()
    for condition in (*PIN_WAITS.values(),):
        if condition.pin == "lamp.pin":
            condition = wait.Level(pin="BLINK", level=0, steady_ms=0.2)
        events = [world.run_until(condition, within=END) for world in (bare, wired)]
        assert events[0].tick == events[1].tick
        assert events[0].measured == events[1].measured


def waited():
    """Waits of each kind, one after the other."""
    world = board_world()
    conditions = (*PIN_WAITS.values(), wait.Value(of="lamp.on", equals=0))
    return "\n".join(str(world.run_until(condition, within=END)) for condition in conditions)


def test_both_engines_wait_alike():
    assert children.same_uncompiled(waited)


def test_loading_a_world_forgets_what_was_watched_before():
    world = board_world()
    saved = world.save()
    first = world.run_until(wait.Edge(pin="BLINK"), within=END)
    world.run_to(END)
    world.load(saved)
    assert world.run_until(wait.Edge(pin="BLINK"), within=END) == first
    assert TABLE["nets"]["BLINK"] == "P1.3"


SHORTED = {
    "crystal_hz": CRYSTAL_HZ,
    "pull_downs": ["P1.3"],
    "parts": {"key": {"part": "button", "to": "vcc", "pins": {"pin": "P1.3"}}},
}
"""Pressed, the key shorts the pin that the program holds low."""


@pytest.mark.parametrize("stop_on_fault", [True, False])
def test_a_fault_that_a_put_makes_stops_the_run_on_its_tick(stop_on_fault):
    world = board_world("CLR P1.3\nSJMP $", SHORTED, stop_on_fault=stop_on_fault)
    tick = world.do(Put(50_000, 0, 0, "key.pressed", True))
    world.run_to(100_000)
    (fault,) = world.devices[0].board.faults
    assert tick == 50_000 <= fault.tick < tick + 24, "between two instructions"
    assert world.stopped is stop_on_fault
    assert (world.devices[0].board.cpu.cycles * 12 == fault.tick) is stop_on_fault


def test_a_wait_ends_where_a_put_makes_a_fault():
    world = board_world("CLR P1.3\nSJMP $", SHORTED)
    world.do(Put(50_000, 0, 0, "key.pressed", True))
    with pytest.raises(WaitExpired):
        world.run_until(wait.Level(pin="P1.3", level=1), within=200_000)
    assert world.stopped
    assert world.devices[0].board.cpu.cycles * 12 < 50_024
