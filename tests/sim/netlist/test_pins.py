"""Port pins that move at random, resets, power cuts: the net list and the compiled board stay equal, field by field."""

import itertools

from hypothesis import given
from hypothesis import strategies as st

from miro_exact.state import Flat
from miro_robot.board import Board
from miro_robot.event_log import ENDED, FAULT
from miro_robot.lm629.options import Lm629Options
from miro_robot.plant import Plant
from miro_robot.wiring import load_wiring
from miro_sim.plant.drive import DifferentialDrive
from miro_sim.plant.params import Bridge, DriveParams, OpticalEncoder
from tests.example_count import examples
from tests.robot.board.rig import MS, RESET, START, image_of
from tests.robot.board.test_step_by_step import MOVES
from tests.sim.netlist.net_board import NetBoard, settle

OPTIONS = st.builds(
    Lm629Options,
    reset_clocks=st.sampled_from((300, 6144)),
    busy_clocks=st.integers(90, 150),
    hi_falls=st.sampled_from(("busy", "latch")),
    pulse_at=st.sampled_from(("start", "end")),
    filter_clocks=st.sampled_from((0, 1, 3)),
    sign_of_negative=st.sampled_from((0, 1)),
    reset_pulse_clocks=st.sampled_from((2, 8)),
)
DRIVES = st.builds(
    lambda on_us, off_us, index: DriveParams(
        bridge=Bridge(on_delay_s=on_us * 1e-6, off_delay_s=off_us * 1e-6),
        encoder=OpticalEncoder(index_pulse=index),
    ),
    st.sampled_from((0.0, 2.0, 10.0)),
    st.sampled_from((0.0, 3.0, 20.0)),
    st.booleans(),
)


def as_told_at_once(state):
    """What the CPU was told of its pins, whatever the order on one tick.

    HI of both chips that change together the compiled board tells one after the other, nets at once; and where the
    supply goes, the CPU is reset there before, here after the chips. It looks at all that with its next cycle.
    """
    ports = "cpu.peripherals.ports."
    outside, later = list(state[ports + "outside"]), {}
    for cycle, port, levels in state[ports + "pending"]:
        if cycle <= state["cpu.cycles"]:
            outside[port] = levels
        else:
            later[cycle, port] = levels
    return {**state, ports + "outside": outside, ports + "pending": later}


def faults_first(event):
    """The order of noting, but for one thing: an edge that breaks a limit may also complete a command.

    The compiled board, which knows both chips, judges the limits first, then writes what the chips do into the log. A
    part is called once, and the board notes the faults when all parts that the edge reaches have been called.
    """
    tick, kind, *_ = event
    return tick, kind != FAULT


def wheels():
    """For each of both boards."""
    return DifferentialDrive(DriveParams()), DifferentialDrive(DriveParams())


class Pair:
    """A compiled board and its twin with the same program."""

    def __init__(self, text, options=None, plants=None, slot=0, robots=3, stop_on_fault=False):
        image = image_of(text)
        plants = plants or (Plant(), Plant())
        compiled = Board(load_wiring(), plants[0], slot, robots, options, stop_on_fault)
        compiled.load(image)
        self.boards = [
            compiled,
            NetBoard(plants[1], slot, robots, options, stop_on_fault, image=image),
        ]
        self.flats = [Flat(board) for board in self.boards]
        self.serials = [0, 0]
        for board in self.boards:
            board.cpu.rxd.settled_tick = 1 << 60

    def run(self, tick):
        """Runs both, then asks what differs."""
        stops = [board.run(tick) for board in self.boards]
        assert stops[0] == stops[1]
        for board in self.boards:
            settle(board)
        self.check()

    def do(self, name, level):
        for board in self.boards:
            getattr(board, name)(level)
        self.check()

    def events(self, number):
        """What a log got since the last call. That a program has ended only a board alone says."""
        log = self.boards[number].log
        begin, self.serials[number] = self.serials[number], log.end
        events = [log.event(serial) for serial in range(max(begin, log.first), log.end)]
        return [event for event in events if event[1] != ENDED]

    def check(self):
        """That both agree in every field, in their logs and faults."""
        if len({flat.save() for flat in self.flats}) > 1:
            ours, theirs = (as_told_at_once(flat.decode(flat.save())) for flat in self.flats)
            assert {name: (ours[name], theirs[name]) for name in ours if ours[name] != theirs[name]} == {}
        logs = [self.events(number) for number in range(2)]
        assert sorted(logs[0], key=faults_first) == sorted(logs[1], key=faults_first)
        assert self.boards[0].faults == self.boards[1].faults


@examples(60)
@given(st.lists(MOVES, min_size=1, max_size=60), st.lists(st.integers(1, 3000), max_size=20), OPTIONS)
def test_pins_that_move_at_random(moves, cuts, options):
    pair = Pair("\n".join(["loop:", *moves, "LJMP loop"]), options)
    for tick in itertools.accumulate([*cuts, 24_000]):
        pair.run(tick)


