"""How deep the stack goes at least, read from the code: what no run of the image may contradict."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.inspect.stack_depth import StackReader
from tests.robot.mcs51.asm import image_of
from tests.robot.mcs51.rig import cpu_with


def depth(text):
    return StackReader(image_of(text)).all()


@pytest.mark.parametrize(
    ("text", "size"),
    [
        ("end:\nSJMP end", 0),
        ("PUSH ACC\nend:\nSJMP end", 1),
        ("LCALL f\nend:\nSJMP end\nf:\nRET", 2),
        (
            "LCALL f\nend:\nSJMP end\nf:\nPUSH ACC\nPUSH B\nLCALL g\nPOP B\nPOP ACC\nRET\ng:\nPUSH ACC\nPOP ACC\nRET",
            7,
        ),
        ("JZ over\nPUSH ACC\nover:\nPUSH B\nend:\nSJMP end", 2),
        ("MOV A,SP\nADD A,#28h\nMOV SP,A\nend:\nSJMP end", 0x28),
        (
            "PUSH 08h\nMOV 08h,SP\nMOV A,SP\nADD A,#28h\nMOV SP,A\nMOV SP,08h\nPOP 08h\nPUSH ACC\nend:\nSJMP end",
            0x29,
        ),
        (
            "PUSH 08h\nMOV A,SP\nMOV 08h,A\nADD A,#28h\nMOV SP,A\nMOV SP,08h\nPOP 08h\nPUSH ACC\nend:\nSJMP end",
            0x29,
        ),
        ("INC SP\nINC SP\nDEC SP\nend:\nSJMP end", 2),
    ],
)
def test_the_deepest_way_counts(text, size):
    found = depth(text)
    assert (found.main.size, found.unknown) == (size, frozenset())


def test_the_deepest_interrupt_comes_on_top():
    text = "LJMP main\nORG 0Bh\nPUSH ACC\nPOP ACC\nRETI\nORG 23h\nLJMP isr\nmain:\nLCALL f\nend:\nSJMP end\nf:\nRET\n"
    found = depth(text + "isr:\nPUSH ACC\nPUSH PSW\nPOP PSW\nPOP ACC\nRETI")
    assert (found.main.size, found.interrupt.size, found.size) == (2, 2, 6)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("f:\nLCALL f\nRET", "recursion"),
        ("JMP @A+DPTR", "a jump by a table"),
        ("MOV SP,A\nend:\nSJMP end", "SP set by a value that is not known"),
        ("again:\nPUSH ACC\nSJMP again", "a loop that fills the stack"),
    ],
)
def test_what_cannot_be_told_is_said(text, said):
    assert said in depth(text).unknown


def test_each_instruction_that_makes_room_has_its_height():
    heights = StackReader(image_of("PUSH ACC\nMOV A,SP\nADD A,#28h\nMOV SP,A\nend:\nSJMP end")).heights(0)
    assert heights == {0: 0, 2: 1, 4: 1, 6: 1, 8: 0x29}


@pytest.mark.parametrize("jump", ["LJMP", "SJMP"])
def test_the_jumps_of_a_table_are_followed(jump):
    table = f"JMP @A+DPTR\n{jump} one\n{jump} two\n"
    text = "one:\nPUSH ACC\nend:\nSJMP end\ntwo:\nPUSH ACC\nPUSH B\nSJMP end"
    assert depth(table + text).main.size == 2


PARTS = st.lists(st.sampled_from(["PUSH ACC", "POP B", "INC SP", "DEC SP", "NOP", "LCALL f"]), max_size=30)


@given(PARTS)
def test_no_run_is_deeper_than_what_was_read_of_its_code(parts):
    text = "\n".join([*parts, "end:", "SJMP end", "f:", "PUSH ACC", "POP ACC", "RET"])
    cpu = cpu_with(text)
    heights = [cpu.sp - 7]
    while cpu.code_at(cpu.pc) != 0x80:  # the SJMP at the end
        cpu.step()
        heights.append(((cpu.sp - 7) ^ 0x80) - 0x80)
    assert depth(text).main.size == max(0, *heights)


def test_the_robots_own_firmware_is_read_and_no_run_is_shallower_than_a_call():
    own = load_hex(image_path())
    found = StackReader(own).all()
    first, last = own.symbols.stack
    assert 4 < found.size < last - first
    assert found.unknown <= {"a jump by a table"}
