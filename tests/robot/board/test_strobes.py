"""The board tells a chip without a strobe less, and the chip ends in the same state as one that is told everything."""

from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.state import snapshot
from miro_robot.lm629.chip import SAMPLE_TICKS, Lm629
from miro_robot.lm629.options import Lm629Options
from miro_robot.wiring import CHIP_INPUTS
from tests.robot.board.rig import CYCLE, board_with

DATA, CONTROL = 0, 2  # ports
IDLE, RESET = 0x3F, 0x20
WRITE = st.tuples(st.just(CONTROL), st.integers(0, 0x1F).map(lambda levels: levels | RESET))
BYTE = st.tuples(st.just(DATA), st.sampled_from([0x00, 0x01, 0x06, 0x1C, 0x1E, 0x1F, 0xFF]))
LEFT_BYTE = st.builds(
    lambda ps, byte: [(DATA, byte), (CONTROL, 0x36 | ps), (CONTROL, 0x32 | ps), (CONTROL, 0x36 | ps)],
    st.integers(0, 1),
    st.sampled_from([0x00, 0x01, 0x06, 0x1C, 0x1E, 0x1F]),
)
EDGES = st.lists(st.one_of(WRITE.map(lambda one: [one]), BYTE.map(lambda one: [one]), LEFT_BYTE), max_size=40)
PULSE = [(CONTROL, IDLE & ~RESET)] * 5 + [(CONTROL, IDLE)]


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
