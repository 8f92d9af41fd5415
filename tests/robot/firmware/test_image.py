"""The committed image: it is what the source builds, it fits, and observers find their symbols."""

import shutil
from pathlib import Path

import pytest

from miro_robot.firmware import image_path
from tests import children
from tests.robot.firmware.rig import IMAGE, iram

SOURCE = Path(__file__).parents[3] / "robot_fw" / "firmware"
VERSION = (SOURCE / "sdcc.version").read_text("utf-8").strip()


def sdcc_version():
    if shutil.which("sdcc") is None or shutil.which("make") is None:
        return ""
    return children.run(["sdcc", "--version"], capture_output=True, text=True, check=True).stdout


@pytest.mark.skipif(VERSION not in sdcc_version(), reason=f"needs make and SDCC {VERSION}")
def test_the_source_builds_the_committed_image_byte_for_byte(tmp_path):
    make = ["make", "-s", "-C", str(SOURCE), f"OUT={tmp_path / 'out'}", f"BUILD={tmp_path / 'build'}"]
    children.run(make, check=True, capture_output=True)
    assert (tmp_path / "out" / "miro.ihx").read_bytes() == image_path().read_bytes()


def test_the_image_fits_the_chip():
    assert IMAGE.size <= 8192


@pytest.mark.parametrize("name", ["_frames_accepted", "_frames_rejected", "_frames_stale"])
def test_observers_find_the_counters_in_internal_ram(name):
    assert 0x08 <= iram(name) < 0x100


def test_it_falls_asleep_by_copying_a_byte_that_interrupts_clear():
    """MOV PCON,sleep: one instruction from the decision to IDL, so no interrupt fits in between."""
    sleep = iram("_sleep")
    assert IMAGE.code.count(bytes([0x85, sleep, 0x87])) == 1
    assert IMAGE.code.count(bytes([0x75, sleep, 0x00])) == 2  # both interrupts


def test_interrupts_are_enabled_once_and_never_disabled():
    assert IMAGE.code.count(bytes([0xD2, 0xAF])) == 1  # SETB EA
    for disabling in (b"\xc2\xaf", b"\xc2\xac", b"\x75\xa8", b"\x53\xa8", b"\xf5\xa8"):  # CLR EA, CLR ES, IE
        assert disabling not in IMAGE.code
