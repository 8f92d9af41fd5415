"""A board takes short cuts; one with a probe does each step by itself, and ends with the same bits. So do chips that
are told every level.
"""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import NEVER_TICK
from miro_robot.board import Board
from miro_robot.lm629.chip import SAMPLE_TICKS, Lm629
from miro_robot.lm629.options import Lm629Options
from miro_robot.plant import Plant
from miro_robot.probe import Probe
from miro_robot.wiring import CHIP_INPUTS, load_wiring
from miro_sim.plant.drive import DifferentialDrive
from miro_sim.plant.params import Bridge, Chassis, DriveParams, OpticalEncoder
from tests.robot.board.rig import CYCLE, RESET, START, board_with
from tests.robot.firmware.rig import IMAGE, MS, Rig
from tests.states import snapshot

MSKI, RSTI, LTRJ, STT = 0x1C, 0x1D, 0x1F, 0x01
DRIVES = st.builds(
    lambda on_us, off_us, index, stiction: DriveParams(
        bridge=Bridge(on_delay_s=on_us * 1e-6, off_delay_s=off_us * 1e-6),
        encoder=OpticalEncoder(index_pulse=index),
        chassis=Chassis(stiction_ratio=stiction),  # above 1 the body is a rough one
    ),
    st.sampled_from((0.0, 2.0, 10.0)),
    st.sampled_from((0.0, 3.0, 20.0)),
    st.booleans(),
    st.sampled_from((1.0, 1.5)),
)
OPTIONS = st.builds(
    Lm629Options,
    pulse_at=st.sampled_from(("start", "end")),
    filter_clocks=st.sampled_from((0, 1, 3)),
    sign_of_negative=st.sampled_from((0, 1)),
)
VELOCITIES = st.integers(-16633, 16633)
ORDERS = st.lists(st.tuples(VELOCITIES, VELOCITIES, st.integers(1, 40 * MS)), min_size=1, max_size=4)


@settings(max_examples=25)
@given(DRIVES, OPTIONS, ORDERS)
def test_a_robot_drives_alike_with_and_without_a_probe(params, options, orders):
    rigs = [Rig(plant=DifferentialDrive(params), options=options) for _ in range(2)]
    rigs[1].board.probe = Probe()
    for number, (left, right, ticks) in enumerate(orders):
        for rig in rigs:
            rig.team(number, left, right)
            rig.run_to(rig.now + ticks)
        assert snapshot(rigs[0].board) == snapshot(rigs[1].board)
    assert rigs[0].board.left.real_position == rigs[1].board.left.real_position


LEVELS = st.integers(0, 0xFF)
MOVES = st.one_of(
    st.builds("MOV P0,#{}".format, LEVELS),
    st.builds("MOV P2,#{}".format, LEVELS),
    st.builds("MOV P2,#{}".format, st.integers(0, 0x1F).map(lambda pins: 0xE0 | pins)),
    st.builds("{} P2.{}".format, st.sampled_from(("SETB", "CLR", "CPL")), st.integers(0, 5)),
    st.builds("MOV R7,#{}\nDJNZ R7,$".format, st.integers(1, 0xFF)),
    st.sampled_from(("NOP", "MOV A,P0", "MOV 30h,P0", "JB P3.2,$+3", "JB P3.3,$+3")),
)


@pytest.mark.slow
@settings(max_examples=60)
@given(st.lists(MOVES, min_size=1, max_size=60), st.lists(st.integers(1, 3000), max_size=20))
def test_pins_that_move_at_random_do_the_same_with_and_without_a_probe(moves, cuts):
    boards = [board_with("\n".join(["loop:", *moves, "LJMP loop"]), stop_on_fault=False) for _ in range(2)]
    boards[1].probe = Probe()
    tick = 0
    for cut in [*cuts, 24_000]:
        tick += cut
        for board in boards:
            board.run(tick)
        assert snapshot(boards[0]) == snapshot(boards[1])
    assert boards[0].faults == boards[1].faults


def powered_up():
    board = Board(load_wiring(), Plant())
    board.load(IMAGE)
    board.cpu.rxd.settled_tick = NEVER_TICK
    return board


RESETS = st.integers(35_000, 36_000)
"""About where the firmware ends the first reset of both chips."""


