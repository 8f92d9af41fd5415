"""MOVX on a board of parts: RAM, latches, buffers, and the pins that a bus cycle moves."""

import pytest

from miro_robot.board_spec import BoardSpec, BufferSpec, LatchSpec, PartSpec
from miro_robot.build import board_of
from miro_robot.faults import FaultKind
from miro_robot.image import ImageError, load_hex
from miro_robot.mcs51.chips import CHIPS
from miro_robot.mcs51.cpu import STOPPED
from miro_robot.parts.keys import RELEASED
from miro_robot.parts.led import Led
from tests.robot.mcs51.asm import image_of
from tests.robot.parts.scripted import A, B, D, W, scripted, wired
from tests.robot.parts.scripted import board_of as board_with
from tests.states import restore, snapshot

LED = PartSpec(keys=Led(active="high"), pins={"pin": "CTRL.3"})
WRITE = "MOV DPTR,#{:05X}h\nMOV A,#{:03X}h\nMOVX @DPTR,A\n"


def store(address, value):
    return WRITE.format(address, value)


def made(program, **keys):
    board = board_of(BoardSpec(**keys), image_of(f"{program}\nSJMP $"))
    board.cpu.rxd.settled_tick = 1 << 60
    board.run(12 * 60)
    return board


# The pins of a bus cycle


def test_a_write_moves_the_pins_at_the_ticks_of_the_sheet():
    part = scripted("a")
    netlist = wired({(0, 0): "data", (2, 0): "page", (3, 6): "wr"}, [{A: "data", B: "page", W: "wr"}])
    board = board_with(store(0xFEFE, 1) + "SJMP $", netlist, [part])
    board.run(120)
    assert [(call[0] - 36, call[2]) for call in part.heard] == [
        (8, 1 << A | 1 << B),
        (10, 1 << A),
        (12, 1 << W),
        (18, 1 << W),
        (20, 1 << B),
    ]


def test_a_read_samples_what_parts_put_on_p0():
    part = scripted("a", [(12 * 2 + 17, D, 0), (12 * 2 + 18, D, RELEASED)])
    netlist = wired({(0, 4): "data", (3, 7): "rd"}, [{D: "data", A: "rd"}])
    board = board_with("MOV DPTR,#1234h\nMOVX A,@DPTR\nSJMP $", netlist, [part], spec=BoardSpec(xram="none"))
    board.run(120)
    assert board.cpu.a == 0xEF
    assert [call[0] - 24 for call in part.heard if call[2] >> A & 1] == [12, 18]


@pytest.mark.parametrize("ticks", range(24 - 12, 24 + 24))
def test_a_part_is_never_called_for_a_tick_that_is_over(ticks):
    part = scripted("a", [(ticks, D, 0)])
    netlist = wired({(0, 0): "data", (2, 0): "page", (0, 1): "own"}, [{A: "data", B: "page", D: "own"}])
    whole, cut = (
        board_with(f"MOV DPTR,#0FEFEh\nMOVX @DPTR,A\n{store(0, 0)}SJMP $", netlist, [part])
        for part in (part, scripted("a", [(ticks, D, 0)]))
    )
    whole.run(240)
    for tick in range(1, 241):
        cut.run(tick)
    heard = [call[0] for call in part.heard]
    assert heard == sorted(heard)
    assert ticks in heard
    assert snapshot(whole) == snapshot(cut)


# Latches and buffers

CTRL = {"CTRL": LatchSpec(address=0x8000, mask=0xC000, initial=0x00)}


def test_a_latch_stores_what_is_written_to_its_addresses():
    board = made(store(0xBFFF, 8) + store(0x7FFF, 0), latches=CTRL, parts={"led": LED}, xram="none")
    assert board.value("led", "on") == 1
    assert board.value("led", "flashes") == 1


def test_a_latch_is_saved_kept_over_a_reset_and_begins_anew_with_the_supply():
    board, other = (made(store(0x8000, 8), latches=CTRL, parts={"led": LED}, xram="none") for _ in range(2))
    board.set_reset(1)
    board.run(12 * 80)
    assert board.value("led", "on") == 1
    restore(other, snapshot(board))
    assert snapshot(other) == snapshot(board)
    assert other.nets.levels[other.nets.number("led.pin")] == 1
    board.set_reset(0)
    board.set_power(0)
    board.set_power(1)
    assert board.value("led", "on") == 0


