"""The stack of an image without a map: found in its start-up code."""

import pytest

from miro_robot.board_spec import BoardSpec
from miro_robot.empty_board import EmptyBoard
from miro_robot.faults import FaultKind
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.image.start_up import stack_set_up
from tests.robot.mcs51.asm import assemble, hex_text

KEIL = """
LJMP start
here:
SJMP here
start:
MOV R0,#7Fh
CLR A
loop:
MOV @R0,A
DJNZ R0,loop
MOV SP,#21h
LJMP here
"""


def image(tmp_path, program):
    path = tmp_path / "image.hex"
    path.write_text(hex_text(assemble(program)))
    return load_hex(path)


def test_it_begins_behind_what_the_start_up_code_puts_into_sp(tmp_path):
    found = image(tmp_path, KEIL).symbols
    assert found.stack == (0x22, 0xFF)
    assert found.stack_source == "MOV SP,#21h at 0x000b"


def test_the_start_up_code_of_the_robots_firmware_says_what_its_map_says():
    robot = load_hex(image_path())
    _, value = stack_set_up(robot.code, robot.used)
    assert value + 1 == robot.symbols.stack[0]
    assert robot.symbols.stack_source == "", "the map goes before"


@pytest.mark.parametrize(
    "program",
    [
        "here:\nSJMP here",
        KEIL + "MOV SP,#40h",
        KEIL + "MOV SP,A",
        KEIL + "MOV SP,30h",
        KEIL + "POP 81h",
        "RET",
        "loop:\nNOP\nSJMP loop\nMOV SP,#20h",
        "MOV SP,#0FFh\nNOP\nNOP",
    ],
)
def test_nothing_is_concluded_where_sp_is_set_nowhere_or_in_several_ways(tmp_path, program):
    found = image(tmp_path, program).symbols
    assert found.stack == (0, 0xFF)
    assert found.stack_source == ""


def test_data_and_frames_change_nothing(tmp_path):
    assert image(tmp_path, KEIL + "INC SP\nMOV A,SP\nMOV SP,#21h").symbols.stack == (0x22, 0xFF)


@pytest.mark.parametrize(
    ("program", "kind"),
    [
        ("POP 30h", FaultKind.STACK_UNDERFLOW),
        ("MOV R2,#200\npush:\nPUSH 30h\nDJNZ R2,push", FaultKind.STACK_OVERFLOW),
    ],
)
def test_leaving_it_is_a_fault_that_names_the_instruction(tmp_path, program, kind):
    made = EmptyBoard(BoardSpec(chip="at89c51"), image(tmp_path, f"MOV SP,#30h\n{program}\nhere:\nSJMP here"))
    made.cpu.rxd.settled_tick = 1 << 60
    made.run(12 * 2_000)
    (fault,) = made.faults
    assert fault.kind == kind
    assert fault.detail.endswith("its stack is 31h to 7Fh by MOV SP,#30h at 0x0000")


def test_a_given_start_goes_before(tmp_path):
    found = image(tmp_path, KEIL).symbols.with_stack(0x80)
    assert found.stack == (0x80, 0xFF)
    assert found.stack_source == ""
