"""`mirotwin debug`: what it takes, what it prints, and how it refuses."""

import os
import re
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from miro_robot.firmware import image_path
from mirotwin.debug.console import Console
from mirotwin.debug.debug_command import debug
from tests import children
from tests.mirotwin import program
from tests.mirotwin.conftest import hex_file, hex_text
from tests.mirotwin.debug.runs import ASM, robot_run
from tests.mirotwin.mutated_files import ECHO, ECHO_CDB, ECHO_MAP
from tests.mirotwin.verify.firmwares import SLEEPS
from tests.mirotwin.verify.own_checks import source_of
from tests.mirotwin.verify.test_board_case import CHECKS, WRONG
from tests.mirotwin.verify.test_board_case import case as bare_case
from tests.mutants.sdcc import needs_sdcc
from tests.robot.mcs51.asm import assemble


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """An image in assembler without symbols."""
    return hex_file(tmp_path_factory.mktemp("bare") / "bare.ihx", assemble(ASM))


def commands(*lines):
    return [word for line in lines for word in ("-x", line)]


@pytest.fixture
def console(mirotwin):
    """What a debugger prints that is given a subject with its options, and lines."""
    return lambda *words, lines: mirotwin.succeeds("debug", *words, *commands(*lines))


def test_a_scenario_is_stepped_through_forwards_and_backwards(console):
    moves = ("break failsafe.c:147 if age >= 20", "continue", "where", "next", "rn", "who age")
    lines = console("fig6", lines=moves).splitlines()
    assert "breakpoint 1: failsafe.c:147 in failsafe_tick   if (age == FAILSAFE_STOP_MS) {" in lines[4]
    assert lines[6:8] == ["*#0  0x0518  failsafe.c:147 in failsafe_tick", " #1  0x0102  main.c:50 in main"]
    assert lines[11].partition("  ")[0] == lines[4].partition("  ")[0]
    assert lines[14] == " #0  0x0510  failsafe.c:146 in failsafe_tick"


def test_a_list_is_around_the_line_asked_for_and_marks_the_one_it_stands_at(console):
    moves = ("break main.c:49", "continue", "list", "list main.c:46", "list failsafe.c:20")
    parts = console("fig6", lines=moves).split("(mirotwin) list")[1:]
    listed = [part.splitlines()[1:] for part in parts]
    numbers = [[int(line[2:].split()[0]) for line in lines] for lines in listed]
    assert numbers == [list(range(middle - 5, middle + 6)) for middle in (49, 46, 20)]
    marked = [
        [number for number, line in zip(*pair, strict=True) if line.startswith("=>")]
        for pair in zip(numbers, listed, strict=True)
    ]
    assert marked == [[49], [49], []]


def test_a_list_of_an_outer_frame_is_around_its_call(console):
    out = console("fig6", lines=["break failsafe_look", "continue", "frame 1", "list"])
    called = next(line for line in out.splitlines() if line.startswith("*#1")).split(":")[1].split()[0]
    assert f"\n=> {called:>4}  " in out


@pytest.mark.parametrize("step", ["step", "next"])
def test_a_step_passes_the_code_without_lines_before_main(console, step):
    lines = console("fig6", lines=[step, f"r{step}"]).splitlines()
    assert "  step: main.c:" in lines[2]
    assert "  the run begins here: 0x0000 in reset" in lines[4]


def test_a_recording_opens_at_a_time(console, finished):
    out = console(finished, "--at", "100ms", "--slot", 2, lines=["print tick >= 2400000"])
    assert "net0/robot2  goto: main.c:" in out
    assert out.endswith("= 1\n")


def test_a_saved_world_is_gone_on_from(mirotwin, console, tmp_path):
    world = robot_run().world
    world.run_to(1_200_000)
    saved = tmp_path / "at.world"
    saved.write_bytes(world.save())
    assert "tick = 1200" in console("fig6", "--seed", 7, "--resume", saved, lines=["print tick", "rcontinue"])
    assert "seed" in mirotwin.refuses("debug", "fig6", "--seed", 4, "--resume", saved, *commands("where"))
    err = mirotwin.refuses("debug", "fig6", "--resume", tmp_path, *commands("where"))
    assert err == f"{tmp_path}: is a folder; name a file in it"


def test_an_image_without_symbols_has_addresses_and_says_so(console, bare):
    out = console(bare, lines=["break 0x0044", "c", "where", "rfinish", "step", "next", "rnext", "list"])
    assert out.splitlines()[0] == "no symbols: no .map, .cdb or .M51 beside bare.ihx; places are addresses"
    assert " #0  0x0044 in " in out.replace("*", " ")
    assert " #1  0x003b in " in out


