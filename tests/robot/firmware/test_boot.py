"""From power-on to the first sleep: the handshake with the two LM629, a board where it fails, resets at other times."""

from itertools import pairwise

import msgspec
import pytest

from miro_exact.state import Flat
from miro_protocol.decoder import Received, TelemetryDecoder
from miro_protocol.frames import TeamFrame, TelemetryFrame, encode
from miro_protocol.table import Flags
from miro_robot.lm629.options import Lm629Options
from miro_robot.wiring import load_wiring
from tests.robot.firmware.rig import CHARACTER, MS, Rig

LFIL, LTRJ, STT = 0x1E, 0x1F, 0x01
RESET_PINS = 0x20


@pytest.fixture
def cold():
    return Rig(boot=False)


def test_reset_lasts_eight_lm629_clocks_and_is_given_once(cold):
    cold.run_to(4 * MS)
    control = [(tick, latch) for tick, port, latch in cold.board.writes if port == 2]
    falls = [tick for tick, latch in control if not latch & RESET_PINS]
    rises = [tick for tick, latch in control if tick > falls[0] and latch & RESET_PINS]
    assert rises[0] - falls[0] >= 8 * 4
    assert not [tick for tick in falls if tick > rises[0]]


def test_the_robot_is_ready_within_three_milliseconds_and_sleeps(cold):
    cold.run_to(3 * MS)
    idle = cold.cpu.idle_cycles
    cold.run_ms(10)
    assert cold.cpu.idle_cycles - idle > 0.9 * 20_000
    assert cold.board.left.status == cold.board.right.status == 0x80  # motor off, no flags


def broken_board(**nets):
    wiring = load_wiring()
    changed = {net.replace("_", "."): source for net, source in nets.items()}
    return Rig(wiring=msgspec.structs.replace(wiring, nets={**wiring.nets, **changed}), boot=False)


def resets(rig):
    """How often the pin of both chips went up."""
    levels = [latch & RESET_PINS for _, port, latch in rig.board.writes if port == 2]
    return sum(1 for before, after in pairwise(levels) if after and not before)


def test_a_chip_that_never_leaves_reset_keeps_both_motors_off_and_is_reported():
    rig = broken_board(right_rst="0")
    rig.run_to(100 * MS)
    assert rig.cpu.sfr(0xA0) & RESET_PINS == 0
    rig.team(0, 5000, 5000, ask=True)
    rig.run_ms(25)
    events = TelemetryDecoder().feed_symbols(rig.sent())
    frames = [event for event in events if isinstance(event, Received)]
    message = frames[0].message(3)
    assert isinstance(message, TelemetryFrame)
    assert message.flags & Flags.INIT_FAILED
    assert rig.cpu.sfr(0xA0) & RESET_PINS == 0
    assert rig.board.left.desired_velocity == 0


def test_the_reset_is_tried_again_eight_times_before_it_gives_up():
    rig = broken_board(left_rst="0")
    rig.run_to(100 * MS)
    assert resets(rig) == 8


@pytest.mark.parametrize(("busy_clocks", "works"), [(600, True), (6000, False)])
def test_a_chip_may_be_busy_for_100_us_and_not_for_1_ms(busy_clocks, works):
    rig = Rig(options=Lm629Options(busy_clocks=busy_clocks), boot=False)
    rig.run_to(100 * MS)
    assert bool(rig.cpu.sfr(0xA0) & RESET_PINS) == works
    rig.team(0, 5000, 5000)
    assert (rig.told(rig.board.left)[-1:] != []) == works


@pytest.mark.parametrize("bit_6", ["fires", "stays"])
def test_chips_that_show_c4h_after_a_reset_and_c0h_after_rsti_are_taken_at_the_first_try(bit_6):
    rig = Rig(options=Lm629Options(reset_breakpoint=bit_6), boot=False)
    rig.run_to(100 * MS)
    assert resets(rig) == 1
    rig.team(0, 5000, 5000)
    assert rig.told(rig.board.left)


def test_chips_that_stop_answering_are_reset_and_set_up_again():
    rig = Rig()
    rig.service(0, 0, 1, 11, 22, 33, 44)
    rig.service(1, 0, 2, 4000)
    rig.team(2, 5000, 5000)
    rig.board.deaf = True
    rig.team(3, 5000, 5000)
    rig.run_ms(5)  # the one try that a frame gives them
    assert rig.cpu.sfr(0xA0) & RESET_PINS == 0  # held in reset: both motors are off
    rig.team(4, 5000, 5000)
    rig.run_ms(5)
    assert rig.cpu.sfr(0xA0) & RESET_PINS == 0
    rig.board.deaf = False
    rig.told(rig.board.left)
    rig.team(5, 6000, 6000)
    rig.run_ms(5)
    commands = [(command.opcode, command.data) for command in rig.told(rig.board.left)]
    assert (LFIL, bytes.fromhex("030f 000b 0016 0021 002c")) in commands
    assert (LTRJ, bytes.fromhex("0020 00000fa0")) in commands
    assert commands[-2:] == [(LTRJ, bytes.fromhex("1808 00177000")), (STT, b"")]
    assert not rig.board.left.status & 0x80


def test_a_reset_at_any_moment_is_no_fault_of_the_firmware():
    rig = Rig()
    tick = rig.send(encode(TeamFrame(0, 1, ((100, -100),) * 3), 3)) + CHARACTER
    rig.run_to(tick)
    state = Flat(rig.board)
    decoding = state.save()
    writing = 0
    for later in range(0, 2 * MS, 36):  # the frame is tested, then both LM629 are written
        state.load(decoding)
        rig.board.run(tick + later)
        writing += not rig.cpu.idle
        rig.board.set_reset(1)
        rig.board.run(tick + later + 48)
        rig.board.set_reset(0)
        rig.board.run(tick + later + MS)
        assert not rig.board.faults, later
    assert writing > 800
