"""`mirotwin fw disasm|trace|profile|coverage`: looking into an image, a scenario, a recording, a stream."""

import json
import re
import shutil
import sys
from pathlib import Path

import pytest

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.inspect.counters import Activity, Counters
from miro_sim.scenario import file as scenario_file
from miro_sim.world.world import World
from mirotwin.runs.inspected_run import InspectedRun, watch
from tests import children
from tests.mirotwin.conftest import hex_file
from tests.robot.inspect.programs import build_modules
from tests.robot.mcs51.asm import assemble

MIROTWIN = Path(sys.executable).with_name("mirotwin")
LOOP = b"\x80\xfe"


@pytest.fixture(scope="session")
def bare(tmp_path_factory):
    """The robot's image without any debug file."""
    return Path(shutil.copy(image_path(), tmp_path_factory.mktemp("bare") / "bare.ihx"))


def test_the_robots_own_firmware_is_listed_with_symbols_and_c_lines(mirotwin):
    code, out, _ = mirotwin("fw", "disasm")
    assert code == 0
    assert "\n_decode_character:\n" in out
    assert "; main.c:60: PCON = sleep;\n" in out
    assert "  MOV PCON,_sleep\n" in out


def test_one_function_can_be_listed_alone(mirotwin):
    code, out, _ = mirotwin("fw", "disasm", image_path(), "--symbol", "uart_send")
    assert code == 0
    assert out.startswith("_uart_send:\n")
    assert out.count(":\n") == 1
    assert "RET" in out


def test_a_bare_image_is_listed_with_addresses(mirotwin, bare):
    code, out, _ = mirotwin("fw", "disasm", bare)
    assert code == 0
    assert "LJMP 0029h" in out


def test_a_trace_begins_and_ends_with_its_window(mirotwin, short):
    code, out, _ = mirotwin("fw", "trace", short, "--from", "40ms", "--to", "40.5ms")
    ticks = [int(line[:12]) for line in out.splitlines()[1:]]
    assert code == 0
    assert 960_000 <= ticks[0] < 960_000 + 48
    assert 972_000 - 24_000 < ticks[-1] < 972_000
    assert ticks == sorted(ticks)


def test_a_window_shows_what_the_whole_trace_shows_there(mirotwin, short):
    whole = mirotwin("fw", "trace", short, "--to", "9ms")[1].splitlines()[1:]
    window = mirotwin("fw", "trace", short, "--from", "5ms", "--to", "8ms")[1].splitlines()[1:]
    first, last = int(window[1][:12]), int(window[-1][:12])
    inside = [line for line in whole if first <= int(line[:12]) <= last and "asleep" not in line]
    assert len(inside) > 50
    assert [line for line in window[1:] if "asleep" not in line] == inside


@pytest.mark.slow
def test_both_engines_trace_and_profile_alike(short):
    def shown(*arguments):
        command = [MIROTWIN, "fw", arguments[0], short, "--to", "12ms", *arguments[1:]]
        return children.run(command, check=True, capture_output=True, text=True).stdout

    for arguments in (("trace",), ("profile", "--json")):
        python = shown(*arguments, "--engine", "python")
        assert python.count("\n") > 20
        assert python == shown(*arguments, "--engine", "compiled")


def test_a_profile_adds_up(mirotwin, short):
    code, out, _ = mirotwin("fw", "profile", short, "--json", "--slot", 2)
    found = json.loads(out)
    assert code == 0
    entries = 2 * sum(interrupt["count"] for interrupt in found["interrupts"])
    spent = sum(function["cycles"] for function in found["functions"])
    assert spent + entries + found["asleep_cycles"] == found["cycles"]
    by_name = {function["name"]: function for function in found["functions"]}
    assert by_name["_uart_interrupt"]["calls"] == found["interrupts"][4]["count"]
    assert found["interrupts"][4]["worst_latency"] >= 3
    assert found["stack"]["highest"] >= found["stack"]["first"] > 0x80


def test_a_profile_for_people_names_functions_interrupts_and_stack(mirotwin, short):
    _, out, _ = mirotwin("fw", "profile", short, "--to", "50ms")
    assert "_uart_interrupt" in out
    assert "serial" in out
    assert "stack: from " in out


RET_IN_INTERRUPT = """LJMP main
ORG 0Bh
INC 32h
RETI
ORG 1Bh
RET
main:
MOV TMOD,#21h
MOV IE,#8Ah
MOV TH1,#00h
SETB TR0
SETB TR1
loop:
INC 30h
SJMP loop
"""