def test_a_bare_processor_has_no_chips_and_says_so(mirotwin, bare):
    err = mirotwin.ends(2, "debug", bare, *commands("print lm629.left"))
    assert "there is no lm629 here; it is a robot's, and this is the bare processor" in err


def test_a_case_stands_at_its_failed_check(mirotwin, console, tmp_path):
    scenario = tmp_path / "late.scenario.toml"
    text = 'scenario = "fig6"\nname = "late"\nset.duration_s = 0.3\nexpect.frames_accepted_min = 50\n'
    scenario.write_text(text)
    mirotwin.ends(1, "test", scenario, "--artifacts", tmp_path / "out")
    folder = next(path.parent for path in (tmp_path / "out").rglob("case.stream"))
    out = console(folder, lines=["where"])
    assert out.startswith("fails as recorded: frames_accepted_min: net0/robot0: tick ")
    assert "  case: main.c:" in out


def test_a_case_of_a_bare_processor_stands_at_its_fault_and_goes_back(mirotwin, console, tmp_path):
    firmware = hex_file(tmp_path / "sleeps.ihx", assemble(SLEEPS))
    file = bare_case(tmp_path, b"ab!")
    moves = ("print tick", "rstepi", "rcontinue", "c", "print tick")
    out = console(file, "--firmware", firmware, lines=moves)
    verdict = out.splitlines()[1]
    assert verdict.startswith("fails as recorded: no_fault: tick ")
    tick = verdict.split("tick ")[1].split()[0]
    assert f"firmware fault: firmware executed outside the loaded image at 0x4000, tick {tick}" in out
    assert "the run begins here: 0x0000 in reset" in out
    assert mirotwin.refuses("debug", file, *commands("where")).endswith("give --firmware IMAGE.ihx")


def test_a_case_of_a_bare_processor_is_waited_in_as_a_robots_world(mirotwin, console, tmp_path):
    firmware = hex_file(tmp_path / "sleeps.ihx", assemble(SLEEPS))
    out = console(
        bare_case(tmp_path, b"ab!"), "--firmware", firmware, lines=("rcontinue", "until received byte=0x62")
    )
    assert "received 62h" in out


def test_a_case_whose_check_is_in_a_file_opens_with_it(mirotwin, tmp_path):
    firmware, check = hex_file(tmp_path / "sleeps.ihx", assemble(SLEEPS)), tmp_path / "mine.py"
    check.write_text(source_of("TooLong", "too_long", *WRONG))
    file = bare_case(tmp_path, b"abc", checks=CHECKS)
    given = ("debug", file, "--firmware", firmware)
    out = mirotwin.succeeds(*given, "--expect", f"{check}:TooLong", *commands("rstepi"))
    assert out.splitlines()[1].startswith("fails as recorded: too_long: tick ")
    assert "  case: " in out
    err = mirotwin.refuses(*given, "--expect", "no_fault", *commands("where"))
    assert "expect.too_long: there is no such check; " in err
    assert "--expect FILE.py:CLASS takes one of your own" in err


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
        ("print P1.8", "P1 has no bit 8; give 0 to 7"),
        ("print failsafe:age.16", "failsafe:age has no bit 16; give 0 to 15"),
        ("print RI.1", "RI has no bit 1; give 0 to 0"),
        ("print lm629.left.pid.kpp", "lm629.left.pid has no member kpp; it has kp, ki"),
        ("print 1 + *age", "age is no array and no pointer"),
        ("print age[1]", "age is no array and no pointer"),
        ("goto 12", "it has no unit"),
        ("until spaghetti", "is no condition"),
        ("until edge pin=nowhere", "is not a pin"),
        ("until edge pin='txd", "No closing quotation"),
        ("until edge pins=txd", "until edge: pins: unknown key; did you mean pin?"),
        ("until answer slot=9", "until answer: slot: is out of range; must be <= 4"),
        ("until answer seq=x", "until answer: seq: expected a whole number, got a string"),
        ("finish 3", "is more than finish takes"),
        ("next often", "next: often is no number of times; give 1 to 1000000"),
        ("watch", "watch: lacks VAR; write watch VAR [if EXPR]"),
        ("print", "print: lacks EXPR; write print EXPR"),
        ("next 0", "next: 0 is no number of times"),
        ("watch lm629.left.status", "lies in no memory that can be watched"),
        ("finish", "nothing called this function"),
        ("frame 7", "there is no frame 7"),
        ("where x", "is no number of frames"),
        ("down", "it is the innermost one"),
        ("up", "it is the outermost one"),
        ("delete 5", "there is no breakpoint 5"),
        ("jump", "nothing can be changed here: that would be another run"),
        ("brake main", "brake: is no command; did you mean break?"),
        ("1 + 2", "1: is no command"),
        ("p/y age", "/y is no form; give one of x, d, u"),
        ("p/i age", "/i is no form"),
        ("x/8q age", "q is no form and no size"),
        ("x", "lacks a place"),
        ("x/-1x age", "is no form"),
        ("x/4xb 0x1234", "is no place in iram; name the memory"),
        ("x/300xb iram[0]", "iram ends at 0xff"),
        ("x/4i age", "instructions are in code, and this is in iram"),
        ("print $sq", "$sq is no register"),
        ("display nothing", "there is no nothing here"),
        ("undisplay 3", "there is no display 3"),
        ("info", "lacks what to show; there are breakpoints, "),
        ("info moon", "is not known"),
        ("info registers moon", "there is no moon here"),
        ("help moon", "is no command"),
        ("tbreak 9999", "no line has code from there on"),
        ("list *moon", "no symbol moon"),
    ],
)
def test_a_command_that_cannot_be_done_is_one_line_and_exit_code_2(mirotwin, line, said):
    err = mirotwin.ends(2, "debug", "fig6", *commands(line))
    assert (err.count("\n"), said in err) == (1, True)


