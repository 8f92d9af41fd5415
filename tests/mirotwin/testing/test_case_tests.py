"""`mirotwin test` of cases: saved failures, run again as a project's CI does."""

from xml.etree import ElementTree

import pytest

from miro_protocol.transmission import DOWN, Transmission
from miro_robot.image import load_hex
from mirotwin.fuzz.oracle import RobotOracle
from mirotwin.fuzz.target import target_for
from mirotwin.verify.bare.case import case_text
from mirotwin.verify.bare.machine import BareLine
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.verify.checks.rig import needs_sdcc, own_image, planted

PASSES = "# mirotwin stream 2\n2400000 > 55\n"
DAMAGED = bytes([12, 9, 1, 0, 16, 0, 32, 0])
"""Input of a session: a frame with one wrong character."""


@pytest.fixture(scope="module")
def mistaken(tmp_path_factory):
    """A firmware with a mistake, and the folder of a case of it beside a stream that expects nothing."""
    image = planted("takes frames with a bad CRC")
    target = target_for(image)
    assert target.run(DAMAGED)
    folder = tmp_path_factory.mktemp("cases")
    verdict = RobotOracle(target).confirm(DAMAGED, target.failure)
    (folder / "crc.stream").write_text(verdict.case())
    (folder / "silence.stream").write_text(PASSES)
    return image, folder, str(verdict.failure)


@needs_sdcc
def test_a_case_fails_with_the_mistake_and_passes_without(mirotwin, mistaken, tmp_path):
    image, folder, verdict = mistaken
    code, out, err = mirotwin("test", folder, "--firmware", image.path, "--junit", tmp_path / "j.xml")
    lines = out.splitlines()
    assert (code, err) == (1, "")
    assert lines[0].startswith(f"FAILED  {folder}/crc.stream (")
    assert lines[1:] == [
        f"    expectation failed: {verdict}",
        f"    mirotwin replay {folder}/crc.stream --firmware {image.path}",
        "1 failed",
    ]
    assert ElementTree.parse(tmp_path / "j.xml").find(".//testcase").get("name") == "crc"
    code, out, err = mirotwin("test", folder)
    assert (code, err, out.splitlines()[-1]) == (0, "", "1 passed")


def test_a_stream_that_is_named_may_expect_nothing(mirotwin, tmp_path):
    (tmp_path / "a.stream").write_text(PASSES)
    code, out, _ = mirotwin("test", tmp_path / "a.stream")
    assert (code, out.splitlines()[-1]) == (0, "1 passed")


def test_a_case_whose_check_has_no_occasion_any_more_fails(mirotwin, tmp_path):
    head = '# mirotwin stream 2\n#: verdict = "acts_within_ms: .."\n#: expect.acts_within_ms = true\n'
    (tmp_path / "a.stream").write_text(f"{head}2400000 > 55\n")
    code, out, _ = mirotwin("test", tmp_path)
    assert code == 1
    assert "    expectation not judged: acts_within_ms: the run had no occasion for it" in out.splitlines()


def test_a_case_that_cannot_be_read_stops_no_other(mirotwin, tmp_path):
    (tmp_path / "a.stream").write_text("# mirotwin stream 2\nx\n")
    (tmp_path / "b.stream").write_text(PASSES.replace("2\n", "2\n#: expect.no_fault = true\n", 1))
    code, out, _ = mirotwin("test", tmp_path)
    assert code == 2
    assert f"{tmp_path}/a.stream:2:1: " in out
    assert out.splitlines()[-1] == "1 cannot be run, 1 passed"


def test_a_case_of_a_bare_processor_runs_on_any_image_and_ends_with_3_for_a_fault(mirotwin, tmp_path):
    line = BareLine(bit_ticks=1152)
    for name, code_bytes in (("undefined", b"\xa5"), ("spins", b"\x80\xfe")):
        hex_file(tmp_path / f"{name}.ihx", code_bytes)
    image = load_hex(tmp_path / "undefined.ihx")
    header = case_text(image, line, [Transmission(5000, DOWN, b"a")], 9000)
    (tmp_path / "a.stream").write_text(
        header.replace("#: [bare]", "#: [expect]\n#: no_fault = true\n#: [bare]")
    )
    code, out, _ = mirotwin("test", tmp_path, "--firmware", tmp_path / "undefined.ihx")
    assert code == 3
    assert out.splitlines()[:2] == [
        f"FAULT  {tmp_path}/a.stream",
        "    expectation failed: no_fault: tick 12 (0.001 ms): firmware executed the undefined opcode A5 at"
        " 0x0000, tick 12",
    ]
    code, out, _ = mirotwin("test", tmp_path, "--firmware", tmp_path / "spins.ihx")
    assert (code, out.splitlines()[-1]) == (0, "1 passed")
    code, out, _ = mirotwin("test", tmp_path)
    assert (code, "which has no firmware of its own; give --firmware IMAGE.ihx" in out) == (2, True)


def test_a_check_that_no_case_names_is_refused(mirotwin, tmp_path):
    (tmp_path / "b.stream").write_text(PASSES)
    code, _, err = mirotwin("test", tmp_path / "b.stream", "--check", "mine.py:judge")
    assert code == 2
    assert "--check: no case is judged by mine.py:judge; leave it out" in err


def test_cases_of_the_robot_run_on_its_own_firmware(mirotwin, tmp_path):
    (tmp_path / "a.stream").write_text(PASSES.replace("2\n", "2\n#: expect.frames_accepted_min = 1\n", 1))
    code, _, _ = mirotwin("test", tmp_path, "--junit", tmp_path / "j.xml")
    assert code == 1
    assert own_image().sha256 in (tmp_path / "j.xml").read_text()
