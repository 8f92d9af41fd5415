"""SP leaves its stack: by each instruction that can write it, past data, round the top of RAM, below the start."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.faults import FaultKind
from miro_robot.image import Symbol, Symbols, load_hex
from tests.alone import Alone
from tests.naive import stack as naive
from tests.robot.inspect.programs import build
from tests.robot.mcs51.rig import cpu_with

OVER, UNDER = FaultKind.STACK_OVERFLOW, FaultKind.STACK_UNDERFLOW
FIRST, LAST = 0x30, 0xBF


def kinds(text, first=FIRST, last=LAST):
    """Stack faults of a program that begins with the stack set up."""
    program = f"MOV SP,#{first - 1:02X}h\n{text}"
    cpu = cpu_with(program)
    cpu.bound_stack(first, last)
    for _ in program.splitlines():
        cpu.step()
    return [kind for kind, _, _ in cpu.bus.faults]


@pytest.mark.parametrize(
    "text",
    [
        "MOV SP,#0BFh\nPUSH ACC",
        "MOV SP,#0BFh\nINC SP",
        "MOV SP,#0C0h",
        "MOV A,#0C0h\nMOV SP,A",
        "MOV R0,#0C0h\nMOV SP,R0",
        "MOV 40h,#0C0h\nMOV SP,40h",
        "MOV A,#0F0h\nORL SP,A",
        "ORL SP,#0F0h",
        "MOV A,#0EFh\nXRL SP,A",
        "MOV A,#0C5h\nXCH A,SP",
        "MOV 30h,#0C1h\nMOV SP,#30h\nPOP SP",
        "MOV SP,#0BEh\nLCALL 9",
        "MOV SP,#0BFh\nMOV A,SP\nADD A,#60h\nMOV SP,A",
    ],
)
def test_a_stack_that_runs_into_what_lies_above_is_a_fault(text):
    assert kinds(text) == [OVER]


@pytest.mark.parametrize(
    "text", ["POP ACC", "DEC SP", "MOV SP,#07h", "MOV A,#10h\nMOV SP,A", "MOV SP,#31h\nANL SP,#0Fh", "RET"]
)
def test_a_stack_that_goes_below_its_start_is_a_fault(text):
    assert kinds(text) == [UNDER]


@pytest.mark.parametrize("last", [0xFF, 0xF0])
@pytest.mark.parametrize(
    ("room", "expected"), [("28h", [OVER]), ("60h", [OVER]), ("08h\nMOV SP,A\nADD A,#0F8h", [])]
)
def test_a_frame_that_goes_round_the_top_of_ram_is_an_overflow(last, room, expected):
    """SDCC makes room for local variables by MOV A,SP; ADD A,#n; MOV SP,A."""
    assert kinds(f"MOV SP,#0E0h\nMOV A,SP\nADD A,#{room}\nMOV SP,A", last=last) == expected


def test_without_a_map_the_ends_of_ram_are_the_limits():
    cpu = cpu_with("MOV SP,#0FFh\nINC SP\nMOV SP,#80h\nMOV SP,#07h")
    for _ in range(4):
        cpu.step()
    assert [(kind, pc) for kind, pc, _ in cpu.bus.faults] == [(OVER, 3)]


def test_leaving_the_stack_is_told_once_and_setting_it_up_is_no_fault():
    assert kinds("MOV SP,#0C0h\nINC SP\nINC SP\nMOV SP,#30h\nMOV SP,#0C0h") == [OVER, OVER]
    cpu = cpu_with("MOV SP,#2Fh\nPUSH ACC\nPOP ACC")
    cpu.bound_stack(FIRST, LAST)
    for _ in range(3):
        cpu.step()
    assert cpu.faults == 0


STEPS = st.lists(
    st.one_of(
        st.just(("push", 0)),
        st.just(("pop", 0)),
        st.tuples(st.just("data"), st.integers(0, 255)),
        st.tuples(st.just("sum"), st.integers(0, 255)),
    ),
    min_size=1,
    max_size=40,
)


@given(STEPS, st.one_of(st.just((0, 255)), st.tuples(st.integers(8, 200), st.integers(0, 255))))
def test_stacks_are_judged_as_by_the_list_of_their_pointers(steps, bounds):
    first, last = bounds[0], max(bounds)
    code = {"push": "PUSH ACC", "pop": "POP 7Fh"}
    text = "\n".join(
        code.get(how) or (f"MOV SP,#{by:03X}h" if how == "data" else f"MOV A,SP\nADD A,#{by:03X}h\nMOV SP,A")
        for how, by in steps
    )
    cpu = cpu_with(text)
    cpu.bound_stack(first, last)
    taken = []
    for how, _ in steps:
        before = cpu.sp
        for _ in range(3 if how == "sum" else 1):
            cpu.step()
        taken.append((how, before, cpu.sp))
    said = ["over" if kind == OVER else "under" for kind, _, _ in cpu.bus.faults]
    assert said == naive.problems(taken, first, last)


def test_the_stack_is_from_where_the_map_begins_it_to_the_next_variable():
    names = {
        "__start__stack": Symbol(0x30, "iram"),
        "_low": Symbol(0x20, "iram"),
        "_main": Symbol(0x62, "code"),
    }
    assert Symbols(names).stack == (0x30, 0xFF)
    assert Symbols(names | {"_high": Symbol(0xF0, "iram"), "_x": Symbol(0x40, "xram")}).stack == (0x30, 0xEF)
    assert Symbols({}).stack == (0, 0xFF)


def test_code_outside_of_the_image_is_not_named_after_a_table_far_below():
    symbols = Symbols({"_table": Symbol(0x200, "code")}, ((0, 0x300),))
    assert [symbols.name_at(at) for at in (0x210, 0x2FF, 0x300, 0xFE02)] == ["_table", "_table", "", ""]


DYING = """
#include <8052.h>
unsigned char depth;
static unsigned char eat(unsigned char n) __reentrant {
    unsigned char room[40];
    unsigned char i;
    for (i = 0; i < 40; i++) room[i] = n;
    depth = n;
    return n == 0 ? room[3] : eat(n - 1) + room[n & 31];
}
void main(void) { P1 = eat(12); while (1) PCON |= 1; }
"""


def test_firmware_whose_local_variables_leave_ram_is_caught(tmp_path):
    """No PUSH goes past FFh: SDCC's reentrant functions add to SP."""
    machine = Alone(load_hex(build(tmp_path, DYING, "--stack-auto", "--debug")))
    machine.run(max_cycles=200_000)
    assert [fault.kind for fault in machine.faults][:1] == [OVER]
    assert machine.faults[0].symbol == "_eat"