def test_a_routine_that_ends_in_ret_is_a_fault_and_never_left_in_the_profile(mirotwin, tmp_path):
    image = hex_file(tmp_path / "ret.ihx", assemble(RET_IN_INTERRUPT))
    limit = ("--max-cycles", 300_000)
    said = "firmware ended an interrupt routine with RET, not RETI (its level stays blocked) at 0x001b, tick "
    assert said in mirotwin.ends(3, "fw", "run", image, *limit)
    for more in ((), ("--go-on",)):
        code, out, err = mirotwin("fw", "profile", image, *limit, *more)
        assert (code, err.count(said)) == (3, 1)
        (line,) = [line for line in out.splitlines() if line.startswith("timer 1")]
        assert " never left " in line
        assert "0 cycles" not in line
    mended = hex_file(tmp_path / "mended.ihx", assemble(RET_IN_INTERRUPT.replace("RET\n", "RETI\n")))
    code, out, _ = mirotwin("fw", "profile", mended, *limit)
    assert (code, "never left" in out) == (42, False)


def test_coverage_of_several_runs_adds_up_in_one_file(mirotwin, short, tmp_path):
    info = tmp_path / "fw.info"
    code, _, _ = mirotwin("fw", "coverage", short, "--to", "30ms", "--out", info)
    first = info.read_text()
    assert code == 0
    assert "SF:" in first
    assert "robot_fw/firmware/main.c\n" in first
    assert mirotwin("fw", "coverage", short, "--from", "30ms", "--out", info, "--append")[0] == 0
    whole = tmp_path / "whole.info"
    mirotwin("fw", "coverage", short, "--out", whole)
    assert _hits(info.read_text()) == _hits(whole.read_text())
    assert len(_hits(first)) < len(_hits(whole.read_text()))


def _hits(info):
    """The lines that ran. (How often is the largest count of a line's instructions, which does not add up.)"""
    return re.findall(r"^(DA:\d+),[1-9]", info, re.MULTILINE)


def test_coverage_of_a_bare_image_comes_with_its_listing(mirotwin, bare, tmp_path):
    info = tmp_path / "bare.info"
    mirotwin.ends(0, "fw", "coverage", bare, "--to", "1ms", "--out", info)
    listing = tmp_path / "bare.info.lst"
    assert f"SF:{listing}\n" in info.read_text()
    assert "LJMP 0029h" in listing.read_text()


def test_a_recording_is_looked_into_with_its_own_scenario_seed_and_firmware(mirotwin, finished, short):
    window = ("--from", "100ms", "--to", "101ms")
    recorded = mirotwin("fw", "trace", finished / "run.mcap", *window)
    assert recorded[0] == 0
    assert recorded == mirotwin("fw", "trace", short, "--seed", 5, *window)


def test_a_stream_file_is_looked_into_as_replay_runs_it(mirotwin, tmp_path):
    stream = tmp_path / "a.stream"
    stream.write_text("# mirotwin stream 1\n240000 > 55 55 55\n")
    code, out, _ = mirotwin("fw", "profile", stream, "--to", "20ms", "--json")
    assert code == 0
    assert json.loads(out)["interrupts"][4]["count"] == 3


def test_looking_changes_no_bit_of_the_world(short):
    def world():
        return World(scenario_file.load(str(short)).scenario, 3, load_hex(image_path()))

    plain, watched = world(), world()
    while not plain.finished:
        plain.step()
    assert watch(InspectedRun(watched, 0, 1), [Counters(), Activity()], 1_000_001, 2_345_678)
    while not watched.finished:
        watched.step()
    assert watched.digest == plain.digest


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("fig6", "--from", "2s", "--to", "1s"), "the window is empty; --to must be later"),
        (("fig6", "--from", "7s"), "the run ends at tick"),
        (("fig6", "--from", "7 sec"), "is not a time; write 2s, 20ms, 341us or 5min, or 48000t for ticks"),
        (("fig6", "--slot", "1"), "no robot in that slot; there is 0"),
        (("fig6", "--network", "1"), "there is no such network; use 0"),
        (("fig6", "--until", "main"), "--until does not apply to it"),
        (("fig5",), "no such scenario"),
        (("gone.ihx",), "there is no such file"),
        (("gone.mcap", "--from", "2s", "--to", "1s"), "--from 2s --to 1s: the window is empty"),
        (("gone.mcap",), "gone.mcap: no such file"),
    ],
)
def test_what_cannot_be_looked_at_is_one_line(mirotwin, arguments, said):
    for command in ("trace", "profile", "coverage"):
        assert said in mirotwin.refuses("fw", command, *arguments)


