"""Text of others (file names, names in .cdb and lcov files, C sources) reaches the terminal without control codes."""

import pytest

from miro_robot.firmware import source_folder
from miro_robot.inspect import lcov
from miro_robot.inspect.lcov import FileRecord
from tests.mirotwin.conftest import hex_file

NASTY = "a\x1b[31m\x07\x9b2J\u202e.c"
SHOWN = r"a\x1b[31m\x07\x9b2J\u202e.c"
FORGED = "x\nall  100.0 %  forged"


def plain(text):
    return all(char == "\n" or char.isprintable() for char in text)


@pytest.fixture
def image(tmp_path):
    """An endless loop whose .cdb says that it comes of line 1 of a file with a nasty name and a nasty text."""
    path = hex_file(tmp_path / "loop.ihx", b"\x80\xfe")
    path.with_suffix(".cdb").write_text(
        f"L:C${NASTY}$1$0$0:0\nL:G$main$0$0:0\nL:XG$main$0$0:0\n", encoding="utf-8"
    )
    (tmp_path / NASTY).write_text("for (;;)\t;\x1b]0;title\x07\n", encoding="utf-8")
    return path


def test_a_listing_shows_names_and_sources_escaped(mirotwin, image):
    out = mirotwin.succeeds("fw", "disasm", image)
    assert plain(out)
    assert f"; {SHOWN}:1: for (;;) ;" in " ".join(out.split())
    assert r"\x1b]0;title\x07" in out


def test_a_file_of_another_firmware_is_not_taken_for_that_of_the_robots_own(mirotwin, image):
    image.with_suffix(".cdb").write_text("L:C$main.c$27$0$0:0\nL:G$main$0$0:0\nL:XG$main$0$0:0\n")
    assert (source_folder() / "main.c").read_text().splitlines()[26].strip()
    out = mirotwin.succeeds("fw", "disasm", image)
    assert "; main.c:27\n" in out


@pytest.mark.parametrize("command", ["trace", "profile", "coverage"])
def test_no_command_that_looks_on_prints_a_control_code(mirotwin, image, command):
    code, out, err = mirotwin("fw", command, image, "--max-cycles", 20, "--to", "200t")
    assert code in (0, 42)
    assert plain(out + err)
    assert SHOWN in out or command != "coverage"


def test_an_lcov_name_with_codes_is_shown_escaped_and_kept_exactly(mirotwin, image, tmp_path):
    info = tmp_path / "fw.info"
    info.write_text(f"TN:\nSF:{NASTY}\nDA:1,1\nend_of_record\n", encoding="utf-8")
    code, out, _ = mirotwin("fw", "coverage", image, "--to", "200t", "--out", info, "--append")
    assert code == 0
    assert plain(out)
    assert SHOWN in out
    assert f"SF:{NASTY}\n" in info.read_text(encoding="utf-8")


def test_a_line_end_in_the_name_of_a_file_forges_no_line(mirotwin, image, tmp_path):
    raw = tmp_path / FORGED
    raw.write_bytes(b"\x00")
    for arguments in (["decode", raw, "--from-form", "raw"], ["decode", raw, "--from-form", "raw", "--json"]):
        out = mirotwin(*arguments)[1]
        assert not any(line.startswith("all") for line in out.splitlines())
    vcd = tmp_path / f"{FORGED}.vcd"
    _, out, _ = mirotwin("fw", "vcd", image, "--to", "2000t", "--out", vcd)
    assert not any(line.startswith("all") for line in out.splitlines())
    assert not any(line.startswith("all") for line in vcd.with_suffix(".gtkw").read_text().splitlines())


def test_a_line_end_in_a_name_forges_no_record_of_a_tracefile():
    for end in ("\n", "\r", "\x0b", "\x85", "\u2028"):
        record = FileRecord(lines={1: 0}, functions={f"f{end}DA:1,5": (1, 0)})
        text = lcov.encode({f"a{end}end_of_record": record})
        (path,) = lcov.decode(text, "x.info")
        assert path == f"a{repr(end)[1:-1]}end_of_record"
        assert lcov.decode(text, "x.info")[path].lines == {1: 0}


def test_a_tracefile_keeps_names_that_are_no_utf_8(mirotwin, image, tmp_path):
    info = tmp_path / "fw.info"
    info.write_bytes(b"TN:\nSF:\xff.c\nDA:1,1\nend_of_record\n")
    code, out, _ = mirotwin("fw", "coverage", image, "--to", "200t", "--out", info, "--append")
    assert code == 0
    assert r"\udcff.c" in out
    assert b"SF:\xff.c\n" in info.read_bytes()
