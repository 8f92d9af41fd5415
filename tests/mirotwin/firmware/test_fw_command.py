"""`mirotwin fw run` and `mirotwin info`: an image on the bare processor, and what is installed."""

import hashlib
import json
import resource
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from miro_robot.firmware import image_path
from mirotwin.commands import main
from tests import children
from tests.mirotwin.conftest import hex_file

MIROTWIN = Path(sys.executable).with_name("mirotwin")
LOOP = b"\x80\xfe"
HELLO = bytes.fromhex("759850 758bff 758920 d28e 7599c3 80fe".replace(" ", ""))


def test_reaching_the_address_is_success(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", b"\x00\x00\x00" + LOOP)
    assert mirotwin("fw", "run", image, "--until", "0x0002", "--max-cycles", 100) == (0, "", "")


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
    code, out, err = mirotwin(*(str(image) if word == "IMAGE" else word for word in command))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"mirotwin: error: {beside}:")
    assert err.endswith("it belongs to another image: rebuild both together, or take it away\n")
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
    assert fault.startswith("mirotwin: firmware fault: ")
    assert "at 0x0000, tick" in fault
    assert names.startswith(f"mirotwin: addresses have no names: {beside}:")


def test_the_cycle_limit_has_an_exit_code_of_its_own(mirotwin):
    code, out, err = mirotwin("fw", "run", image_path(), "--max-cycles", 5000)
    assert (code, out) == (42, "")
    assert err.startswith("mirotwin: stopped at the limit, at 0x")