def test_a_condition_may_name_what_is_known_elsewhere(console):
    known = "place + _main + R3 + P1.0 + tick + lm629.left.status + iram[3]"
    console("fig6", lines=[f"break main if {known}"])


def test_goto_goes_back_from_the_end_of_the_run(console):
    out = console("fig6", lines=["goto 9s", "goto 0s", "quit", "where"])
    assert "\n6.0060000s  the run ends here: " in out
    begin = "\n0.0000000s  goto: 0x0000 in reset   LJMP __sdcc_gsinit_startup\n"
    assert out.endswith(f"{begin}(mirotwin) quit\n")


def test_a_line_without_code_moves_to_the_next_and_says_so(console):
    out = console("fig6", lines=["break failsafe.c:101"])
    assert "(failsafe.c:101 has no code: the next line that has some)" in out


def test_debug_files_of_another_image_are_refused(mirotwin, bare, tmp_path):
    image = shutil.copy(bare, tmp_path)
    shutil.copy(image_path().with_suffix(".map"), tmp_path / "bare.map")
    assert "it belongs to another image" in mirotwin.refuses("debug", image, *commands("where"))


@needs_sdcc
def test_debug_files_of_an_image_that_differs_in_a_constant_are_refused(mirotwin, tmp_path):
    for limit in (110, 125):
        text = f"unsigned char age; void main(void) {{ while (1) if (age == {limit}) age = 0; }}"
        (tmp_path / f"{limit}").mkdir()
        (tmp_path / f"{limit}" / "late.c").write_text(text)
        children.run(["sdcc", "-mmcs51", "--debug", "late.c"], cwd=tmp_path / f"{limit}", check=True)
    shutil.copy(tmp_path / "125" / "late.ihx", tmp_path / "110" / "late.ihx")
    err = mirotwin.refuses("debug", tmp_path / "110" / "late.ihx", *commands("where"))
    assert "late.rst" in err
    assert "is the listing of another image" in err


def test_lines_from_another_firmware_are_refused(mirotwin, finished, bare):
    err = mirotwin.refuses("debug", finished, "--lines-from", bare, *commands("where"))
    assert "is not a recorded image" in err


@pytest.mark.parametrize("name", ["STT", '"STT"', "'STT' hex=''"])
def test_until_goes_on_to_an_event(console, name):
    out = console("fig6", lines=[f"until command name={name} side=left", "print lm629.left.mode"])
    assert "net0/robot0: command left STT" in out


def test_until_ends_where_the_run_of_an_image_does(console, bare):
    out = console(bare, "--max-cycles", 10, lines=["until heard"])
    assert out.splitlines()[-1].startswith("0.0000055s  no such event before the end")


def test_a_robots_case_is_stepped_on_to_the_end_of_its_last_control_period(console):
    case = Path(__file__).parents[2] / "vectors/cases/silent-case.stream"
    out = console(case, lines=["continue", "continue", "print tick"])
    assert "tick = 6406404" in out


def test_a_symbol_within_a_function_begins_no_other_one(console, tmp_path):
    for suffix, text in (".ihx", hex_text(ECHO)), (".cdb", ECHO_CDB), (".map", ECHO_MAP):
        (tmp_path / f"named{suffix}").write_text(text)
    out = console(tmp_path / "named.ihx", lines=["goto 1ms", "rstep"])  # it waits in line 5, at `loop`
    assert out.splitlines()[-1].startswith("0.0000045s  step: named.c:5")


