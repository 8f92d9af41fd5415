"""`mirotwin fw header`."""

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