def test_a_buffer_gives_the_levels_of_its_nets():
    keys = {"KEYS": BufferSpec(address=0x4000, mask=0xC000, pins=("P1.0", *("P1.1",) * 6, "P1.2"))}
    board = made("MOV P1,#0F8h\nSETB P1.1\nMOV DPTR,#4000h\nMOVX A,@DPTR", buffers=keys, xram="none")
    assert board.cpu.a == 0x7E


# RAM

READ_BACK = "MOV DPTR,#{0}\nMOV A,#5Ah\nMOVX @DPTR,A\nCLR A\nMOVX A,@DPTR"


@pytest.mark.parametrize(
    ("keys", "address", "value"),
    [
        ({"xram": "none"}, "0", 0xFF),
        ({"xram": "external"}, "0FFFFh", 0x5A),
        ({"xram": "external", "xram_bytes": 0x2000}, "1FFFh", 0x5A),
        ({"xram": "external", "xram_bytes": 0x2000}, "2000h", 0xFF),
        ({"xram": "internal", "chip": "stc89c52"}, "0FFh", 0x5A),
        ({"xram": "internal", "chip": "stc89c52"}, "100h", 0xFF),
    ],
)
@pytest.mark.parametrize(
    "parts", [{}, {"led": PartSpec(keys=Led(), pins={"pin": "P1.0"})}], ids=["empty", "led"]
)
def test_movx_reaches_the_ram_that_is_there(keys, address, value, parts):
    board = made(READ_BACK.format(address), **keys, parts=parts)
    assert board.cpu.a == value
    assert not board.faults


def test_ram_on_the_chip_needs_no_bus():
    program = "MOV P3,#3Fh\nMOV P2,#12h\nMOV P0,#77h\nMOV R0,#9\nMOV A,#5Ah\nMOVX @R0,A\nCLR A\nMOVX A,@R0\nMOV R7,P0"
    board = made(program, xram="internal", chip="stc89c52", of_file=True)
    assert (board.cpu.a, board.cpu.peek_iram(7)) == (0x5A, 0x77)
    assert board.xram()[9] == 0x5A


@pytest.mark.parametrize(
    ("port", "line", "word"), [("6", "MOVX @DPTR,A", "write"), ("7", "MOVX A,@DPTR", "read")]
)
def test_a_movx_without_its_strobe_is_a_fault_where_that_is_asked_for(port, line, word):
    program = f"CLR P3.{port}\nMOV DPTR,#1234h\n{line}\nSJMP $"
    board = board_of(BoardSpec(of_file=True), image_of(program))
    assert board.run(1_000) == STOPPED
    (fault,) = board.faults
    assert (fault.kind, fault.detail) == (
        FaultKind.MOVX_WITHOUT_STROBE,
        f"MOVX {word} of 0x1234, P3.{port} is 0",
    )
    assert not made(program).faults


# Chips


def test_the_stack_ends_with_the_ram_of_the_chip():
    program = "MOV SP,#7Dh\nPUSH ACC\nPUSH ACC\nPUSH ACC\nSJMP $"
    board = board_of(BoardSpec(chip="at89c51"), image_of(program))
    assert board.run(1_000) == STOPPED
    assert board.faults[0].detail == "SP 80h, its stack is 01h to 7Fh"
    assert not made(program, chip="at89c52").faults


def test_a_chip_without_timer_2_has_no_registers_of_it():
    program = "MOV T2CON,#4\nMOV TH2,#12h\nMOV A,TH2\nMOV R7,T2CON"
    board = made(program, chip="at89c51")
    assert (board.cpu.a, board.cpu.peek_iram(7)) == (0xFF, 0xFF)
    assert made(program).cpu.a == 0x12


def test_every_chip_has_flash_and_ram():
    assert all(chip.flash_bytes in (4096, 8192) and chip.iram_bytes in (128, 256) for chip in CHIPS.values())


def test_code_beyond_the_flash_of_a_chip_is_refused(tmp_path):
    image = tmp_path / "big.hex"
    image.write_text(":01100000005F\n:00000001FF\n".replace("5F", "EF"))
    with pytest.raises(
        ImageError, match=r"0x1000 does not fit 4096 bytes; the AT89C51 has 4 KB of flash \(0x0000-0x0fff\)"
    ):
        load_hex(image, CHIPS["at89c51"].flash_bytes)