def tell(sides, opcode, *words):
    """Lines that write a command and its data words to chips: 1 left, 2 right, 3 both."""
    selected = 0x3E & ~(sides << 3)
    data = [byte for word in words for byte in word.to_bytes(2, "big")]
    lines = []
    for ps, byte in [(0, opcode), *((1, byte) for byte in data)]:
        moves = [f"MOV P2,#{levels | ps}" for levels in (selected, selected & ~0x04, selected)]
        lines += [f"MOV P0,#{byte}", *moves, "MOV R7,#60", "DJNZ R7,$"]
    return lines


FILTER = [*tell(3, 0x1E, 0x030F, 0x0190, 0x0028, 0x0BB8, 0x07D0), *tell(3, 0x04)]
SIDES = st.sampled_from((1, 2, 3))
VELOCITY = st.builds(
    lambda side, control, velocity: [*tell(side, 0x1F, control, 0, 0x4000, velocity, 0), *tell(side, 0x01)],
    SIDES,
    st.sampled_from((0x1828, 0x0828)),  # forward, backward
    st.integers(0, 12),
)
OFF = st.builds(lambda side: [*tell(side, 0x1F, 0x0100), *tell(side, 0x01)], SIDES)
MASK = st.builds(lambda side, mask: tell(side, 0x1C, mask), SIDES, st.integers(0, 0x7F))
CLEAR = st.builds(lambda side, mask: tell(side, 0x1D, mask), SIDES, st.integers(0, 0x7F))
READ = st.sampled_from([["MOV P2,#0x34".replace("0x34", "52"), "MOV A,P0", "MOV P2,#54"], ["MOV 30h,P3"]])
PAUSE = st.builds(
    lambda rounds, label: [f"MOV R6,#{rounds}", f"MOV R5,#{label}", "DJNZ R5,$", "DJNZ R6,$-2"],
    st.integers(1, 60),
    st.integers(1, 255),
)
STEPS = st.lists(st.one_of(VELOCITY, OFF, MASK, CLEAR, READ, PAUSE), min_size=1, max_size=14)
OUTSIDE = st.one_of(
    st.tuples(st.just("set_reset"), st.sampled_from([0, 1])),
    st.tuples(st.just("set_power"), st.sampled_from([0, 1])),
)


@examples(60)
@given(
    STEPS,
    OPTIONS,
    DRIVES,
    st.lists(st.tuples(st.integers(1, 12 * MS), st.one_of(st.none(), OUTSIDE)), max_size=6),
)
def test_a_robot_that_drives_asks_and_is_reset_or_switched_off(steps, options, drive, actions):
    text = (
        START + RESET + "\n".join([*FILTER, "loop:", *[line for step in steps for line in step], "LJMP loop"])
    )
    pair = Pair(text, options, (DifferentialDrive(drive), DifferentialDrive(drive)))
    tick = 0
    for pause, action in [*actions, (30 * MS, None)]:
        tick += pause
        pair.run(tick)
        if action is not None:
            pair.do(*action)


VECTORS = "LJMP main\nORG 3h\nINC 40h\nRETI\nORG 13h\nINC 41h\nRETI\nORG 30h\nmain:\n"
"""Both interrupts of HI are counted."""
INTERRUPTS = st.sampled_from(
    [
        *("SETB IT0", "CLR IT0", "SETB IT1", "CLR IT1", "CLR IE0", "CLR IE1", "MOV TCON,#5", "MOV TCON,#0"),
        *("MOV IE,#85h", "MOV IE,#0", "MOV 42h,TCON", "ANL TCON,#0FDh", "JBC IE0,$+3", "MOV 44h,P3"),
        *("MUL AB", "NOP", "INC 43h", "MOV DPTR,#1234h"),
    ]
).map(lambda line: [line])


@examples(40)
@given(
    st.lists(st.one_of(VELOCITY, OFF, MASK, CLEAR, PAUSE, INTERRUPTS, INTERRUPTS), min_size=1, max_size=25),
    OPTIONS,
    st.lists(st.integers(1, 12 * MS), max_size=3),
)
def test_firmware_that_takes_the_interrupts_of_both_chips(steps, options, cuts):
    lines = [*FILTER, "loop:", *[line for step in steps for line in step], "LJMP loop"]
    pair = Pair(VECTORS + RESET + "\n".join(lines), options, wheels())
    for tick in itertools.accumulate([*cuts, 30 * MS]):
        pair.run(tick)


def test_hi_that_falls_on_the_very_tick_of_a_sample():
    drive = [*tell(3, 0x1F, 0x1828, 0, 0x4000, 1, 0), *tell(3, 0x01)]
    ask = [*tell(3, 0x1D, 0), *tell(1, 0x1D, 0)]
    pair = Pair(
        VECTORS + RESET + "\n".join([*FILTER, "loop:", *drive, *ask, "LJMP loop"]),
        Lm629Options(reset_clocks=300, busy_clocks=90),
        wheels(),
    )
    pair.run(99_550)
    for board in pair.boards:
        assert (board.left.hi_falls_tick, board.left.sample_tick) == (99_576, 99_576)
    pair.run(30 * MS)


def test_a_supply_that_is_off_for_no_time_is_no_fault_of_the_firmware():
    pair = Pair(START + "SJMP $")
    pair.run(MS)
    pair.do("set_power", 0)
    pair.do("set_power", 1)
    pair.run(3 * MS)
    assert pair.boards[0].faults == []
