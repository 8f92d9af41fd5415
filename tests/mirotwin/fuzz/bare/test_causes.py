"""Crashes of one mistake are one crash: told apart by the instruction that went wrong, not by where the fault was."""

import random

import pytest

from miro_robot.image.debug_info import Sources
from mirotwin.fuzz.board_target import BoardTarget
from mirotwin.fuzz.cause import Cause
from mirotwin.fuzz.files import CampaignFolder
from mirotwin.fuzz.input_coverage import InputCoverage
from mirotwin.fuzz.oracle import BoardOracle
from mirotwin.fuzz.triage import Triage
from tests.mirotwin.verify.firmwares import SERIAL, image
from tests.mirotwin.verify.own_checks import check_of
from tests.robot.mcs51.asm import assemble

OVERFLOWS = f"""
LJMP main
ORG 40h
main:
MOV SP,#50h
{SERIAL}
again:
ACALL line
ACALL other
SJMP again
line:
MOV R0,#48h
more:
JNB RI,$
CLR RI
MOV A,SBUF
CJNE A,#2Eh,keep
RET
keep:
MOV @R0,A
INC R0
SJMP more
other:
CJNE A,#21h,fine
MOV DPTR,#4000h
CLR A
JMP @A+DPTR
fine:
RET
"""
"""Takes a line up to `.` into 8 bytes below its stack, whose return addresses a longer one overwrites."""
STORE = assemble(OVERFLOWS).index(bytes.fromhex("F608"))  # MOV @R0,A; INC R0
RNG = random.Random(16)
LONG = [bytes(RNG.randrange(0x30, 0x100) for _ in range(RNG.randrange(11, 24))) + b"." for _ in range(40)]


def triage_of(text, tmp_path, checks=()):
    target = BoardTarget(image(text), "bytes", checks=checks)
    reached = InputCoverage(image(text), lambda: BoardTarget(image(text), "bytes", checks=checks))
    oracle = BoardOracle(target, {})
    return Triage(reached, oracle, CampaignFolder(tmp_path / "out"), Sources([]), minimise_s=1.0)


def test_an_overflow_is_one_crash_wherever_it_ends(tmp_path):
    triage = triage_of(OVERFLOWS, tmp_path)
    failing = [data for data in LONG if triage.target.run(data)]
    places = {triage.target.failure.pc for data in failing if triage.target.run(data)}
    assert len(places) > 5
    for data in failing:
        triage.take(data)
    (crash,) = triage.found
    assert (crash.name, crash.pc, crash.cause) == (
        f"no_fault-{STORE:04x}",
        STORE,
        "overwrites a return address",
    )
    assert crash.confirmed
    assert triage.more[crash.name] == len(failing) - 1
    assert {path.name.partition(".")[0] for path in (tmp_path / "out" / "crashes").iterdir()} == {crash.name}


def test_another_mistake_is_another_crash(tmp_path):
    triage = triage_of(OVERFLOWS, tmp_path)
    for data in (LONG[0], b"a.", b"!.", b"abc!."):
        if triage.target.run(data):
            triage.take(data)
    assert [crash.cause for crash in triage.found] == ["overwrites a return address"]
    jumps = OVERFLOWS.replace("ACALL other", "MOV A,47h\nACALL other").replace(
        "MOV @R0,A", "MOV 47h,A\nMOV @R0,A"
    )
    triage = triage_of(jumps, tmp_path / "second")
    for data in (LONG[0], b"!.", b"ab!.", LONG[1]):
        assert triage.target.run(data)
        triage.take(data)
    assert [crash.cause for crash in triage.found] == [
        "overwrites a return address",
        "goes where no program is",
    ]
    assert [triage.more[crash.name] for crash in triage.found] == [1, 1]


@pytest.mark.parametrize("jump", ["LJMP 1800h", "LCALL 1800h", "MOV A,48h"])
def test_whatever_leads_out_of_the_image_is_the_cause_and_not_the_place_outside(tmp_path, jump):
    """A jump, a call, or the last instruction that nothing follows."""
    text = OVERFLOWS.replace("MOV DPTR,#4000h", "LJMP out").replace("CJNE A,#21h", "MOV A,48h\nCJNE A,#21h")
    text += f"ORG 0300h\nout:\n{jump}\n"
    triage = triage_of(text, tmp_path)
    assert triage.target.run(b"!.")
    assert triage.target.failure.pc != 0x300
    assert triage.reached.cause(b"!.", triage.target.failure.pc) == Cause(0x300, "goes where no program is")


def test_a_fault_that_nothing_went_before_is_its_own_cause(tmp_path):
    text = OVERFLOWS.replace("MOV DPTR,#4000h", "DB 0A5h\nMOV DPTR,#4000h").replace(
        "CJNE A,#21h", "MOV A,48h\nCJNE A,#21h"
    )
    triage = triage_of(text, tmp_path)
    assert triage.target.run(b"!.")
    pc = triage.target.failure.pc
    assert triage.reached.cause(b"!.", pc) == Cause(pc)
    assert triage.take(b"!.").pc == pc


@pytest.mark.parametrize("said", ["the level is {}", "the level is 0x{:x}", "{}.25 ms late"])
def test_what_a_check_says_tells_crashes_apart_without_its_numbers(tmp_path, said):
    def judge(monitor):
        heard = monitor.received_bytes
        if b"q" in heard:
            return said.format(len(heard))
        return "no q, but an x" if b"x" in heard else None

    triage = triage_of(OVERFLOWS, tmp_path, [check_of("judge", judge)])
    for data in (b"q.", b"aq.", b"aaq.", b"x.", b"ax."):
        assert triage.target.run(data)
        triage.take(data)
    assert len(triage.found) == 2
    assert len(triage.found) + triage.more.total() == 5
