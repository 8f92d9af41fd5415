"""Expressions mean what C means by them."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_robot.image import load_hex
from miro_robot.image.c_types import CType
from mirotwin.debug.expression import NoValue, Value, content, expression
from mirotwin.runs.inspected_run import InspectedRun
from tests import children
from tests.alone import Alone
from tests.mirotwin.debug.runs import SECOND, debugger_of, robot_run
from tests.mutants.sdcc import needs_sdcc


class Numbers:
    """A scope of plain numbers, and of `m`, a memory of zeros."""

    def __init__(self, **numbers):
        self.numbers = numbers

    def find(self, name, module):
        if name == "m":
            return Value(CType("array", 8, element=CType("int", 1), count=8), "iram", 0, self)
        if name not in self.numbers:
            raise NoValue(f"there is no {name}")
        return Value(number=self.numbers[name])

    def read(self, space, address, count):
        return bytes(count)


def value(text, scope=None):
    scope = scope or Numbers(a=7, b=-2, c=0)
    return content(expression(text)(scope))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a + b * 3", 1),
        ("(a + b) * 3", 15),
        ("a / b", -3),
        ("a % b", 1),
        ("-a / 2", -3),
        ("a >= 7 && b < 0", 1),
        ("c && 1 / c", 0),
        ("a || 1 / c", 1),
        ("!c + !a", 1),
        ("~0x0f & 0xff", 0xF0),
        ("1 << 4 | 1", 17),
        ("a == 7 == 1", 1),
        ("'A' + '\\n'", 75),
        ("a.0 + a.3", 1),
        ("a * 1.5", 10.5),
        ('"READY" == "READY"', 1),
        ('"a\\nb" != "a"', 1),
        ('"a: \\"b\\"" == "a: b"', 0),
    ],
)
def test_operators_have_the_ranks_of_c(text, expected):
    assert value(text) == expected


@given(
    st.lists(
        st.sampled_from(
            ["a", "b", "m", "1.5", "3", "+", "-", "*", "(", ")", "&", "<", ".", "[", "]", "0x", "'", "$"]
        )
    )
)
def test_what_cannot_be_read_is_said(parts):
    with suppress(NoValue):
        value(" ".join(parts))


@pytest.mark.parametrize(
    "text",
    [
        *(
            "",
            "a.",
            "a.-",
            "$",
            "$x",
            "1 +",
            "(1",
            "a b",
            "1 << 99",
            "1 / 0",
            "m[0.5]",
            "m[8]",
            "a[0]",
            "*a",
            "&a",
        ),
        *("(" * 200 + "1" + ")" * 200, f"{9**300} * {9**300}"),
    ],
)
def test_what_has_no_value_is_refused(text):
    with pytest.raises(NoValue):
        value(text)


@pytest.fixture(scope="module")
def debugger():
    debugger = debugger_of(robot_run())
    debugger.add("take_body")
    debugger.go_to(SECOND // 2)
    debugger.move("continue")
    return debugger


def shown(debugger, text, frame=0):
    return content(expression(text)(debugger.moment(frame)))


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("frames_accepted", "iram[&frames_accepted] + 256 * iram[&frames_accepted + 1]"),
        ("failsafe:age", "age"),
        ("P1.3", "P1 >> 3 & 1"),
        ("SCON.RI", "RI"),
        ("RI", "SCON.0"),
        ("R3", "iram[(PSW & 0x18) + 3]"),
        ("lm629.left.pid.kp", "400"),
        ("PC", "take_body"),
        ("cycle * 12", "tick"),
        ("A", "sfr[0xe0]"),
        ("code[PC]", "code[take_body]"),
        ("from", "DPL"),
    ],
)
def test_names_mean_variables_registers_bits_chips_and_memories(debugger, text, same):
    assert shown(debugger, text) == shown(debugger, same)


@pytest.mark.parametrize(
    ("function", "name", "frame", "why"),
    [
        ("failsafe_look", "behind", 0, "behind is not live: it was optimised away"),
        ("wait_for", "opcode", 2, "its registers belong to the function that is called"),
    ],
)
def test_what_is_not_live_says_so(function, name, frame, why):
    look = debugger_of(robot_run())
    look.add(function)
    look.move("continue")
    with pytest.raises(NoValue, match=why):
        shown(look, name, frame)


OVERLAID = """
unsigned char sum;
unsigned char twice(unsigned char one, unsigned char other) { return one + other + sum; }
unsigned char less(unsigned char one, unsigned char other) { return one - other - sum; }
void main(void) { while (1) { sum = twice(sum, 3); sum = less(sum, 1); } }
"""


@needs_sdcc
def test_a_variable_in_shared_memory_is_live_while_its_function_is_under_way(tmp_path):
    (tmp_path / "two.c").write_text(OVERLAID)
    children.run(["sdcc", "-mmcs51", "--debug", "two.c"], cwd=tmp_path, check=True)
    debugger = debugger_of(InspectedRun(Alone(load_hex(tmp_path / "two.ihx")).world))
    debugger.add("less")
    debugger.move("continue")
    assert shown(debugger, "less_PARM_2") == 1
    with pytest.raises(NoValue, match="is not live: its memory is shared, and twice is not under way"):
        shown(debugger, "twice_PARM_2")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("frames_acepted", "did you mean frames_accepted"),
        ("failsaef:age", "there is no age of failsaef; give one of failsafe:age"),
        ("xram[1]", "is in xram: the board has no such memory"),
        ("sfr[3]", "0x03 is no special function register; they begin at"),
        ("iram[256]", "give 0 to 255"),
    ],
)
def test_a_name_that_is_not_there_names_what_comes_close(debugger, text, said):
    with pytest.raises(BadInput, match=said):
        shown(debugger, text)