@pytest.mark.parametrize("what", ["fig6", "--dap"])
def test_a_closed_standard_input_is_told(what):
    done = program.run("debug", what, preexec_fn=lambda: os.close(0))
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "stdin: is closed; " in done.stderr


def test_ctrl_c_ends_a_list_of_commands(monkeypatch):
    def interrupted(console, line):
        console.interrupted = True
        return False

    monkeypatch.setattr(Console, "onecmd", interrupted)
    done = CliRunner().invoke(debug, ["fig6", "-x", "continue", "-x", "print tick"])
    assert "continue" in done.output
    assert "print tick" not in done.output
    assert done.exit_code != 0


FAILING = """
scenario = "fig6"
duration_s = 0.3
[[step]]
wait_for = "frame"
within_ms = 100
[[step]]
wait_for = "command"
name = "RDSIGS"
within_ms = 50
"""


def test_it_stands_where_a_wait_expired_that_no_check_can_repeat(mirotwin, tmp_path):
    scenario = tmp_path / "wheels.scenario.toml"
    wait = 'wait_for = "wheels"\nleft_m_s = 0.6\nright_m_s = 0.6\nwithin_ms = 150\n'
    scenario.write_text(f'scenario = "silent"\nduration_s = 0.3\n[[step]]\npause_ms = 5\n[[step]]\n{wait}')
    out = mirotwin.succeeds("debug", scenario, "-x", "where")
    assert "step failed: step 2: wait_for wheels: tick 3720000" in out
    assert re.search(r"\n0\.15500\d\ds  case: ", out)


def test_a_scenario_with_steps_stands_at_the_step_that_fails_and_test_says_the_line(mirotwin, tmp_path):
    scenario = tmp_path / "steps.scenario.toml"
    scenario.write_text(FAILING.replace("duration_s = 0.3", 'name = "steps"\nset.duration_s = 0.3'))
    said = mirotwin("test", scenario, "--seed", 3)[1]
    line = f"    mirotwin debug {scenario} --seed 3\n"
    assert line in said
    words = line.split()[2:]
    out = mirotwin.succeeds("debug", *words, *commands("rcontinue"))
    assert "step failed: step 2: wait_for command: tick " in out
    assert "fails as recorded: happens: net0/robot0: tick " in out
    assert "  case: main.c:" in out
    assert "  the run begins here: " in out
    passing = tmp_path / "pass.scenario.toml"
    passing.write_text(
        scenario.read_text().replace("RDSIGS", "RDSTAT").replace("within_ms = 50", "within_ms = 250")
    )
    if "passed" in mirotwin("test", passing)[1]:
        assert "begin: 0x0000 in reset" in mirotwin.succeeds("debug", passing, *commands("where"))


def test_a_folder_of_artifacts_opens_its_only_case_and_names_several(mirotwin, console, tmp_path):
    for name in ("one", "two"):
        scenario = tmp_path / f"{name}.scenario.toml"
        scenario.write_text(
            f'scenario = "fig6"\nname = "{name}"\nset.duration_s = 0.3\nexpect.frames_accepted_min = 50\n'
        )
        mirotwin.ends(1, "test", scenario, "--artifacts", tmp_path / "left" / name)
    assert "fails as recorded: frames_accepted_min: " in console(tmp_path / "left" / "one", lines=["where"])
    both = tmp_path / "both"
    both.mkdir()
    for name in ("one", "two"):
        case = next((tmp_path / "left" / name).rglob("case.stream"))
        shutil.copytree(case.parent, both / name)
    refused = mirotwin.refuses("debug", both, *commands("where"))
    assert "holds 2 cases; name one: " in refused


def test_sources_that_are_newer_than_the_image_are_told(console, tmp_path):
    for suffix, text in (".ihx", hex_text(ECHO)), (".cdb", ECHO_CDB), (".map", ECHO_MAP):
        (tmp_path / f"named{suffix}").write_text(text)
    (tmp_path / "named.c").write_text("")
    words = ("--sources", tmp_path)
    os.utime(tmp_path / "named.c", (0, (tmp_path / "named.ihx").stat().st_mtime - 10))
    assert "newer" not in console(tmp_path / "named.ihx", *words, lines=["where"])
    os.utime(tmp_path / "named.c", (0, (tmp_path / "named.ihx").stat().st_mtime + 10))
    told = console(tmp_path / "named.ihx", *words, lines=["where"])
    assert "newer than named.ihx: named.c; lines may not fit, build it again" in told