@pytest.mark.parametrize(
    "command",
    [
        *(("fw", name) for name in ("disasm", "run", "trace", "profile", "coverage")),
        *(("replay",), ("decode",), ("run",), ("fw", "profile", "fig6", "--firmware")),
        ("fw", "profile", str(image_path()), "--stdin"),
    ],
    ids=" ".join,
)
def test_a_folder_is_called_one_and_the_way_out_is_to_name_a_file_in_it(mirotwin, tmp_path, command):
    assert mirotwin.refuses(*command, tmp_path) == f"{tmp_path}: is a folder; name a file in it"


def test_the_folder_of_a_run_has_its_recording_named(mirotwin, finished):
    for command in (("fw", "profile"), ("decode",)):
        said = f"{finished}: is a folder; name a file in it, such as {finished / 'run.mcap'}"
        assert mirotwin.refuses(*command, finished) == said
    assert "run.mcap" not in mirotwin.refuses("fw", "profile", "fig6", "--firmware", finished)


def test_a_window_after_the_end_of_an_image_is_empty(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", LOOP)
    out = tmp_path / "a.trace"
    for options in ((), ("--out", out)):
        assert "the run ended at tick" in mirotwin.refuses("fw", "trace", image, "--from", "1s", *options)
    assert not out.exists()


def test_the_options_of_a_scenario_do_not_apply_to_an_image(mirotwin, bare):
    assert "--seed does not apply" in mirotwin.refuses("fw", "profile", bare, "--seed", 1)


def test_coverage_is_not_added_to_the_listing_of_another_image(mirotwin, bare, tmp_path):
    other, out = tmp_path / "other.hex", tmp_path / "fw.info"
    hex_file(other, b"\x00" + LOOP)
    arguments = ("--max-cycles", 1000, "--out", out)
    mirotwin("fw", "coverage", bare, *arguments)
    before = out.read_bytes()
    err = mirotwin.ends(2, "fw", "coverage", other, *arguments, "--append")
    assert f"{out}.lst: is the listing of another image; " in err
    assert out.read_bytes() == before
    assert mirotwin("fw", "coverage", bare, *arguments, "--append")[0] == 42


def test_an_unknown_symbol_is_named_with_its_nearest(mirotwin):
    err = mirotwin.refuses("fw", "trace", "fig6", "--symbol", "uart_sent", "--to", "1ms")
    assert "did you mean uart_send?" in err


@pytest.mark.parametrize("command", [("trace", "--to", "1ms"), ("disasm",)])
def test_an_address_without_code_is_no_function(mirotwin, bare, command):
    code, _, err = mirotwin("fw", command[0], bare, *command[1:], "--symbol", "0x5000")
    assert code == 2
    assert "bare.ihx: --symbol: the image has no code at 0x5000; see mirotwin fw disasm" in err


def test_static_functions_that_share_a_name_are_all_shown(mirotwin, tmp_path):
    module = "static char step(char c) { return c + %d; }\nvolatile char %s;\nvoid run_%s(void) { %s = step(%s); }\n"
    main = "void run_b(void);\nvoid main(void) { run_a(); run_b(); while (1); }\n"
    (tmp_path / "a.c").write_text(module % (1, "a", "a", "a", "a") + main)
    (tmp_path / "b.c").write_text(module % (2, "b", "b", "b", "b"))
    image = build_modules(tmp_path, "a", "b")
    shown = mirotwin("fw", "trace", image, "--symbol", "step")[1].splitlines()[1:]
    starts = {line.split()[1] for line in shown if line.split()[2] == "_step"}
    assert len(starts) == 2
    assert mirotwin("fw", "disasm", image, "--symbol", "step")[1].count("_step:\n") == 2
    one = mirotwin("fw", "trace", image, "--symbol", f"0x{min(starts)}")[1].splitlines()[1:]
    assert {line.split()[1] for line in one if line.split()[2] == "_step"} == {min(starts)}


def test_coverage_is_added_to_a_tracefile_alone(mirotwin, tmp_path):
    (tmp_path / "x.info").write_text("hello\n")
    err = mirotwin.refuses("fw", "coverage", "fig6", "--out", tmp_path / "x.info", "--append")
    assert "x.info:1: is no record of a tracefile" in err


def test_coverage_either_adds_to_a_file_or_replaces_it(mirotwin, short, tmp_path):
    err = mirotwin.refuses("fw", "coverage", short, "--out", tmp_path / "x", "--append", "--force")
    assert "--append does not go with --force." in err
    assert not (tmp_path / "x").exists()


def test_a_listing_that_is_there_stays_unless_it_is_to_be_replaced_and_is_not_asked_about_needlessly(
    mirotwin, bare, tmp_path
):
    listing = tmp_path / "fw.info.lst"
    listing.write_text("mine")
    asked = ("--to", "1ms", "--out", tmp_path / "fw.info")
    assert f"{listing}: is there already" in mirotwin.refuses("fw", "coverage", bare, *asked)
    assert list(tmp_path.iterdir()) == [listing]
    assert mirotwin("fw", "coverage", image_path(), *asked)[0] == 0
    assert listing.read_text() == "mine"
    assert mirotwin("fw", "coverage", bare, *asked, "--force")[0] == 0
    assert "LJMP 0029h" in listing.read_text()
    assert mirotwin("fw", "coverage", bare, *asked, "--append")[0] == 0


def test_a_fault_is_reported_after_what_was_seen(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", b"\x00\xa5")
    code, out, err = mirotwin("fw", "trace", image)
    assert code == 3
    assert "NOP" in out
    assert "undefined opcode A5" in err


def test_the_cycle_limit_of_an_image_has_its_exit_code(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", b"\x00\x80\xfd")
    assert mirotwin("fw", "profile", image, "--max-cycles", 10)[0] == 42
    assert mirotwin("fw", "profile", image, "--to", "100t")[0] == 0
    assert mirotwin("fw", "profile", hex_file(tmp_path / "b.ihx", LOOP), "--max-cycles", 10)[0] == 0


def test_a_reader_that_goes_away_ends_it_as_a_shell_reports_that(short):
    command = f"{MIROTWIN} fw trace {short} | head -1; echo ${{PIPESTATUS[0]}}"
    done = children.run(["bash", "-c", command], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "141"
    assert done.stderr == ""


def test_input_that_cannot_be_received_does_not_keep_an_ended_program_running(mirotwin, tmp_path):
    """Receives one character by timer 1, never clears RI, and sleeps with interrupts off."""
    image = hex_file(tmp_path / "a.ihx", bytes.fromhex("758df3 758920 d28e 759850 438701"))
    (tmp_path / "in").write_bytes(b"abc")
    assert "no interrupt can wake it" in mirotwin.ends(0, "fw", "run", image, "--stdin", tmp_path / "in")


def test_a_waveform_of_an_image_has_its_pins_and_its_crystal(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.hex", b"\x80\x00\x80\xfc")
    pins, out = tmp_path / "a.pins", tmp_path / "a.vcd"
    pins.write_text("1105920 * P1.2 0  # 100 ms\n1105921 * P1.2 1\n")
    options = ("--pins", pins, "--crystal", 11_059_200, "--to", "150ms", "--out", out)
    assert mirotwin("fw", "vcd", image, *options)[1].startswith("0.000000 s to 0.150000 s; ")
    text = out.read_text()
    assert "ticks of 11059200 Hz as ns = tick * 1000000000 // 11059200" in text
    wire = next(line.split()[3] for line in text.splitlines() if line.startswith("$var") and " p1_2 " in line)
    edges = [
        (int(part.split("\n")[0]), line)
        for part in text.split("\n#")[1:]
        for line in part.split("\n")
        if line[1:] == wire
    ]
    assert edges == [(0, f"1{wire}"), (100_000_000, f"0{wire}"), (100_000_090, f"1{wire}")]
    assert mirotwin("fw", "vcd", image, *options, "--from", "80ms", "--force")[0] == 0
    window = out.read_text()
    assert f"#100000000\n0{wire}\n#100000090\n1{wire}\n" in window


def test_a_bad_line_of_pins_is_named(mirotwin, tmp_path):
    image, pins = hex_file(tmp_path / "a.hex", LOOP), tmp_path / "a.pins"
    pins.write_text("0 * P1.2 0\n0 * P9.2 1\n")
    err = mirotwin.refuses("fw", "trace", image, "--pins", pins)
    assert err.startswith(f"{pins}:2: '0 * P9.2 1' is no pin event; ")
    pins.write_text("0 * P3.0 0\n")
    err = mirotwin.refuses("fw", "trace", image, "--pins", pins, "--stdin", pins)
    assert err == "--pins: P3.0 is RXD and cannot be a pin while serial input is sent there"


@pytest.mark.parametrize(
    "option", [("--crystal", 12_000_000), ("--go-on",), ("--stdin-gap", "1ms"), ("--code-size", "64k")]
)
def test_the_options_of_an_image_do_not_apply_to_a_scenario(mirotwin, short, option):
    err = mirotwin.refuses("fw", "profile", short, *option)
    assert err.endswith(f": is no image, {option[0]} does not apply to it; leave it out")


def test_a_trace_goes_on_after_faults_and_lists_them(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.hex", b"\xa5\xa5" + LOOP)
    assert mirotwin("fw", "trace", image)[2].count("undefined opcode") == 1
    code, out, err = mirotwin("fw", "trace", image, "--go-on")
    assert (code, err.count("undefined opcode A5 at")) == (3, 2)
    assert out.count("\n") == 4
