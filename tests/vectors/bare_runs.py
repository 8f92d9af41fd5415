"""Ten runs of `fw run` and ten cases of `fuzz --bare`, by name: what `tests.vectors.bare_states` freezes.

Programs are assembled by `tests.robot.mcs51.asm`, or committed beside this file: no compiler is needed.
"""

from pathlib import Path
from typing import NamedTuple

from tests.children import ROOT
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.verify.firmwares import POLLS, SERIAL, SLEEPS
from tests.robot.mcs51.asm import assemble
from tests.vectors.paths import CASES

PROMPTS = f"""MOV R0,#40h
{SERIAL}
prompt:
MOV SBUF,#3Eh
JNB TI,$
CLR TI
JNB RI,$
MOV A,SBUF
CLR RI
MOV @R0,A
INC R0
CJNE A,#0Dh,prompt
MOV PCON,#02h
"""
"""Sends `>` and stores a character, until a carriage return; then it powers down."""

SLOW = f"""MOV R0,#40h
{SERIAL}
loop:
JNB RI,$
MOV @R0,SBUF
INC R0
MOV R7,#12
work:
MOV R6,#100
DJNZ R6,$
DJNZ R7,work
CLR RI
SJMP loop
"""
"""Works on each character for longer than it lasts."""

MEASURES = """
JB RXD,$
loop:
INC 30h
MOV R7,#2
DJNZ R7,$
JNB RXD,loop
SJMP $
"""
"""Measures the start bit of the first character by polling RXD."""

WRITES = """
MOV DPTR,#9000h
MOV A,#74h
MOVX @DPTR,A
INC DPTR
MOV A,#33h
MOVX @DPTR,A
INC DPTR
MOV A,#22h
MOVX @DPTR,A
LCALL 9000h
SJMP $
"""
"""Writes a subroutine into its RAM and calls it."""

UNDEFINED = "loop:\nDB 0A5h\nMOV SBUF,A\nINC A\nSJMP loop"
"""Executes an undefined opcode again and again."""

ENDS = f"{SERIAL}MOV SBUF,#41h\nJNB TI,$\nCLR TI\nMOV SBUF,#42h\nSJMP $"
SLOWER = SLEEPS.replace("LJMP 4000h", "MOV R7,#0FFh\nDJNZ R7,$\nLJMP 4000h")


class Run(NamedTuple):
    """`mirotwin fw run PROGRAM OPTIONS`; `inputs`: files that the options name, by name. `program`: text, or a path."""

    program: str | Path
    options: str = ""
    inputs: dict[str, str] = {}
    origin: int = 0


RUNS = {
    "robot firmware to main": Run(
        ROOT / "robot_fw/miro_robot/firmware/miro.ihx", "--until main --max-cycles 100000"
    ),
    "robot firmware that hears characters": Run(
        ROOT / "examples/firmware/late.ihx", "--stdin IN --max-cycles 300000 --go-on", {"IN": "UUUU hello"}
    ),
    "fault that ends the run": Run(SLEEPS, "--stdin IN --stdin-gap 1ms", {"IN": "hello!more"}),
    "faults that do not end it": Run(UNDEFINED, "--go-on --max-cycles 100000"),
    "dialogue, line by line": Run(
        PROMPTS,
        "--stdin IN --stdin-when > --stdin-after 3ms --stdin-by-line --max-cycles 400000",
        {"IN": "one\ntwo\nthree\r\n"},
    ),
    "input that waits until it is taken": Run(
        SLOW, "--stdin IN --stdin-wait --max-cycles 60000", {"IN": "ABCDEF"}
    ),
    "polled bit rate, 11.0592 MHz": Run(
        MEASURES,
        "--stdin IN --stdin-after 20ms --baud 1200 --crystal 11059200 --max-cycles 200000",
        {"IN": " "},
    ),
    "pins and an interrupt": Run(
        CASES / "ret-in-interrupt.ihx", f"--pins {CASES / 'int0.pins'} --max-cycles 400000"
    ),
    "code in XRAM, from a start address": Run(WRITES, "--code-in-xram --start 0x8000", origin=0x8000),
    "end of the program behind its last character": Run(ENDS, "--crystal 12000000"),
}


class Case(NamedTuple):
    """What a target finds in `data`, as a file, played again on `program`, or on `other` if that is given.

    `data` may be the path of a case that is committed. `check`: a name in `bare_adapter.CHECKS`.
    """

    program: str | Path
    data: bytes | Path
    input: str = "bytes"
    check: str = ""
    crystal_hz: int = 24_000_000
    baud: int = 0
    other: str = ""


CASES_OF_TARGETS = {
    "no_fault, asleep": Case(SLEEPS, b"ab!"),
    "no_fault, polling at 11.0592 MHz and 9600 baud": Case(POLLS, b"xyz!", crystal_hz=11_059_200, baud=9600),
    "never_sleeps": Case(SLEEPS, b"ab?"),
    "never_sleeps that is mended": Case(SLEEPS, b"a?", other=SLEEPS.replace("stuck:\nSJMP stuck", "RETI")),
    "no_fault that comes later in another build": Case(SLEEPS, b"ab!", other=SLOWER),
    "check in a file": Case(SLEEPS, b"abc", check="too_long"),
    "check in a file, polling": Case(POLLS, b"\x02abc", "frames", "counts"),
    "resets, pauses and a bad stop bit": Case(
        SLEEPS, b"\x09\x01ab" + b"\x0a\x05" + b"\x0e\x00\x07\x01c!" + b"\x09\x00!", "session"
    ),
    "stream without an end": Case(CASES / "jumps-out.ihx", CASES / "bare-no-end.stream"),
    "stream with an end": Case(CASES / "jumps-out.ihx", CASES / "bare-with-end.stream"),
}


def program_of(program, folder, name="program.ihx", origin=0):
    """Path of an image: text is assembled into `folder`."""
    if isinstance(program, Path):
        return program
    return hex_file(folder / name, assemble(program, origin), origin)
