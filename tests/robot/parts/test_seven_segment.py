"""What is seen on digits that are lit one after the other."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.parts.seven_segment import SevenSegment
from tests.example_count import examples
from tests.naive.parts import seen_segments
from tests.robot.parts.bench import Bench

SEGMENTS = [*"abcdefg", "dp"]
MS = 12_000
CODES = dict(zip("0123456789", (0x3F, 0x06, 0x5B, 0x4F, 0x66, 0x6D, 0x7D, 0x07, 0x7F, 0x6F), strict=True))


def display(digits=4, segments=SEGMENTS, crystal_hz=12_000_000, **keys):
    nets = [*segments, *(f"dig{number}" for number in range(1, digits + 1))]
    board = Bench({"it": (SevenSegment(**keys), {net: net for net in nets})}, nets, crystal_hz)
    board.on = 0 if keys.get("common") == "anode" else 1
    board.drive_all({net: int((net in segments) != board.on) for net in nets})
    return board


def show(board, code, digit=None, ms=1.0):
    """Lights segments of a digit for a while."""
    levels = {net: board.on if code >> bit & 1 else 1 - board.on for bit, net in enumerate(SEGMENTS)}
    select = {f"dig{digit}": 1 - board.on} if digit else {}
    board.drive_all({net: level for net, level in {**levels, **select}.items() if net in board.number})
    board.run(board.tick + int(ms * MS))
    board.drive_all(dict.fromkeys(select, board.on))


def multiplex(board, codes, ms=1.0, rounds=20):
    for _ in range(rounds):
        for digit, code in enumerate(codes, 1):
            show(board, code, digit, ms)


@pytest.mark.parametrize("common", ["cathode", "anode"])
def test_digits_that_are_lit_in_turn_are_seen_together(common):
    board = display(common=common)
    multiplex(board, [CODES["1"], CODES["2"] | 0x80, CODES["3"], CODES["4"]])
    assert board.read("it.text") == "12.34"
    assert (board.read("it.segments"), board.read("it.digits")) == ("06db4f66", 4)


def test_a_digit_without_a_pin_of_its_own_is_always_on():
    board = display(0)
    show(board, CODES["7"], ms=50)
    assert board.read("it.text") == "7"


def test_a_digit_that_is_not_lit_any_more_is_gone_after_a_window():
    board = display(2)
    multiplex(board, [CODES["8"], CODES["9"]], rounds=30)
    assert board.read("it.text") == "89"
    multiplex(board, [CODES["8"], 0], rounds=20)
    assert (board.read("it.text"), board.read("it.digits")) == ("8 ", 1)


def test_too_slow_a_multiplex_is_seen_as_single_digits():
    board = display(2)
    seen = []
    for digit in (1, 2, 1, 2):
        show(board, CODES["5"], digit, ms=40)
        seen.append(board.read("it.text"))
    assert seen == ["5 ", " 5", "5 ", " 5"]


def test_what_flashes_up_while_digits_are_switched_is_not_seen():
    board = display(2)
    for _ in range(20):
        show(board, CODES["1"], 1)
        show(board, CODES["1"], 2, ms=0.02)  # the old segments for 20 us
        show(board, CODES["0"], 2)
    assert board.read("it.text") == "10"
    for _ in range(20):
        show(board, CODES["1"], 1)
        show(board, CODES["4"], 2, ms=0.4)
        show(board, CODES["0"], 2)
    assert board.read("it.text") == "18"


def test_a_blank_display_and_one_without_supply_show_nothing():
    board = display()
    board.run(100 * MS)
    assert (board.read("it.text"), board.read("it.digits")) == ("    ", 0)
    multiplex(board, [0x7F] * 4)
    board.power(0)
    assert board.read("it.text") == "    "
    board.power(1)
    board.drive_all({net: int(net.startswith("dig")) for net in board.number})
    board.run(board.tick + 30 * MS)
    assert board.read("it.text") == "    "


def test_segments_that_make_no_character_are_a_question_mark():
    board = display(2)
    multiplex(board, [0x49, 0x40], rounds=30)
    assert board.read("it.text") == "?-"


steps = st.lists(
    st.tuples(
        st.sampled_from([1, 2, 30, 100, 399, 400, 401, 900]),
        st.dictionaries(st.sampled_from([*SEGMENTS, "dig1", "dig2", "dig3"]), st.integers(0, 1), min_size=1),
    ),
    min_size=1,
    max_size=40,
)


@given(steps)
@examples(60)
def test_it_is_its_slow_twin_whatever_lights_it(steps):
    window = 2000  # 20 ms at 100 kHz
    board = display(3, crystal_hz=100_000)
    levels = {net: int(net.startswith("dig") and len(net) > 2) for net in [*SEGMENTS, "dig1", "dig2", "dig3"]}
    history = []
    for wait, change in steps:
        pattern = sum(levels[net] << bit for bit, net in enumerate(SEGMENTS))
        history += [(pattern, [levels[f"dig{number}"] for number in (1, 2, 3)])] * wait
        board.run(board.tick + wait)
        levels.update(change)
        board.drive_all(change)
        whole = seen_segments(history, window, 3)
        seen = board.read("it.segments")
        assert seen == ("".join(f"{one:02x}" for one in whole[-1]) if whole else "000000")
