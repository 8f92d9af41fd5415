"""Waiting in virtual time: a wait ends at the first tick at which something is true, and loses nothing."""

import contextlib
import io

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import LM629_SAMPLE_TICKS, ticks
from miro_robot.inspect.watcher import Watcher, attach
from miro_robot.inspect.waveform import Waveform
from miro_sim.world import conditions as wait
from miro_sim.world.waits import WaitExpired, Waits
from tests.robot.inspect import reading
from tests.sim.world.rig import PERIOD, fig6, two_networks

WAITS = {
    "sent": wait.Sent(),
    "received": wait.Received(),
    "transmitted": wait.Transmitted(),
    "frame": wait.Frame(),
    "command": wait.Command(name="STT", side="right"),
    "symbol": wait.Reached(symbol="motion_team"),
    "edge of rxd": wait.Edge(pin="rxd"),
    "edge of pwm": wait.Edge(pin="left.pwm"),
    "answer": wait.Answer(),
    "heard": wait.Heard(),
    "moving": wait.When(predicate=lambda robot: robot.board.left.real_position > 2),
}


def all_events(world, condition, until_tick):
    """Every event that fulfils the condition, one wait after the other."""
    found = []
    while True:
        try:
            found.append(world.run_until(condition, within=until_tick - world.tick))
        except WaitExpired:
            return found


@pytest.fixture(scope="module")
def uncut():
    world = fig6()
    world.run_to(8 * PERIOD)
    return world.digest


@pytest.mark.parametrize("name", WAITS)
def test_a_wait_changes_no_bit_of_the_run(name, uncut):
    world = fig6()
    for _ in range(3):
        world.run_until(WAITS[name], within=6 * PERIOD)
    assert world.tick < 8 * PERIOD
    world.run_to(8 * PERIOD)
    assert world.digest == uncut


@pytest.mark.parametrize("pin", ["rxd", "txd", "left.pwm", "right.sign", "left.wr", "P1.0", "P0.3"])
def test_consecutive_waits_for_a_pin_find_the_edges_of_the_full_waveform(pin):
    end_tick = 3 * PERIOD
    watched = fig6()
    out = io.StringIO()
    board = watched.robot().board
    waveform = Waveform(out, board).attach(board.cpu)
    watched.run_to(end_tick + 4096)
    waveform.close()
    wire = {"left.pwm": "left_pwm", "right.sign": "right_sign", "left.wr": "left_wr_n"}.get(pin, pin)
    wire = f"p{pin[1]}_{pin[3]}" if pin[0] == "P" else wire
    expected = reading.read(out.getvalue().encode()).wires[wire][1:]
    expected = [change for change in expected if change[0] <= end_tick]
    world = fig6()
    found = [(edge.tick, edge.value) for edge in all_events(world, wait.Edge(pin=pin), end_tick)]
    assert found == expected
    assert expected or pin in ("right.sign", "P1.0")


def test_a_wait_ends_where_the_pin_has_changed_and_not_a_tick_before():
    world = fig6()
    edge = world.run_until(wait.Edge(pin="txd", level=0), within=4 * PERIOD)
    assert world.tick in (edge.tick, edge.tick + 1)
    again = fig6()
    again.run_to(edge.tick - 12)
    assert again.robot().board.cpu.txd.level_at(edge.tick - 1) == 1
    again.run_to(edge.tick + 12)
    assert again.robot().board.cpu.txd.level_at(edge.tick) == 0


def test_a_wait_for_a_symbol_ends_before_its_instruction():
    world = fig6()
    reached = world.run_until(wait.Reached(symbol="main"))
    cpu = world.robot().board.cpu
    assert cpu.pc == reached.address == world.image.symbols.find("main").address
    assert 12 * cpu.cycles == world.tick == reached.tick


def test_the_next_wait_for_the_same_address_ends_at_its_next_execution():
    world = fig6()
    address = world.image.symbols.find("motion_team").address
    counts = [world.run_until(wait.Reached(address=address)).value for _ in range(6)]
    assert counts == sorted(set(counts))


def test_every_command_of_a_run_is_found_one_wait_after_the_other():
    full, world = fig6(), fig6()
    expected = []
    for _ in range(4):
        full.step()
    found = all_events(world, wait.Command(side="left"), 4 * PERIOD)
    assert [event.tick for event in found] == sorted(event.tick for event in found)
    robot = world.robot()
    log = robot.board.log
    expected = [log.event(serial)[:3] for serial in range(log.first, log.end) if log.event(serial)[1] == 2]
    assert [event.tick for event in found] == [tick for tick, _, code in expected if code >> 8 == 0]


def test_what_happens_between_two_waits_is_not_lost():
    world = fig6()
    first = world.run_until(wait.Answer(), within=4 * PERIOD)
    world.run_to(first.tick + 4 * PERIOD)
    second = world.run_until(wait.Answer(), within=1)
    assert first.tick < second.tick < world.tick
    other = fig6()
    other.run_until(wait.Answer())
    assert other.run_until(wait.Answer()).tick == second.tick


def test_one_of_several_conditions_is_enough():
    world = fig6()
    event = world.run_until([wait.Answer(), wait.Command(name="STT")], within=4 * PERIOD)
    assert event.what == "command"


def test_a_predicate_is_asked_at_the_samples_of_the_robot():
    world = fig6()
    asked = []

    def moved(robot):
        asked.append(12 * robot.board.cpu.cycles)
        return robot.board.left.real_position > 2

    event = world.run_until(wait.When(predicate=moved), within=8 * PERIOD)
    assert world.tick == event.tick
    reset = fig6()
    reset.run_to(event.tick)
    assert reset.robot().board.left.real_position > 2
    assert reset.robot().board.left.sample_tick == event.tick + LM629_SAMPLE_TICKS
    before = fig6()
    before.run_to(event.tick - 1)
    assert before.robot().board.left.real_position <= 2


