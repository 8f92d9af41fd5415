"""A machine that is put back over and over."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.state import snapshot
from miro_robot.board import Board
from miro_robot.firmware import image_path
from miro_robot.harness.harness import AWAKE, DONE, STOPPED, Harness
from miro_robot.harness.oracle import LiveOracle
from miro_robot.harness.program import BYTES, SESSION, Program
from miro_robot.image import SPACE_BYTES, Image, Symbols, load_hex
from miro_robot.plant import Plant
from miro_robot.wiring import load_wiring

BIT_TICKS = 2500
MS = 24_000


def board_with(image, ticks=40 * MS, plant=None):
    board = Board(load_wiring(), plant or Plant())
    board.load(image)
    board.cpu.rxd.settled_tick = 2 * ticks
    board.run(ticks)
    return board


def harness_for(board):
    return Harness(board, board.cpu, LiveOracle(), BIT_TICKS, board)


def program(data, how=SESSION):
    read = Program(how)
    read.read(data)
    return read


@pytest.fixture(scope="module")
def harness():
    return harness_for(board_with(load_hex(image_path())))


def test_the_same_input_passes_the_same_edges_whatever_came_between(harness):
    first, second = bytearray(8192), bytearray(8192)
    harness.cpu.watch_edges(memoryview(first))
    assert harness.play(program(b"\x00\x10\x00\x20\x00")) == DONE
    after = (harness.cpu.cycles, harness.cpu.pc, harness.now_tick)
    harness.cpu.watch_edges(memoryview(bytearray(8192)))
    harness.play(program(b"\x0b\xc0" * 3))
    harness.cpu.watch_edges(memoryview(second))
    harness.play(program(b"\x00\x10\x00\x20\x00"))
    assert first == second
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


class EverySample(Plant):
    """Lets the board's chips make each sample."""

    def run_pulses(self, tick):
        return 0


@settings(max_examples=25, derandomize=True)
@given(st.binary(max_size=40))
def test_chips_without_work_pass_their_samples_with_the_same_state(data):
    harnesses = [
        harness_for(board_with(load_hex(image_path()), plant=plant())) for plant in (Plant, EverySample)
    ]
    harnesses[1].board.left.pulses = harnesses[1].board.right.pulses = 0
    ends = {one.play(program(data)) for one in harnesses}
    assert len(ends) == 1
    assert snapshot(harnesses[0].board) == snapshot(harnesses[1].board)


def test_runs_leave_nothing_behind_that_grows(harness):
    sizes = set()
    for _ in range(5):
        harness.play(program(b"\x00\x10\x00\x20\x00" * 3))
        chips = harness.board.left, harness.board.right
        sizes.add(
            (*(len(chip.commands) for chip in chips), len(harness.board.faults), len(harness.cpu.txd.ticks))
        )
    assert len(sizes) == 1


def test_other_inputs_pass_other_edges(harness):
    maps = []
    for data in (b"", b"\x09\x00\x55", b"\x00\x10\x00\x20\x00", b"\x00\x10\x00\x20\x80", b"\x0b\xa0"):
        edges = bytearray(8192)
        harness.cpu.watch_edges(memoryview(edges))
        harness.play(program(data))
        maps.append(bytes(edges))
    assert len(set(maps)) == len(maps)


def test_a_run_ends_soon_after_the_firmware_has_nothing_to_do(harness):
    harness.play(program(b"\x55" * 8, BYTES))
    assert harness.now_tick - harness.end_tick < MS
    assert harness.cpu.idle


def test_how_high_the_stack_grew_is_told(harness):
    harness.play(program(b""))
    quiet = harness.cpu.highest_sp
    harness.play(program(b"\x00\x10\x00\x20\x00"))
    assert quiet < harness.cpu.highest_sp < 0xFF


def test_counting_edges_changes_no_bit(harness):
    harness.cpu.watch_edges(memoryview(bytearray(1)))
    harness.play(program(b"\x03\x10\x00\x20\x00\x0a\x80\x05\x00\x01"))
    without = harness.cpu.cycles, harness.cpu.instructions, bytes(map(harness.cpu.peek_iram, range(256)))
    harness.cpu.watch_edges(memoryview(bytearray(64)))
    harness.play(program(b"\x03\x10\x00\x20\x00\x0a\x80\x05\x00\x01"))
    assert (
        harness.cpu.cycles,
        harness.cpu.instructions,
        bytes(map(harness.cpu.peek_iram, range(256))),
    ) == without


@pytest.mark.parametrize("size", [0, 3, 100, 1 << 17])
def test_a_map_of_another_size_than_a_power_of_two_is_refused(harness, size):
    with pytest.raises(ValueError, match=f"a map of {size} bytes"):
        harness.cpu.watch_edges(memoryview(bytearray(size)))


def code(*words):
    """An image without symbols: serial receiver on by timer 2 as the firmware has it, then `words`."""
    start = bytes.fromhex("75CBFF 75CAB2 75CDFF 75CCB2 75C834 759850".replace(" ", ""))
    data = start + bytes.fromhex("".join(words))
    return image_of(data.ljust(64, b"\x00"))


def image_of(data):
    code = data.ljust(SPACE_BYTES, b"\xff")
    return Image(Path("made.ihx"), code, ((0, len(data)),), len(data), "", Symbols(dict))


def test_firmware_that_never_sleeps_is_run_for_10_ms():
    harness = harness_for(board_with(code("80FE")))
    assert not harness.sleeps
    assert harness.play(program(b"\x55" * 3, BYTES)) == DONE
    assert harness.now_tick == harness.end_tick + 10 * MS


def test_firmware_that_does_not_go_to_sleep_again_is_told():
    # IDL in a loop with the serial interrupt on; the routine at 0023h, which is inside the image, spins for ever
    image = code("75A890", "438701", "80FB")
    spins = bytearray(image.code[:64])
    spins[0x23:0x25] = b"\x80\xfe"
    harness = harness_for(board_with(image_of(bytes(spins))))
    harness.board.cpu.main_loop_limit = 0
    assert harness.sleeps
    assert harness.play(program(b"\x55", BYTES)) == AWAKE


def test_a_fault_ends_the_run():
    image = code("75A890", "438701", "80FB")
    broken = bytearray(image.code[:64])
    broken[0x23] = 0xA5
    harness = harness_for(board_with(image_of(bytes(broken))))
    assert harness.play(program(b"\x55", BYTES)) == STOPPED
    assert harness.board.faults[0].pc == 0x23
    harness.back()
    assert not harness.board.faults