@pytest.mark.slow
@settings(max_examples=200)
@given(st.lists(st.one_of(RESETS, st.integers(1, 120_000)), min_size=2, max_size=12))
def test_a_run_that_is_cut_from_power_up_on_ends_as_in_one_piece(cuts):
    whole, pieces = powered_up(), powered_up()
    for cut in sorted(cuts):
        pieces.run(cut)
    whole.run(max(cuts))
    assert snapshot(pieces) == snapshot(whole)


def tell_left(opcode, *words):
    """Lines that write a command and its data words to the left LM629, each byte after its busy time."""
    data = [byte for word in words for byte in word.to_bytes(2, "big")]
    lines = []
    for ps, byte in [(0, opcode), *((1, byte) for byte in data)]:
        moves = [f"MOV P0,#{byte}", *(f"MOV P2,#{levels | ps}" for levels in (0x36, 0x32, 0x36))]
        lines += [*moves, "MOV R7,#60", "DJNZ R7,$"]
    return lines


def test_hi_that_is_unmasked_in_a_run_comes_at_its_sample():
    masked = [*tell_left(MSKI, 0), *tell_left(RSTI, 0), "MOV R6,#10", "pause:", "DJNZ R7,$", "DJNZ R6,pause"]
    motor_off = [*tell_left(MSKI, 0x04), *tell_left(LTRJ, 0x0100), *tell_left(STT)]
    hear = ["hear:", "INC R3", "JB P3.2,hear", "SJMP $"]
    whole, pieces = (board_with("\n".join([START + RESET, *masked, *motor_off, *hear])) for _ in range(2))
    whole.run(10 * MS)
    for tick in range(0, 10 * MS + 1, 100):
        pieces.run(tick)
    assert whole.left.hi == 1
    assert snapshot(pieces) == snapshot(whole)


DATA, CONTROL = 0, 2  # ports
IDLE, RESET_PINS = 0x3F, 0x20
WRITE = st.tuples(st.just(CONTROL), st.integers(0, 0x1F).map(lambda levels: levels | RESET_PINS))
BYTE = st.tuples(st.just(DATA), st.sampled_from([0x00, 0x01, 0x06, 0x1C, 0x1E, 0x1F, 0xFF]))
LEFT_BYTE = st.builds(
    lambda ps, byte: [(DATA, byte), (CONTROL, 0x36 | ps), (CONTROL, 0x32 | ps), (CONTROL, 0x36 | ps)],
    st.integers(0, 1),
    st.sampled_from([0x00, 0x01, 0x06, 0x1C, 0x1E, 0x1F]),
)
EDGES = st.lists(st.one_of(WRITE.map(lambda one: [one]), BYTE.map(lambda one: [one]), LEFT_BYTE), max_size=40)
PULSE = [(CONTROL, IDLE & ~RESET_PINS)] * 5 + [(CONTROL, IDLE)]


def tell_everything(board, chips, ports, tick):
    banks = [*ports, *[0xFF] * 9]
    for side, chip in chips.items():
        levels = {}
        for pin in CHIP_INPUTS:
            bank, bit, inverted = board.wiring.chip_input(side, pin)
            levels[pin] = (banks[bank] >> bit & 1) ^ inverted
        chip.set_reset(tick, levels["rst"])
        chip.set_bus(tick, levels["cs"], levels["rd"], levels["wr"], levels["ps"], banks[DATA])


@settings(max_examples=150)
@given(EDGES, st.booleans(), st.integers(1, 40))
def test_both_chips_end_as_chips_that_are_told_every_level(edges, pulse, pause):
    options = Lm629Options(reset_clocks=300)
    board = board_with("SJMP $\n", stop_on_fault=False, options=options)
    chips = {"left": Lm629(options), "right": Lm629(options)}
    ports, tick = [0xFF] * 4, CYCLE
    tell_everything(board, chips, ports, 0)
    script = [(CONTROL, IDLE)] + (PULSE if pulse else [])
    script += [(CONTROL, IDLE)] * 200 if pulse else []
    for port, levels in script + [one for some in edges for one in some]:
        ports[port] = levels
        board.port_written(port, levels, tick)
        tell_everything(board, chips, ports, tick)
        tick += pause * CYCLE
    tick += SAMPLE_TICKS
    board.sync(tick)
    for side, chip in chips.items():
        chip.advance(tick)
        assert snapshot(getattr(board, side)) == snapshot(chip), side