def test_a_predicate_is_asked_after_each_instruction_on_request():
    def deep(robot):
        return robot.board.cpu.sfr(0x81) > 0xA9  # SP, two bytes above where the stack of main begins

    event = fig6().run_until(wait.When(predicate=deep, at="instruction"), within=PERIOD)
    other = fig6()
    board = other.robot().board
    while not deep(other.robot()):
        other.run_to(12 * board.cpu.cycles + 1)
    assert event.tick == 12 * board.cpu.cycles
    assert 0 < event.tick < PERIOD


def test_a_predicate_that_stays_true_for_long_is_found_where_it_began():
    first_cycle = 20_000  # thousands of instructions before the end of the piece: more than the log keeps
    begun = wait.When(predicate=lambda robot: robot.board.cpu.cycles >= first_cycle, at="instruction")
    event = fig6().run_until(begun, within=PERIOD)
    assert 0 <= event.tick - 12 * first_cycle < 4 * 12


def test_a_wait_in_vain_ends_on_the_tick_and_says_what_was_seen():
    world = fig6()
    with pytest.raises(WaitExpired, match=r"tick 100000: 100000 ticks passed without fault") as caught:
        world.run_until(wait.Fault(), within=100_000)
    assert world.tick == 100_000
    assert "sent" in {event.what for event in caught.value.seen}


def test_a_wait_without_end_ends_with_the_run():
    world = two_networks()
    with pytest.raises(WaitExpired, match="the run ended"):
        world.run_until(wait.Fault())
    assert world.finished


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        (wait.Answer(network=2), "network 2 does not exist; there are 2, numbered from 0"),
        (wait.Answer(slot=12), "slot: is out of range; must be <= 4"),
        (wait.Answer(accepted=300), "accepted: is out of range; must be <= 255"),
        (wait.Edge(pin="P4.0"), "pin: 'P4.0' is not a pin; there are rxd, txd"),
        (wait.Received(slot=1), "net0 has no robot in slot 1; there is 0, 2"),
        (wait.Reached(symbol="mian"), "no symbol mian in the code; did you mean main"),
        (wait.Reached(symbol="frames_accepted"), "no symbol frames_accepted in the code"),
    ],
)
def test_a_condition_on_what_is_not_there_is_refused_before_anything_moves(condition, message):
    world = two_networks()
    with pytest.raises(ValueError, match=message):
        world.run_until(condition, within=1000)
    assert world.tick == 0
    assert world.run_until(wait.Sent(), within=100_000).tick == 96_000


@pytest.mark.parametrize(
    ("kind", "fields", "message"),
    [
        (wait.Command, {"name": "SST"}, "name: 'SST' is not an LM629 command; there are RESET, "),
        (wait.Command, {"side": "top"}, "side: 'top' is not a side; give left or right"),
        (wait.Command, {"hex": "0"}, "hex: '0' are not bytes; write pairs of hex digits"),
        (wait.Reached, {"address": 0x10000}, "address: 65536 is not an address; give 0 to 0xffff"),
        (wait.Reached, {}, "reached: takes a symbol or an address"),
        (wait.WheelSpeeds, {}, "wheels: no speed is given; give left_m_s, right_m_s or both"),
    ],
)
def test_what_can_never_be_is_refused_where_it_is_written(kind, fields, message):
    with pytest.raises(ValueError, match=message):
        kind(**fields)


def test_robots_of_several_networks_are_waited_for_apart():
    world = two_networks()
    events = [
        world.run_until(wait.Command(network=network, slot=slot, name="STT"), within=ticks(0.2))
        for network, slot in ((0, 0), (0, 2), (1, 1))
    ]
    assert [(event.network, event.slot) for event in events] == [(0, 0), (0, 2), (1, 1)]
    rest = two_networks()
    rest.run_to(8 * PERIOD)
    world.run_to(8 * PERIOD)
    assert world.digest == rest.digest


@pytest.mark.slow
@settings(max_examples=15)
@given(st.lists(st.tuples(st.sampled_from(sorted(WAITS)), st.integers(0, PERIOD)), max_size=6))
def test_any_mixture_of_waits_and_stops_gives_the_digest_of_the_uncut_run(uncut_end, moves):
    end_tick, digest = uncut_end
    world = two_networks()
    for name, step in moves:
        if world.tick + step > end_tick:
            break
        with contextlib.suppress(WaitExpired):
            world.run_until(WAITS[name], within=min(PERIOD, end_tick - world.tick))
        world.run_to(min(world.tick + step, end_tick))
    world.run_to(end_tick)
    assert world.digest == digest


@pytest.fixture(scope="module")
def uncut_end():
    world = two_networks()
    world.run_to(5 * PERIOD)
    return 5 * PERIOD, world.digest


class Seen(Watcher):
    """How many instructions it was told of."""

    count = 0

    def executed(self, cpu, pc, start):
        self.count += 1


def test_a_watcher_goes_on_where_a_wait_broke_down(monkeypatch):
    """As a part's exception ends it."""
    world, watcher = fig6(), Seen()
    attach(world.devices[0].board.cpu, watcher).once.append(watcher)
    with monkeypatch.context() as patched:
        patched.setattr(Waits, "_end_of_piece", lambda *_: 1 // 0)
        with pytest.raises(ZeroDivisionError):
            world.run_until(wait.Sent(), within=PERIOD)
    assert watcher.count == 0
    world.run_to(world.tick + PERIOD)
    assert watcher.count > 0
