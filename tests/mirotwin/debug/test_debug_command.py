"""`mirotwin debug`: what it takes, what it prints, and how it refuses."""

import os
import shutil

import pytest

from miro_robot.firmware import image_path
from tests import children
from tests.mirotwin.debug.runs import robot_run
from tests.mirotwin.debug.test_dap import MIROTWIN
from tests.mirotwin.verify.bare.firmwares import SLEEPS
from tests.mirotwin.verify.bare.test_case import CHECK
from tests.mirotwin.verify.bare.test_case import case as bare_case
from tests.robot.mcs51.asm import assemble

ASM = """
LJMP main
ORG 0Bh
INC 30h
RETI
ORG 30h
main:
MOV SP,#50h
MOV IE,#82h
MOV TMOD,#02h
SETB TR0
again:
LCALL twice
INC 31h
SJMP again
twice:
PUSH ACC
INC 32h
POP ACC
RET
"""


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """An image in assembler without symbols."""
    path = tmp_path_factory.mktemp("bare") / "bare.ihx"
    path.write_text(hex_text(assemble(ASM)))
    return path


def hex_text(code):
    records = []
    for at in range(0, len(code), 16):
        data = code[at : at + 16]
        record = bytes([len(data), at >> 8, at & 0xFF, 0]) + data
        records.append(f":{record.hex().upper()}{-sum(record) & 0xFF:02X}\n")
    return "".join(records) + ":00000001FF\n"


def commands(*lines):
    return [word for line in lines for word in ("-x", line)]


def test_a_scenario_is_stepped_through_forwards_and_backwards(mirotwin):
    code, out, err = mirotwin(
        "debug",
        "fig6",
        *commands("break failsafe.c:146 if age >= 20", "continue", "where", "next", "rn", "who age"),
    )
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert "breakpoint 1: failsafe.c:146 in failsafe_tick   if (age == FAILSAFE_STOP_MS) {" in lines[4]
    assert lines[6:8] == ["*#0  failsafe.c:146 in failsafe_tick", " #1  main.c:49 in main"]
    assert lines[11].partition("  ")[0] == lines[4].partition("  ")[0]
    assert lines[14] == " #0  failsafe.c:145 in failsafe_tick"


def test_a_recording_opens_at_a_time(mirotwin, finished):
    code, out, err = mirotwin(
        "debug", finished, "--at", "100ms", "--slot", 2, *commands("print tick >= 2400000")
    )
    assert (code, err) == (0, "")
    assert "net0/robot2  goto: main.c:" in out
    assert out.endswith("= 1\n")


def test_a_saved_world_is_gone_on_from(mirotwin, tmp_path):
    world = robot_run().world
    world.run_to(1_200_000)
    saved = tmp_path / "at.world"
    saved.write_bytes(world.save())
    code, out, err = mirotwin(
        "debug", "fig6", "--seed", 7, "--resume", saved, *commands("print tick", "rcontinue")
    )
    assert (code, err) == (0, "")
    assert "tick = 1200" in out
    code, _, err = mirotwin("debug", "fig6", "--seed", 4, "--resume", saved, *commands("where"))
    assert code == 2
    assert "seed" in err
    code, _, err = mirotwin("debug", "fig6", "--resume", tmp_path, *commands("where"))
    assert (code, err) == (2, f"mirotwin: error: {tmp_path}: is a folder; name a file in it\n")


def test_an_image_without_symbols_has_addresses_and_says_so(mirotwin, bare):
    code, out, err = mirotwin(
        "debug",
        bare,
        *commands("break 0x0044", "c", "where", "rfinish", "step", "next", "rnext", "list"),
    )
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "no symbols: no .map or .cdb beside bare.ihx; places are addresses"
    assert " #0  0x0044 in " in out.replace("*", " ")
    assert " #1  0x003b in " in out


def test_a_case_stands_at_its_failed_check(mirotwin, finished, tmp_path):
    code, _, _ = mirotwin("conform", image_path(), "--rule", "P29", "--artifacts", tmp_path / "none")
    assert code == 0
    scenario = tmp_path / "late.scenario.toml"
    scenario.write_text(
        'scenario = "fig6"\nname = "late"\nset = { duration_s = 0.3 }\n[expect]\nframes_accepted_min = 50\n'
    )
    code, _, _ = mirotwin("test", scenario, "--artifacts", tmp_path / "out")
    assert code == 1
    folder = next(path.parent for path in (tmp_path / "out").rglob("case.stream"))
    code, out, err = mirotwin("debug", folder, *commands("where"))
    assert (code, err) == (0, "")
    assert out.startswith("fails as recorded: frames_accepted_min: net0/robot0: tick ")
    assert "  case: main.c:" in out


def test_a_case_of_a_bare_processor_stands_at_its_fault_and_goes_back(mirotwin, tmp_path):
    firmware = tmp_path / "sleeps.ihx"
    firmware.write_text(hex_text(assemble(SLEEPS)))
    file = bare_case(tmp_path, b"ab!")
    code, out, err = mirotwin(
        "debug",
        file,
        "--firmware",
        firmware,
        *commands("print tick", "rstepi", "rcontinue", "c", "print tick"),
    )
    assert (code, err) == (0, "")
    verdict = out.splitlines()[1]
    assert verdict.startswith("fails as recorded: no_fault: tick ")
    tick = verdict.split("tick ")[1].split()[0]
    assert f"firmware fault: firmware executed outside the loaded image at 0x4000, tick {tick}" in out
    assert "the run begins here: 0x0000 in reset" in out
    code, _, err = mirotwin("debug", file, *commands("where"))
    assert code == 2
    assert err.endswith("give --firmware IMAGE.ihx\n")