def test_a_program_that_ends_is_done_unless_it_should_have_got_somewhere(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", LOOP + LOOP)
    assert mirotwin("fw", "run", image)[0] == 0
    assert mirotwin("fw", "run", image, "--until", "0x2")[0] == 1


@pytest.mark.parametrize("command", ["run", "profile", "trace", "coverage"])
def test_an_address_without_code_is_refused_before_the_run(mirotwin, tmp_path, command):
    image = hex_file(tmp_path / "a.ihx", b"\x00\x80\xfd")  # a loop that never ends
    code, out, err = mirotwin("fw", command, image, "--until", "0x10")
    assert (code, out) == (2, "")
    assert err == (
        f"mirotwin: error: {image}: --until: the image has no code at 0x0010; see mirotwin fw disasm\n"
    )


def test_an_address_to_which_a_program_may_bring_code_is_run_to(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", b"\x00\x02\x00\x10")
    assert mirotwin("fw", "run", image, "--code-in-xram", "--until", "0x10") == (0, "", "")


def test_an_endless_loop_ends_a_program_that_has_a_cycle_limit_too(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", b"\x00" + LOOP)
    code, _, err = mirotwin("fw", "run", image, "--max-cycles", 1)
    assert (code, err) == (42, "mirotwin: stopped at the limit, at 0x0001 after 1 machine cycle\n")
    for limit in (4, 1000, 100_000):
        code, _, err = mirotwin("fw", "run", image, "--max-cycles", limit)
        assert code == 0
        assert err.startswith("mirotwin: the program ended at 0x0001 after 3 machine cycles")


def test_a_fault_has_an_exit_code_of_its_own(mirotwin, tmp_path):
    code, out, err = mirotwin("fw", "run", hex_file(tmp_path / "a.ihx", b"\xa5"), "--max-cycles", 100)
    assert (code, out) == (3, "")
    assert "firmware fault: firmware executed the undefined opcode A5" in err


@pytest.mark.parametrize(
    ("until", "expected"),
    [
        ("maim", "no symbol maim in the code; did you mean _main?"),
        ("100", "100 is no symbol; write 0x64 for an address"),
        ("", "the place is empty; give a symbol"),
        ("0x10000", "beyond the last code address"),
        ("0xyz", "not a hexadecimal number"),
    ],
)
def test_a_place_that_is_none_is_refused(mirotwin, until, expected):
    code, out, err = mirotwin("fw", "run", image_path(), "--until", until)
    assert (code, out) == (2, "")
    assert expected in err
    assert err.count("\n") == 1


def test_characters_go_to_stdout_as_they_are_and_everything_else_to_stderr(tmp_path):
    image = hex_file(tmp_path / "a.ihx", HELLO)
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


def test_a_dump_that_cannot_be_written_is_refused_before_the_firmware_runs(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", HELLO)
    for place, what in ((tmp_path, "is a folder"), (tmp_path / "no" / "dump.json", "there is no folder")):
        code, out, err = mirotwin("fw", "run", image, "--dump", place)
        assert (code, out) == (2, "")
        assert err.startswith(f"mirotwin: error: {place}: {what}")


def test_a_dump_takes_the_place_of_no_device_and_is_refused_before_the_firmware_runs(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", HELLO)
    code, out, err = mirotwin("fw", "run", image, "--max-cycles", 100, "--dump", "/dev/full")
    assert (code, out) == (2, "")
    assert err == (
        "mirotwin: error: /dev/full: exists and is not a regular file; choose another file with --dump\n"
    )


def test_a_dump_that_does_not_fit_the_disk_leaves_the_one_before(tmp_path):
    """A limit on the length of files stands in for the disk."""

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

    image, dump = hex_file(tmp_path / "a.ihx", LOOP), tmp_path / "dump.json"
    dump.write_text("old")
    command = [MIROTWIN, "fw", "run", image, "--dump", dump]
    done = children.run(command, preexec_fn=limit, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.endswith(
        f"mirotwin: error: {dump}: File too large; make room, or choose another file with --dump\n"
    )
    assert dump.read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.ihx", "dump.json"]


def test_the_8_kb_limit_is_lifted_when_code_is_in_ram(mirotwin, tmp_path):
    image = tmp_path / "a.ihx"
    image.write_text(":0200000080FE80\n:02200000AABB79\n:00000001FF\n")
    assert "does not fit 8192 bytes" in mirotwin("fw", "run", image)[2]
    assert mirotwin("fw", "run", image, "--code-in-xram", "--until", "0x0000")[0] == 0


def test_a_run_goes_on_after_faults_and_counts_those_that_are_not_listed(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", b"\xa5\x80\xfd")
    code, _, err = mirotwin("fw", "run", image, "--go-on", "--max-cycles", 330)
    assert code == 3
    assert (
        err.count("mirotwin: firmware fault: firmware executed the undefined opcode A5 at 0x0000, tick ")
        == 100
    )
    assert "mirotwin: firmware faults: 10 more are not listed\n" in err
    assert err.endswith("mirotwin: stopped at the limit, at 0x0000 after 330 machine cycles\n")


def test_a_time_is_one_of_the_crystal(mirotwin, tmp_path):
    """The program waits for RXD to fall and ends."""
    image = hex_file(tmp_path / "a.ihx", b"\x20\xb0\xfd" + LOOP)
    given = tmp_path / "given"
    given.write_text("x")
    for crystal, cycles in ((24_000_000, 200_000), (12_000_000, 100_000), (11_059_200, 92_160)):
        options = ("--stdin", given, "--baud", 9600, "--stdin-after", "100ms", "--crystal", crystal)
        code, _, err = mirotwin("fw", "run", image, *options)
        assert code == 0
        ended = int(err.split(" after ")[1].split()[0])
        assert cycles <= ended <= cycles + 6


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--stdin-when", "x"), "--stdin-when: has no effect without --stdin"),
        (("--stdin-gap", "1ms"), "--stdin-gap: has no effect without --stdin"),
        (("--stdin", "F", "--stdin-when", ""), "--stdin-when: the text is empty"),
        (
            ("--stdin", "F", "--stdin-when", "a", "--stdin-when", "b"),
            "--stdin-when: 2 for 1 --stdin; give one",
        ),
        (
            ("--stdin", "F", "--stdin", "F", "--stdin", "F", "--stdin-when", "a"),
            "--stdin-when: 1 for 3 --stdin",
        ),
        (("--stdin", "F", "--stdin-by-line"), "--stdin-by-line: has no effect without --stdin-when"),
        (("--stdin", "-", "--stdin", "-"), "--stdin: standard input can be read only once"),
        (("--stdin", "F", "--stdin-after", "soon"), "'soon' is not a time"),
        (
            ("--stdin", "F", "--baud", "600000", "--crystal", "12000000"),
            "--baud 600000 is outside 50..375000",
        ),
        (("--crystal", "5"), "Invalid value for '--crystal'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_input_that_cannot_be_meant_is_refused(mirotwin, tmp_path, options, said):
    image, given = hex_file(tmp_path / "a.ihx", LOOP), tmp_path / "given"
    given.write_text("x")
    code, out, err = mirotwin("fw", "run", image, *(given if part == "F" else part for part in options))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err


def test_info_names_versions_engine_and_firmware(mirotwin):
    code, out, err = mirotwin("info")
    assert (code, err) == (0, "")
    sha256 = hashlib.sha256(image_path().read_bytes()).hexdigest()
    for word in ("mirotwin", "Python", "mcap", "engine", sha256, str(image_path()), "bytes of 8192"):
        assert word in out


def test_every_command_and_option_explains_itself():
    def walk(command):
        assert command.help
        for parameter in command.params:
            if isinstance(parameter, click.Option):
                assert parameter.help, f"{command.name} {parameter.name}"
        if isinstance(command, click.Group):
            for child in command.commands.values():
                walk(child)

    walk(main)
