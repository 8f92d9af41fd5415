"""Each entry of `disagreements.csv` shown on both machines, so that it cannot go stale."""

import csv
import re
from pathlib import Path

import pytest

from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.xram import XramBus
from tests.robot.mcs51.asm import assemble
from tests.robot.ucsim import exclusions, lockstep, s51

CPU_TESTS = Path(__file__).parents[1] / "mcs51"
with (Path(__file__).parent / "disagreements.csv").open(encoding="utf-8", newline="") as table:
    LISTED = [(name, *held.strip("`").split("::")) for name, *_, held in list(csv.reader(table))[1:]]
"""Name, file and test of each entry."""
pytestmark = pytest.mark.skipif(not s51.installed(), reason="needs ucsim's s51")

ISRS = "LJMP 40h\nORG 0003h\nSJMP 0003h\nORG 000Bh\nSJMP 000Bh\nORG 0040h\n"
# name, program (a line: an instruction to execute), what is looked at, data sheet, ucsim (None: it stops)
CASES = [
    ("bank-by-bit", "SETB RS0\nMOV R0,#55h", "iram 08", 0x55, 0x00),
    ("parity-write", "MOV A,#1\nMOV PSW,#0", "sfr D0", 0x01, 0x00),
    ("p0-after-movx", "MOV P0,#12h\nMOVX @DPTR,A", "sfr 80", 0xFF, 0x12),
    ("movx-strobe", "MOV A,#5\nMOVX @DPTR,A\nMOV P3,#7Fh\nMOVX A,@DPTR", "sfr E0", 0xFF, 0x05),
    ("stack-wrap", "MOV SP,#0FFh\nPUSH ACC\nMOV A,#1", "sfr E0", 0x01, None),
    ("pc-wrap", "LJMP 0FFF0h\nORG 0FFF0h\nDB 80h,0Eh", "pc", 0x0000, 0x10000),
    ("movc-wrap", "MOV DPTR,#0FFFFh\nMOV A,#1\nMOVC A,@A+DPTR", "sfr E0", 0x90, 0x00),
    ("level-interrupt", "CLR 0B2h\nNOP\nSETB 0B2h\nNOP", "sfr 88", 0x00, 0x02),
    ("early-write", "MOV TMOD,#1\nMOV TCON,#10h", "sfr 8A", 0x00, 0x01),
    ("late-read", "MOV TMOD,#1\nSETB TR0\nMOV A,#2\nCJNE A,TL0,0Ah\nNOP", "sfr D0", 0x01, 0x81),
    ("counted-edges", "MOV TMOD,#4\nSETB TR0\nCLR 0B4h\nNOP\nNOP", "sfr 8A", 0x01, 0x00),
    ("mode-0-low", "MOV TL0,#0FEh\nSETB TR0\nNOP\nNOP", "sfr 8A", 0xE0, 0x00),
    ("timer-1-beside-mode-3", "MOV TMOD,#13h\nMUL AB", "sfr 8B", 0x04, 0x00),
    ("t2ex-memory", "CLR 91h\nNOP\nSETB 0CBh\nNOP", "sfr C8", 0x08, 0x48),
    ("absent-bits", "MOV IP,#0FFh", "sfr B8", 0x3F, 0xFF),
    ("serial-port", "MOV SCON,#80h\nMOV SBUF,#55h" + "\nMUL AB" * 10, "sfr 98", 0x80, 0x82),
    ("count-down", "MOV T2MOD,#1\nMOV TL2,#10h\nCLR 91h\nSETB TR2\nNOP\nNOP", "sfr CC", 0x0E, 0x12),
    ("interrupt-latency", "MOV IE,#82h\nSETB TF0", "pc", 0x0005, 0x000C),
    # SP: the high one first and alone, or the low one first and the high one within it
    ("interrupt-priority", ISRS + "MOV IP,#2\nMOV TCON,#23h\nMOV IE,#83h\nNOP\nNOP", "sfr 81", 0x09, 0x0B),
    ("interrupt-delay", ISRS + "MOV IE,#2\nSETB TF0\nSETB EA\nINC 30h\nNOP\nNOP", "iram 30", 0x01, 0x00),
]


def steps_of(text):
    return sum(1 for line in text.splitlines() if not line.startswith("ORG"))


def test_every_disagreement_is_shown():
    assert [case[0] for case in CASES] == [name for name, _, _ in LISTED]


@pytest.mark.parametrize(("_", "file", "test"), LISTED, ids=[name for name, _, _ in LISTED])
def test_each_is_held_to_the_data_sheet_by_a_test_of_its_own(_, file, test):
    assert f"\ndef {test}(" in (CPU_TESTS / file).read_text()


def test_each_says_where_it_is_kept_out_of_the_comparison():
    """The comments of `exclusions.py` and `lockstep.py` name the entry that a rule is there for."""
    rules = Path(exclusions.__file__).read_text() + Path(lockstep.__file__).read_text()
    comments = " ".join(re.findall(r"#(.*)", rules))
    assert [name for name, _, _ in LISTED if name not in comments] == []


@pytest.mark.parametrize(("name", "text", "place", "sheet", "_"), CASES, ids=[case[0] for case in CASES])
def test_ours_does_what_the_data_sheet_says(name, text, place, sheet, _):
    cpu = Cpu(XramBus())
    cpu.load(assemble(text).ljust(0x10000, b"\x00"))
    for _ in range(steps_of(text)):
        cpu.step()
    memory, _, address = place.partition(" ")
    if memory == "pc":
        assert cpu.pc == sheet
    else:
        look = cpu.sfr if memory == "sfr" else cpu.peek_iram
        assert look(int(address, 16)) == sheet


@pytest.mark.slow
def test_ucsim_does_not():
    differing = {}
    for name, text, place, sheet, _ in CASES:
        steps = ["step"] * steps_of(text)
        memory, _, address = place.partition(" ")
        look = "state" if memory == "pc" else f"dump /b {memory} 0x{address} 0x{address}"
        output = s51.run(assemble(text).ljust(0x10000, b"\x00"), ["fill iram 0 255 0", *steps, look])
        if memory == "pc":
            stops = re.findall(rb"Stop at 0x([0-9a-f]+)", output)
            differing[name] = int(stops[-1], 16)
        elif b"Stack overflow" in output:
            differing[name] = None
        else:
            differing[name] = s51.Reader(output).raw(look, 1)[0]
        assert differing[name] != sheet, name
    assert differing == {case[0]: case[4] for case in CASES}