def test_a_case_whose_check_is_in_a_file_opens_with_it(mirotwin, tmp_path):
    firmware, check = tmp_path / "sleeps.ihx", tmp_path / "mine.py"
    firmware.write_text(hex_text(assemble(SLEEPS)))
    check.write_text(
        "def too_long(run):\n    return f'{len(run.sent)} are too many' if len(run.sent) > 2 else None\n"
    )
    file = bare_case(tmp_path, b"abc", check=CHECK)
    given = ("debug", file, "--firmware", firmware)
    code, out, err = mirotwin(*given, "--check", f"{check}:too_long", *commands("rstepi"))
    assert (code, err) == (0, "")
    assert out.splitlines()[1].startswith("fails as recorded: too_long: tick ")
    assert "  case: " in out
    code, _, err = mirotwin(*given, *commands("where"))
    assert (code, err.endswith("give it: --check FILE.py:too_long\n")) == (2, True)
    code, _, err = mirotwin("debug", "fig6", "--check", f"{check}:too_long", *commands("where"))
    assert (code, "is for a case of a bare processor" in err) == (2, True)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("break failsafe.c:9999", "no line has code from there on"),
        ("break nothing.c:3", "no code is of this file"),
        ("break foo", "no symbol foo"),
        ("break main if age >", "lacks a name or a number"),
        ("break main if agee > 3", "there is no agee; did you mean age?"),
        ("break main if tick > 3 && wire:placee", "there is no placee; did you mean place?"),
        ("watch age if lm629.left.status == nothing", "there is no nothing"),
        ("print nothing", "there is no nothing here"),
        ("print sp", "there is no sp here; did you mean SP?"),
        ("print seq", "there is no seq here; it is a local variable of telemetry_answer"),
        ("goto 12", "it has no unit"),
        ("until spaghetti", "is no condition"),
        ("until edge pin=nowhere", "is not a pin"),
        ("until edge 'pin", "No closing quotation"),
        ("until edge pins=txd", "until edge: pins: unknown key; did you mean pin?"),
        ("until answer slot=9", "until answer: slot: is out of range; must be <= 4"),
        ("until answer seq=x", "until answer: seq: expected a whole number, got a string"),
        ("next 3", "is more than next takes"),
        ("watch lm629.left.status", "lies in no memory that can be watched"),
        ("finish", "nothing called this function"),
        ("where 7", "there is no frame 7"),
        ("delete 5", "there is no breakpoint 5"),
        ("jump", "is no command"),
    ],
)
def test_a_command_that_cannot_be_done_is_one_line_and_exit_code_2(mirotwin, line, said):
    code, _, err = mirotwin("debug", "fig6", *commands(line))
    assert code == 2
    assert said in err
    assert err.count("\n") == 1


def test_a_condition_may_name_what_is_known_elsewhere(mirotwin):
    known = "place + _main + R3 + P1.0 + tick + lm629.left.status + iram[3]"
    code, _, err = mirotwin("debug", "fig6", *commands(f"break main if {known}"))
    assert (code, err) == (0, "")


def test_goto_goes_back_from_the_end_of_the_run(mirotwin):
    code, out, err = mirotwin("debug", "fig6", *commands("goto 9s", "goto 0s", "quit", "where"))
    assert (code, err) == (0, "")
    assert "\n6.0060000s  the run ends here: " in out
    assert out.splitlines()[-2:] == [
        "0.0000000s  goto: 0x0000 in reset   LJMP __sdcc_gsinit_startup",
        "(mirotwin) quit",
    ]


def test_a_line_without_code_moves_to_the_next_and_says_so(mirotwin):
    code, out, _ = mirotwin("debug", "fig6", *commands("break failsafe.c:100"))
    assert code == 0
    assert "(failsafe.c:100 has no code: the next line that has some)" in out


def test_debug_files_of_another_image_are_refused(mirotwin, bare, tmp_path):
    image = tmp_path / "bare.ihx"
    shutil.copy(bare, image)
    shutil.copy(image_path().with_suffix(".map"), image.with_suffix(".map"))
    code, _, err = mirotwin("debug", image, *commands("where"))
    assert code == 2
    assert "it belongs to another image" in err


@pytest.mark.skipif(shutil.which("sdcc") is None, reason="needs SDCC")
def test_debug_files_of_an_image_that_differs_in_a_constant_are_refused(mirotwin, tmp_path):
    for limit in (110, 125):
        text = f"unsigned char age; void main(void) {{ while (1) if (age == {limit}) age = 0; }}"
        (tmp_path / f"{limit}").mkdir()
        (tmp_path / f"{limit}" / "late.c").write_text(text)
        children.run(["sdcc", "-mmcs51", "--debug", "late.c"], cwd=tmp_path / f"{limit}", check=True)
    shutil.copy(tmp_path / "125" / "late.ihx", tmp_path / "110" / "late.ihx")
    code, _, err = mirotwin("debug", tmp_path / "110" / "late.ihx", *commands("where"))
    assert code == 2
    assert "late.rst" in err
    assert "is the listing of another image" in err


def test_lines_from_another_firmware_are_refused(mirotwin, finished, bare):
    code, _, err = mirotwin("debug", finished, "--lines-from", bare, *commands("where"))
    assert code == 2
    assert "is not a recorded image" in err


def test_until_goes_on_to_an_event(mirotwin):
    code, out, err = mirotwin(
        "debug", "fig6", *commands("until command name=STT side=left", "print lm629.left.mode")
    )
    assert (code, err) == (0, "")
    assert "net0/robot0: command left STT" in out


@pytest.mark.parametrize("what", ["fig6", "--dap"])
def test_a_closed_standard_input_is_told(what):
    words = [*MIROTWIN, what]
    done = children.run(words, preexec_fn=lambda: os.close(0), capture_output=True, text=True)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "stdin: is closed; " in done.stderr
