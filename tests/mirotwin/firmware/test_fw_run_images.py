"""`mirotwin fw run` of programs that do not begin at 0, of several images, and of input that was not all sent."""

import pytest

SENDS = bytes.fromhex("759850 758bff 758920 d28e 7599")
"""SCON 50h, TL1 FFh, TMOD 20h, TR1; MOV SBUF,#.. follows."""
ENDS = bytes.fromhex("80fe")


def placed(path, code, at=0):
    """An image with this code at an address."""
    record = bytes([len(code), at >> 8, at & 0xFF, 0]) + code
    path.write_text(f":{record.hex()}{-sum(record) & 0xFF:02x}\n:00000001ff\n".upper())
    return path


@pytest.fixture
def program(tmp_path):
    return placed(tmp_path / "program.ihx", SENDS + b"A" + ENDS, 0x8000)


XRAM = ("--code-in-xram",)


def test_a_program_that_does_not_begin_at_0_is_named_with_the_place_where_it_does(mirotwin, program):
    code, _, err = mirotwin("fw", "run", program, *XRAM)
    assert code == 2
    assert err.startswith(
        f"mirotwin: error: {program}: has no byte at 0x0000, and the processor starts there; give"
    )
    assert "give --start 0x8000" in err
    code, _, err = mirotwin("fw", "run", program, *XRAM, "--start", "0x9000")
    assert (code, "has no byte at 0x9000, and --start names it" in err) == (2, True)
    code, _, err = mirotwin("fw", "run", program, *XRAM, "--start", "nowhere")
    assert (code, err.startswith(f"mirotwin: error: {program}: --start: no symbol nowhere")) == (2, True)


def test_it_runs_from_there(mirotwin, program):
    assert mirotwin("fw", "run", program, *XRAM, "--start", "0x8000")[:2] == (0, "A")


def test_a_monitor_and_its_program_run_as_two_images(mirotwin, program, tmp_path):
    monitor = placed(tmp_path / "monitor.ihx", bytes.fromhex("028000"))
    assert mirotwin("fw", "run", monitor, program, *XRAM)[:2] == (0, "A")
    code, _, err = mirotwin("fw", "run", monitor, program, program, *XRAM)
    assert code == 2
    assert f"{program}: has a byte at 0x8000, as monitor.ihx has; link one of them elsewhere" in err


def test_a_text_that_came_only_for_the_first_line_is_told_so(mirotwin, tmp_path):
    image = placed(tmp_path / "a.ihx", SENDS + b">" + ENDS)
    (tmp_path / "lines").write_bytes(b"one\ntwo\n")
    words = ("--stdin", tmp_path / "lines", "--stdin-when", ">", "--stdin-by-line", "--max-cycles", 2_000_000)
    # the program takes no character, so RI stays up after the first
    _, _, err = mirotwin("fw", "run", image, *words)
    assert "was not seen;" not in err
    _, _, err = mirotwin("fw", "run", image, *words[:3], "?", "--stdin-by-line", "--max-cycles", 200_000)
    assert "--stdin-when: b'?' was not seen; 8 bytes of --stdin were not sent" in err


READS = "c298 3098fd"
"""CLR RI; JNB RI,$"""


def test_lines_after_a_text_that_does_not_come_again_are_told_with_how_often_it_came(mirotwin, tmp_path):
    image = placed(tmp_path / "a.ihx", SENDS + b">" + bytes.fromhex(READS * 4) + ENDS)
    (tmp_path / "lines").write_bytes(b"one\ntwo\n")
    words = ("--stdin", tmp_path / "lines", "--stdin-when", ">", "--stdin-by-line", "--max-cycles", 400_000)
    _, _, err = mirotwin("fw", "run", image, *words)
    assert "--stdin-when: b'>' was not seen again after 1 time; 4 bytes of --stdin were not sent" in err


def test_a_port_of_9_bits_is_told(mirotwin, tmp_path):
    image = placed(
        tmp_path / "a.ihx", bytes.fromhex("7598d0 758bff 758920 d28e") + bytes.fromhex(READS) + ENDS
    )
    (tmp_path / "bytes").write_bytes(b"x")
    code, _, err = mirotwin("fw", "run", image, "--stdin", tmp_path / "bytes")
    assert code == 0
    assert "the serial port takes characters of 9 bits; the ninth was 1 in all that were sent" in err
