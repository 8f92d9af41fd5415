"""`mirotwin fw run` and `mirotwin info`: an image on the bare processor, and what is installed."""

import hashlib
import json
import re
import tomllib

import pytest
from click.testing import CliRunner

from miro_robot.firmware import image_path
from mirotwin.commands import main
from tests.children import ROOT
from tests.mirotwin import program
from tests.mirotwin.conftest import hex_file

LOOP = b"\x80\xfe"
SENDS = bytes.fromhex("759850 758bff 758920 d28e 7599")
"""SCON 50h, TL1 FFh, TMOD 20h, TR1; MOV SBUF,#.. follows."""
XRAM = ("--code-in-xram",)


def test_a_symbol_is_found_with_or_without_its_underscore(mirotwin):
    for name in ("main", "_main"):
        assert mirotwin("fw", "run", image_path(), "--until", name, "--max-cycles", 100_000) == (0, "", "")


def with_a_map_of_the_robot(tmp_path, suffix=".map", code=LOOP):
    """An image of `code`, and the symbol file beside it that belongs to another one."""
    image = hex_file(tmp_path / "a.ihx", code)
    beside = image.with_suffix(suffix)
    beside.write_bytes(image_path().with_suffix(suffix).read_bytes())
    return image, beside


@pytest.mark.parametrize("suffix", [".map", ".cdb"])
@pytest.mark.parametrize(
    "command",
    [
        ["fw", "run", "IMAGE", "--until", "main"],
        ["fw", "disasm", "IMAGE"],
        ["fw", "profile", "IMAGE"],
        ["run", "fig6", "--firmware", "IMAGE"],
    ],
)
def test_a_command_that_needs_symbols_refuses_those_of_another_image(
    mirotwin, tmp_path, suffix, command, monkeypatch
):
    image, beside = with_a_map_of_the_robot(tmp_path, suffix)
    monkeypatch.chdir(tmp_path)
    err = mirotwin.refuses(*(str(image) if word == "IMAGE" else word for word in command))
    assert err.startswith(f"{beside}:")
    assert err.endswith("it belongs to another image: rebuild both together, or take it away")
    assert sorted(tmp_path.iterdir()) == sorted([image, beside])


def test_a_command_that_needs_no_symbols_does_not_read_them(mirotwin, tmp_path):
    image, _ = with_a_map_of_the_robot(tmp_path)
    assert mirotwin("fw", "run", image, "--until", "0x0000") == (0, "", "")
    assert mirotwin("info", "--firmware", image)[0] == 0


def test_a_fault_is_reported_by_address_beside_symbols_of_another_image(mirotwin, tmp_path):
    image, beside = with_a_map_of_the_robot(tmp_path, code=b"\xa5")
    code, _, err = mirotwin("fw", "run", image, "--max-cycles", 100)
    fault, names = err.splitlines()
    assert code == 3
    assert fault.startswith(
        "mirotwin: firmware fault: firmware executed the undefined opcode A5 at 0x0000, tick"
    )
    assert names.startswith(f"mirotwin: addresses have no names: {beside}:")


