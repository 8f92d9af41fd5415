"""Text files as editors of Windows save them, with a byte-order mark and CRLF, are read like any others."""

from pathlib import Path

import pytest

from miro_exact.bad_input import BadInput
from miro_host.eye.eye_file import parse as parse_eye
from miro_host.eye.eye_file import text_of
from miro_protocol import stream
from miro_protocol.toml_text import tables
from miro_robot.wiring import load_wiring
from tests.mirotwin.conftest import SHORT

BOM = "\ufeff"


def windows(path, text):
    path.write_bytes((BOM + text.replace("\n", "\r\n")).encode())
    return path


def test_a_document_may_begin_with_one_mark_and_has_its_own_lines():
    assert tables(f"{BOM}a = 1\r\nb = 2\r\n") == {"a": 1, "b": 2}
    with pytest.raises(BadInput, match="line 2"):
        tables(f"{BOM}a = 1\r\nb = =\r\n")
    with pytest.raises(BadInput, match="line 1"):
        tables(f"{BOM}{BOM}a = 1\r\n")


def test_a_scenario_its_base_and_a_campaign_run(mirotwin, tmp_path):
    short = windows(tmp_path / "short.toml", SHORT)
    other = windows(tmp_path / "other.toml", 'scenario = "short.toml"\nduration_s = 0.1\n')
    for path in (short, other):
        mirotwin.succeeds("run", path, "--out", path.with_suffix(""), "-q", "--no-figure")
        mirotwin.succeeds("replay", path.with_suffix(""), "-q")
    pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")
    campaign = windows(tmp_path / "c.toml", 'scenario = "short.toml"\nseeds = "0-1"\n')
    mirotwin.succeeds("campaign", campaign, "--out", tmp_path / "c.parquet", "-q", "--jobs", "1")


def test_a_board_and_a_calibration_are_read(tmp_path):
    miro = Path(load_wiring.__code__.co_filename).with_name("boards") / "miro.board.toml"
    assert load_wiring(windows(tmp_path / "board.toml", miro.read_text())) == load_wiring()
    path = windows(tmp_path / "eye.toml", "a = 1\n")
    assert parse_eye(text_of(path), dict[str, int], f"{path}") == {"a": 1}


def test_a_stream_with_its_header_and_pins_are_read(mirotwin, tmp_path):
    text = '# mirotwin stream 2\n#: scenario = "silent"\n#: seed = 3\n24000 > 01 02\n'
    found = stream.read(windows(tmp_path / "a.stream", text))
    assert (found.header.seed, found.header.scenario, len(found.entries)) == (3, "silent", 1)
    image = windows(tmp_path / "loop.ihx", ":0200000080FE80\n:00000001FF\n")
    pins = windows(tmp_path / "a.pins", "# a comment\n0 * P3.2 1\n24 * P3.2 0\n")
    assert mirotwin("fw", "run", image, "--pins", pins, "--max-cycles", "100")[0] == 0
