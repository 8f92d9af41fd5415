"""`mirotwin fw header`: the wire's numbers for the C of a firmware."""

import pytest

from miro_protocol import c_header
from tests import children
from tests.mutants.sdcc import needs_sdcc


def test_the_header_goes_to_stdout(mirotwin):
    assert mirotwin("fw", "header") == (0, c_header.render(), "")


@pytest.mark.parametrize("option", ["-o", "--out"])
def test_the_header_goes_to_the_file_that_is_named(mirotwin, tmp_path, option):
    assert mirotwin("fw", "header", option, tmp_path / "protocol.h") == (0, "", "")
    assert (tmp_path / "protocol.h").read_bytes() == c_header.render().encode()


def test_a_header_that_is_there_is_replaced_by_force_only(mirotwin, tmp_path):
    file = tmp_path / "protocol.h"
    file.write_text("mine")
    code, out, err = mirotwin("fw", "header", "-o", file)
    assert (code, out) == (2, "")
    assert "is there already" in err
    assert "--force" in err
    assert file.read_text() == "mine"
    assert mirotwin("fw", "header", "-o", file, "--force")[0] == 0
    assert file.read_text("utf-8") == c_header.render()


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