def test_a_program_that_ends_is_done_unless_it_should_have_got_somewhere(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", LOOP + LOOP)
    assert mirotwin("fw", "run", image)[0] == 0
    assert mirotwin("fw", "run", image, "--until", "0x2")[0] == 1


@pytest.mark.parametrize("command", ["run", "profile", "trace", "coverage"])
def test_an_address_without_code_is_refused_before_the_run(mirotwin, tmp_path, command):
    image = hex_file(tmp_path / "a.ihx", b"\x00\x80\xfd")  # a loop that never ends
    said = mirotwin.refuses("fw", command, image, "--until", "0x10")
    assert said == f"{image}: --until: the image has no code at 0x0010; see mirotwin fw disasm"


def test_an_address_to_which_a_program_may_bring_code_is_run_to(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", b"\x00\x02\x00\x10")
    assert mirotwin("fw", "run", image, "--code-in-xram", "--until", "0x10") == (0, "", "")


def test_an_endless_loop_ends_a_program_that_has_a_cycle_limit_too(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", b"\x00" + LOOP)
    code, _, err = mirotwin("fw", "run", image, "--max-cycles", 1)
    assert (code, err) == (42, "mirotwin: stopped at the limit, at 0x0001 after 1 machine cycle\n")
    for limit in (4, 1000, 100_000):
        err = mirotwin.ends(0, "fw", "run", image, "--max-cycles", limit)
        assert err.startswith("mirotwin: the program ended at 0x0001 after 3 machine cycles")


@pytest.mark.parametrize(
    ("until", "expected"),
    [
        ("maim", "no symbol maim in the code; did you mean main?"),
        ("100", "100 is no symbol; write 0x64 for an address"),
        ("", "the place is empty; give a symbol"),
        ("0x10000", "beyond the last code address"),
        ("0xyz", "not a hexadecimal number"),
    ],
)
def test_a_place_that_is_none_is_refused(mirotwin, until, expected):
    assert expected in mirotwin.refuses("fw", "run", image_path(), "--until", until)


def test_characters_go_to_stdout_as_they_are_and_everything_else_to_stderr(tmp_path):
    image = hex_file(tmp_path / "a.ihx", SENDS + b"\xc3" + LOOP)
    result = CliRunner().invoke(main, ["fw", "run", str(image), "--max-cycles", "300000"])
    assert result.stdout_bytes == b"\xc3"


def test_the_dump_holds_registers_and_memories(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", b"\x75\x40\x5a" + LOOP)
    mirotwin("fw", "run", image, "--until", "0x0003", "--dump", tmp_path / "dump.json")
    dump = json.loads((tmp_path / "dump.json").read_bytes())
    assert set(dump) == {"pc", "cycles", "instructions", "iram_hex", "sfr", "xram_hex"}
    assert (dump["pc"], dump["cycles"], dump["instructions"]) == (3, 2, 1)
    assert bytes.fromhex(dump["iram_hex"])[0x40] == 0x5A
    assert dump["sfr"]["81"] == 7


def test_a_dump_that_does_not_fit_the_disk_leaves_the_one_before(tmp_path):
    image, dump = hex_file(tmp_path / "a.ihx", LOOP), tmp_path / "dump.json"
    dump.write_text("old")
    done = program.run("fw", "run", image, "--dump", dump, preexec_fn=program.full_disk(100))
    assert done.returncode == 2
    said = f"mirotwin: error: {dump}: File too large; make room, or choose another file with --dump\n"
    assert done.stderr.endswith(said)
    assert dump.read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.ihx", "dump.json"]


def test_a_run_goes_on_after_faults_and_lists_a_hundred_places(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", 110 * b"\xa5" + b"\x80\x90")
    err = mirotwin.ends(3, "fw", "run", image, "--go-on", "--max-cycles", 112)
    assert err.count("firmware fault: firmware executed the undefined opcode A5 at 0x00") == 100
    assert "mirotwin: firmware faults: 10 more are not listed\n" in err
    assert err.endswith("mirotwin: stopped at the limit, at 0x0000 after 112 machine cycles\n")


def test_faults_of_a_loop_are_one_line_with_their_number(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", b"\xa5\x80\xfd")
    err = mirotwin.ends(3, "fw", "run", image, "--go-on", "--max-cycles", 330)
    (line,) = [line for line in err.splitlines() if "fault" in line]
    assert line.endswith("executed the undefined opcode A5 at 0x0000, tick 12 (and 109 like it)")
    err = mirotwin.ends(3, "fw", "run", image, "--go-on", "--max-cycles", 3300)
    assert "tick 12 (and 999 like it)\n" in err
    assert "firmware faults: 100 more are not listed\n" in err


def test_a_time_is_one_of_the_crystal(mirotwin, tmp_path):
    """The program waits for RXD to fall and ends."""
    image = hex_file(tmp_path / "a.ihx", b"\x20\xb0\xfd" + LOOP)
    given = tmp_path / "given"
    given.write_text("x")
    for crystal, cycles in ((24_000_000, 200_000), (12_000_000, 100_000), (11_059_200, 92_160)):
        options = ("--stdin", given, "--baud", 9600, "--stdin-after", "100ms", "--crystal", crystal)
        err = mirotwin.ends(0, "fw", "run", image, *options)
        ended = int(err.split(" after ")[1].split()[0])
        assert cycles <= ended <= cycles + 6


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--stdin-when", "x"), "--stdin-when: has no effect without --stdin"),
        (("--stdin-gap", "1ms"), "--stdin-gap: has no effect without --stdin"),
        (("--stdin", "F", "--stdin-when", ""), "--stdin-when: the text is empty"),
        (("--stdin", "F", "--stdin-when", "a", "--stdin-when", "b"), "--stdin-when: 2 for 1 --stdin; give one"),
        (("--stdin", "F", "--stdin", "F", "--stdin", "F", "--stdin-when", "a"), "--stdin-when: 1 for 3 --stdin"),
        (("--stdin", "F", "--stdin-by-line"), "--stdin-by-line: has no effect without --stdin-when"),
        (("--stdin-wait",), "--stdin-wait: has no effect without --stdin"),
        (("--stdin", "F", "--stdin-after", "1s", "--stdin-after", "2s"), "--stdin-after: 2 for 1 --stdin; give one"),
        (("--stdin", "-", "--stdin", "-"), "--stdin: standard input can be read only once"),
        (("--stdin", "F", "--stdin-after", "soon"), "'soon' is not a time"),
        (("--stdin", "F", "--baud", "600000", "--crystal", "12000000"), "--baud 600000 is outside 50..375000"),
        (("--crystal", "5"), "Invalid value for '--crystal'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)  # fmt: skip
def test_input_that_cannot_be_meant_is_refused(mirotwin, tmp_path, options, said):
    image, given = hex_file(tmp_path / "a.ihx", LOOP), tmp_path / "given"
    given.write_text("x")
    assert said in mirotwin.refuses("fw", "run", image, *(given if part == "F" else part for part in options))


@pytest.fixture
def program_at_8000(tmp_path):
    return hex_file(tmp_path / "program.ihx", SENDS + b"A" + LOOP, 0x8000)


def test_a_program_that_does_not_begin_at_0_is_named_with_the_place_where_it_does(mirotwin, program_at_8000):
    err = mirotwin.refuses("fw", "run", program_at_8000, *XRAM)
    assert err.startswith(f"{program_at_8000}: has no byte at 0x0000, and the processor starts there; give")
    assert "give --start 0x8000" in err
    err = mirotwin.refuses("fw", "run", program_at_8000, *XRAM, "--start", "0x9000")
    assert "has no byte at 0x9000, and --start names it" in err
    err = mirotwin.refuses("fw", "run", program_at_8000, *XRAM, "--start", "nowhere")
    assert err.startswith(f"{program_at_8000}: --start: no symbol nowhere")


def test_it_runs_from_there_with_its_code_in_ram_alone(mirotwin, program_at_8000):
    assert "does not fit 8192 bytes" in mirotwin.refuses("fw", "run", program_at_8000, "--start", "0x8000")
    assert mirotwin("fw", "run", program_at_8000, *XRAM, "--start", "0x8000")[:2] == (0, "A")


def test_a_monitor_and_its_program_run_as_two_images(mirotwin, program_at_8000, tmp_path):
    monitor = hex_file(tmp_path / "monitor.ihx", bytes.fromhex("028000"))
    assert mirotwin("fw", "run", monitor, program_at_8000, *XRAM)[:2] == (0, "A")
    err = mirotwin.refuses("fw", "run", monitor, program_at_8000, program_at_8000, *XRAM)
    assert f"{program_at_8000}: has a byte at 0x8000, as monitor.ihx has; link one of them elsewhere" in err


def test_a_text_that_never_came_is_told_so(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", SENDS + b">" + LOOP)
    (tmp_path / "lines").write_bytes(b"one\ntwo\n")
    words = ("--stdin", tmp_path / "lines", "--stdin-when", ">", "--stdin-by-line", "--max-cycles", 2_000_000)
    _, _, err = mirotwin("fw", "run", image, *words[:3], "?", "--stdin-by-line", "--max-cycles", 200_000)
    assert "--stdin-when: b'?' was not seen; 8 bytes of --stdin were not sent" in err


READS = "c298 3098fd"
"""CLR RI; JNB RI,$"""


def test_lines_after_a_text_that_does_not_come_again_are_told_with_how_often_it_came(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", SENDS + b">" + bytes.fromhex(READS * 4) + LOOP)
    (tmp_path / "lines").write_bytes(b"one\ntwo\n")
    words = ("--stdin", tmp_path / "lines", "--stdin-when", ">", "--stdin-by-line", "--max-cycles", 400_000)
    _, _, err = mirotwin("fw", "run", image, *words)
    assert "--stdin-when: b'>' was not seen again after 1 time; 4 bytes of --stdin were not sent" in err


def test_only_the_text_that_is_waited_for_is_counted(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", SENDS + b">" + bytes.fromhex(READS * 4) + LOOP)
    (tmp_path / "line").write_bytes(b"one\n")
    pair = ("--stdin", tmp_path / "line", "--stdin-when")
    _, _, err = mirotwin("fw", "run", image, *pair, ">", *pair, "?", "--max-cycles", 400_000)
    assert "--stdin-when: b'?' was not seen; 4 bytes of --stdin were not sent" in err


def test_the_files_of_stdin_have_a_delay_each(mirotwin, tmp_path):
    """The program sends back what it gets, and ends at `!`."""
    echo = SENDS[:-2] + bytes.fromhex("758dfd 3098fd e599 c298 f599 3099fd c299 b421ef") + LOOP
    image = hex_file(tmp_path / "a.ihx", echo)
    for name, text in (("first", "ab"), ("second", "c"), ("third", "!")):
        (tmp_path / name).write_text(text)
    files = [option for name in ("first", "second", "third") for option in ("--stdin", tmp_path / name)]
    ended = []
    for second in ("0s", "50ms"):
        delays = ("--stdin-after", "10ms", "--stdin-after", second, "--stdin-after", "0s")
        code, out, err = mirotwin("fw", "run", image, *files, *delays)
        assert (code, out) == (0, "abc!")
        ended.append(int(err.split(" after ")[1].split()[0]))
    assert abs(ended[1] - ended[0] - 100_000) < 6_000


def test_characters_that_were_never_sent_are_told_with_the_reason(mirotwin, tmp_path):
    (tmp_path / "bytes").write_bytes(b"xyz")
    stdin = ("--stdin", tmp_path / "bytes", "--max-cycles", 10_000)
    deaf = hex_file(tmp_path / "deaf.ihx", bytes.fromhex("2080fd 3080fd"))
    _, _, err = mirotwin("fw", "run", deaf, *stdin)
    assert (
        "mirotwin: 3 bytes of --stdin were not sent: the receiver was never on, and no --baud is given" in err
    )


def test_a_port_of_9_bits_is_told(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", bytes.fromhex("7598d0 758bff 758920 d28e" + READS) + LOOP)
    (tmp_path / "bytes").write_bytes(b"x")
    err = mirotwin.ends(0, "fw", "run", image, "--stdin", tmp_path / "bytes")
    assert "the serial port takes characters of 9 bits; the ninth was 1 in all that were sent" in err


def test_registers_that_the_chip_lacks_are_reported_at_the_end_with_the_chip_that_has_them(
    mirotwin, tmp_path
):
    image = hex_file(tmp_path / "a.ihx", bytes.fromhex("75e646 75e6b9 7591ff e5d9 75f801 80fe"))
    err = mirotwin.ends(0, "fw", "run", image)
    assert (
        'the at89c52 lacks E6h (ISP/IAP, the data flash), accessed 2 times; chip = "stc89c52" has them' in err
    )
    modes = "lacks 91h (P0M0 to P2M1, modes of ports), accessed once; no chip here has it, STC12, STC15 have"
    assert f"the at89c52 {modes}" in err
    assert "the at89c52 lacks F8h, accessed once; they read FFh" in err


INTO_DATA = bytes.fromhex("747f f581 c0e0 1581 1581 c0e0 80fe")
"""MOV A,#7Fh; MOV SP,A; PUSH ACC at 80h; DEC SP twice, which leaves it at 7Eh; PUSH ACC at 7Fh; SJMP $."""
SAID = "firmware went below the start of its stack (SP 7Eh, its stack is 80h to FFh)"


@pytest.fixture
def image(tmp_path):
    return hex_file(tmp_path / "a.ihx", INTO_DATA)


def test_data_below_the_stack_is_guarded_where_the_option_says_where_it_begins(mirotwin, image):
    assert mirotwin("fw", "run", image)[:2] == (0, "")
    assert SAID in mirotwin.ends(3, "fw", "run", image, "--stack-from", "0x80")


def test_without_a_map_the_start_up_code_says_where_the_stack_begins(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", bytes.fromhex("75817f c0e0 1581 1581 c0e0 80fe"))
    assert f"{SAID[:-1]} by MOV SP,#7Fh at 0x0000)" in mirotwin.ends(3, "fw", "run", image)


def test_a_robot_run_and_the_replay_of_its_recording_know_the_stack(mirotwin, image, tmp_path):
    out = tmp_path / "out"
    stack = ("--firmware", image, "--stack-from", "0x80")
    assert SAID in mirotwin.ends(3, "run", "fig6", *stack, "--out", out, "--no-figure")
    assert SAID in mirotwin.ends(3, "replay", out / "run.mcap", "-q")
    err = mirotwin.refuses("replay", out / "run.mcap", "-q", "--stack-from", "0x80")
    assert "--stack-from needs --firmware" in err


def test_conform_tells_of_it(mirotwin, image):
    assert SAID in mirotwin.ends(3, "conform", image, "--rule", "P53", "--stack-from", "0x80")


@pytest.mark.parametrize("address", ["80", "0x100", "-1", "0x", "stack", "0x1g", ""])
def test_what_is_not_an_address_of_internal_ram_is_refused(mirotwin, image, address):
    err = mirotwin.refuses("fw", "run", image, "--stack-from", address)
    assert "is not an address of internal RAM; give 0x00 to 0xff." in err


@pytest.mark.parametrize("command", [["fw", "run"], ["conform"], ["run", "fig6", "--firmware"]])
def test_an_image_with_a_map_has_its_stack_from_there(mirotwin, command):
    err = mirotwin.refuses(*command, image_path(), "--stack-from", "0x80")
    assert "the .map beside the image begins its stack at" in err


def test_info_names_versions_engine_and_firmware(mirotwin):
    out = mirotwin.succeeds("info")
    sha256 = hashlib.sha256(image_path().read_bytes()).hexdigest()
    for word in ("mirotwin", "Python", "mcap", "engine", sha256, str(image_path()), "bytes of 8192"):
        assert word in out


def test_info_has_the_version_of_each_package_that_a_user_installs_with_it(mirotwin):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    needed = [
        *project["dependencies"],
        *(one for name in ("hypothesis", "campaign", "report") for one in extras[name]),
    ]
    listed = [line.split()[0] for line in mirotwin.succeeds("info").splitlines() if not line.startswith(" ")]
    others = ("mirotwin", "Python", "platform", "engine", "firmware")
    assert [name for name in listed if name not in others] == [re.match(r"[\w-]+", one)[0] for one in needed]
