"""A machine that is put back over and over."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from miro_robot.board import Board
from miro_robot.firmware import image_path
from miro_robot.harness.fast_oracle import FastOracle
from miro_robot.harness.harness import AWAKE, DONE, STOPPED, Harness, LiveOracle
from miro_robot.harness.program import BYTES, FRAMES, SESSION, Program
from miro_robot.image import load_hex
from miro_robot.plant import IdealWheels
from miro_robot.probe import Probe
from miro_robot.wiring import load_wiring
from tests.robot.mcs51.asm import image_of
from tests.states import snapshot

BIT_TICKS = 2500
FRAME = b"\x00\x10\x00\x20\x00"
"""Of a session: a team frame with two velocities."""
MS = 24_000


def board_with(image, ticks=40 * MS):
    board = Board(load_wiring(), IdealWheels())
    board.load(image)
    board.cpu.rxd.settled_tick = 2 * ticks
    board.run(ticks)
    return board


def harness_for(board):
    return Harness(board, board.cpu, FastOracle(board, 0, 3), BIT_TICKS, board)


def program(data, how=SESSION):
    read = Program(how)
    read.read(data)
    return read


def edges_of(harness, data, size=8192, ended=DONE):
    """The map of edges after a run."""
    edges = bytearray(size)
    harness.cpu.watch_edges(memoryview(edges))
    assert harness.play(program(data)) == ended
    return edges


@pytest.fixture(scope="module")
def harness():
    return harness_for(board_with(load_hex(image_path())))


def test_the_same_input_passes_the_same_edges_whatever_came_between(harness):
    first = edges_of(harness, FRAME)
    after = (harness.cpu.cycles, harness.cpu.pc, harness.now_tick)
    edges_of(harness, b"\x0b\xc0" * 3)
    assert edges_of(harness, FRAME) == first
    assert any(first)
    assert (harness.cpu.cycles, harness.cpu.pc, harness.now_tick) == after


def test_firmware_cannot_tell_whether_the_pulses_for_unplugged_motors_are_drawn(harness):
    drawn = harness_for(board_with(load_hex(image_path())))
    drawn.board.left.pulses = drawn.board.right.pulses = 1
    data = b"\x03\x00\x10\x00\x20\x0b\x05\x03\x00\x20\x00\xf0\x05\x00\x01\x99\x00\x11\x00\x22\x0b\xb0"
    edges = bytearray(8192), bytearray(8192)
    seen = []
    for one, counted in zip((harness, drawn), edges, strict=True):
        one.cpu.watch_edges(memoryview(counted))
        begun = one.board.log.end
        assert one.play(program(data)) == DONE
        events = [one.board.log.event(serial) for serial in range(begun, one.board.log.end)]
        seen.append((events, one.cpu.cycles, one.cpu.instructions, bytes(map(one.cpu.peek_iram, range(256)))))
    assert seen[0] == seen[1]
    assert edges[0] == edges[1]


@pytest.fixture(scope="module")
def step_by_step():
    """A harness whose board has a probe: it passes no sample, and begins with the first character."""
    harness = harness_for(board_with(load_hex(image_path())))
    harness.board.probe = Probe()
    return harness


def played(harness, data, edges, how):
    """All that a run of a harness shows; edges are counted on top of those in the map."""
    counted = bytearray(edges * (8192 // len(edges)))
    harness.cpu.watch_edges(memoryview(counted))
    begun = harness.board.log.end
    ended = harness.play(program(data, how))
    log = harness.board.log
    events = [log.event(serial) for serial in range(max(begun, log.first), log.end)]
    oracle = harness.oracle
    verdict = ended, oracle.code, oracle.tick, oracle.accepted
    return verdict, harness.now_tick, harness.cpu.highest_sp, events, bytes(counted), snapshot(harness.board)


@settings(max_examples=60, derandomize=True)
@given(
    data=st.binary(max_size=40) | st.binary(max_size=40).map(lambda data: b"\x00" + data),
    edges=st.binary(min_size=1, max_size=1) | st.just(bytes(range(256))),
    how=st.sampled_from((BYTES, FRAMES, SESSION)),
)
@example(data=b"\x55\x55\x55\x55\x55\xff\x2d\xd4", edges=b"\xff", how=BYTES)
@example(data=b"\x55\x55\x55\x55\x55\xff\x2d\xd4\x00", edges=b"\xfe", how=BYTES)
@example(data=b"\x0d\x08\x00", edges=b"\x00", how=SESSION)
@example(data=b"\x0e\x07\x00", edges=b"\x00", how=SESSION)
@example(data=b"\x0f\x00", edges=b"\x00", how=SESSION)
@example(data=b"\x0a\x00\x00", edges=b"\x00", how=SESSION)
def test_short_cuts_of_a_harness_change_nothing_that_a_run_shows(harness, step_by_step, data, edges, how):
    assert played(harness, data, edges, how) == played(step_by_step, data, edges, how)


class Looks(LiveOracle):
    """Notes when it is asked to look."""

    NOT_STATE = (*LiveOracle.NOT_STATE, "ticks")

    def __init__(self):
        super().__init__()
        self.ticks = []

    def begin(self, tick):
        self.ticks = []

    def look(self, tick):
        self.ticks.append(tick)


@pytest.mark.parametrize("data", [bytes(5), bytes(60), bytes(5) + b"\x0a\x07" + bytes(60)], ids=len)
def test_an_oracle_looks_at_the_same_ticks_however_an_input_begins(data):
    ticks = []
    for probe in (None, Probe()):
        board = board_with(load_hex(image_path()))
        board.probe = probe
        harness = Harness(board, board.cpu, Looks(), BIT_TICKS, board)
        harness.play(program(data))
        ticks.append(harness.oracle.ticks)
    assert ticks[0] == ticks[1]


def test_other_maps_get_the_edges_of_the_opening_too(harness, step_by_step):
    for size in (64, 1, 8192, 256):
        assert edges_of(harness, FRAME, size) == edges_of(step_by_step, FRAME, size)


def test_runs_leave_nothing_behind_that_grows(harness):
    sizes = set()
    for _ in range(5):
        harness.play(program(FRAME * 3))
        chips = harness.board.left, harness.board.right
        sizes.add(
            (*(len(chip.commands) for chip in chips), len(harness.board.faults), len(harness.cpu.txd.ticks))
        )
    assert len(sizes) == 1


def test_other_inputs_pass_other_edges(harness):
    inputs = (b"", b"\x09\x00\x55", FRAME, b"\x00\x10\x00\x20\x80", b"\x0b\xa0")
    assert len({bytes(edges_of(harness, data)) for data in inputs}) == len(inputs)


def test_a_run_ends_soon_after_the_firmware_has_nothing_to_do(harness):
    harness.play(program(b"\x55" * 8, BYTES))
    assert harness.now_tick - harness.end_tick < MS
    assert harness.cpu.idle


def test_how_high_the_stack_grew_is_told(harness):
    harness.play(program(b""))
    quiet = harness.cpu.highest_sp
    harness.play(program(FRAME))
    assert quiet < harness.cpu.highest_sp < 0xFF


def test_counting_edges_changes_no_bit(harness):
    states = []
    for size in (1, 64):
        edges_of(harness, b"\x03\x10\x00\x20\x00\x0a\x80\x05\x00\x01", size)
        states.append((harness.cpu.instructions, snapshot(harness.cpu)))
    assert states[0] == states[1]


@pytest.mark.parametrize("size", [0, 3, 100, 1 << 17])
def test_a_map_of_another_size_than_a_power_of_two_is_refused(harness, size):
    with pytest.raises(ValueError, match=f"a map of {size} bytes"):
        harness.cpu.watch_edges(memoryview(bytearray(size)))


def code(*words, routine=""):
    """An image: serial receiver on by timer 2 as the firmware has it, then `words`, and `routine` at 0023h.

    The words of the tests below are IDL in a loop with the serial interrupt on.
    """
    start = bytes.fromhex("75CBFF 75CAB2 75CDFF 75CCB2 75C834 759850" + "".join(words))
    return image_of((start.ljust(0x23, b"\0") + bytes.fromhex(routine)).ljust(64, b"\0"))


def test_firmware_that_never_sleeps_is_run_for_10_ms():
    harness = harness_for(board_with(code("80FE")))
    assert not harness.sleeps
    assert harness.play(program(b"\x55" * 3, BYTES)) == DONE
    assert harness.now_tick == harness.end_tick + 10 * MS


def test_firmware_that_does_not_go_to_sleep_again_is_told():
    harness = harness_for(board_with(code("75A890", "438701", "80FB", routine="80FE")))  # spins for ever
    harness.board.cpu.main_loop_limit = 0
    assert harness.sleeps
    assert harness.play(program(b"\x55", BYTES)) == AWAKE


def test_a_fault_ends_the_run():
    harness = harness_for(board_with(code("75A890", "438701", "80FB", routine="A5")))
    for _ in range(2):
        assert harness.play(program(bytes(5), FRAMES)) == STOPPED
        assert [fault.pc for fault in harness.board.faults] == [0x23]
    harness.back()
    assert not harness.board.faults
