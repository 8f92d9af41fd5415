"""`mirotwin fw header`, and `fw vectors` that does not get to its end. (What is in the files: tests/vectors.)"""

import signal
import subprocess
import time

import pytest

from miro_protocol import c_header
from tests import children
from tests.mirotwin import program
from tests.mutants.sdcc import needs_sdcc


def test_the_header_goes_to_stdout(mirotwin):
    assert mirotwin("fw", "header") == (0, c_header.render(), "")


@pytest.mark.parametrize("option", ["-o", "--out"])
def test_the_header_goes_to_the_file_that_is_named(mirotwin, tmp_path, option):
    assert mirotwin("fw", "header", option, tmp_path / "protocol.h") == (0, "", "")
    assert (tmp_path / "protocol.h").read_bytes() == c_header.render().encode()


@needs_sdcc
def test_a_program_with_the_header_compiles(mirotwin, tmp_path):
    mirotwin("fw", "header", "-o", tmp_path / "protocol.h")
    (tmp_path / "mine.c").write_text(
        '#define PROTOCOL_TABLES\n#include "protocol.h"\n'
        "unsigned char first;\n"
        "void main(void) { first = whitening[0] ^ crc_nibble_low[1] ^ crc_nibble_high[1]; }\n"
    )
    children.run(["sdcc", "-mmcs51", "--std-sdcc11", "mine.c"], cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "mine.ihx").is_file()


def test_a_file_where_the_folder_should_be_is_refused_with_the_way_out(mirotwin, tmp_path):
    (tmp_path / "mine").write_text("mine")
    said = mirotwin.refuses("fw", "vectors", "--out", tmp_path / "mine", "--force")
    assert said == f"{tmp_path / 'mine'}: exists and is not a folder; choose another folder with --out"
    assert (tmp_path / "mine").read_text() == "mine"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_set_leaves_nothing(tmp_path, number):
    words = ["fw", "vectors", "--out", str(tmp_path / "set"), "--per-opcode", "2000"]
    with children.start([*program.COMMAND, *words], stderr=subprocess.PIPE) as running:
        while running.poll() is None and not any(tmp_path.rglob("*.json")):
            time.sleep(0.01)
        running.send_signal(number)
        assert running.wait() == (130 if number is signal.SIGINT else 128 + number)
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_is_full_leaves_nothing_and_is_named(tmp_path):
    words = ("fw", "vectors", "--out", tmp_path / "set", "--per-opcode", "100")
    done = program.run(*words, preexec_fn=program.full_disk(16384))
    assert (done.returncode, done.stdout) == (2, "")
    remedy = "File too large; make room, or choose another folder with --out"
    assert done.stderr.splitlines()[-1] == f"mirotwin: error: {tmp_path / 'set'}: {remedy}"
    assert list(tmp_path.iterdir()) == []
