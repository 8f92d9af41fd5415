"""The committed image: what the source builds, and limits that hold whatever a robot does: stack, latency, bus."""

import shutil
from pathlib import Path

import pytest

from miro_protocol.frames import ServiceFrame, TeamFrame, encode
from miro_robot.firmware import image_path
from tests import children
from tests.robot.firmware.rig import CHARACTER, CYCLE, IMAGE, MS, Rig, iram

SOURCE = Path(__file__).parents[3] / "robot_fw" / "firmware"
VERSION = (SOURCE / "sdcc.version").read_text("utf-8").strip()


def sdcc_version():
    if shutil.which("sdcc") is None or shutil.which("make") is None:
        return ""
    return children.run(["sdcc", "--version"], capture_output=True, text=True, check=True).stdout


@pytest.mark.skipif(VERSION not in sdcc_version(), reason=f"needs make and SDCC {VERSION}")
def test_the_source_builds_the_committed_image_and_listing_byte_for_byte(tmp_path):
    make = ["make", "-s", "-C", str(SOURCE), f"OUT={tmp_path / 'out'}", f"BUILD={tmp_path / 'build'}"]
    children.run(make, check=True, capture_output=True)
    for suffix in (".ihx", ".rst"):
        assert (tmp_path / f"out/miro{suffix}").read_bytes() == image_path().with_suffix(suffix).read_bytes()


def test_it_falls_asleep_by_copying_a_byte_that_interrupts_clear():
    """MOV PCON,sleep: one instruction from the decision to IDL, so no interrupt fits in between."""
    sleep = iram("_sleep")
    assert IMAGE.code.count(bytes([0x85, sleep, 0x87])) == 1
    assert IMAGE.code.count(bytes([0x75, sleep, 0x00])) == 2  # both interrupts


def test_interrupts_are_enabled_once_and_never_disabled():
    assert IMAGE.code.count(bytes([0xD2, 0xAF])) == 1  # SETB EA
    for disabling in (b"\xc2\xaf", b"\xc2\xac", b"\x75\xa8", b"\x53\xa8", b"\xf5\xa8"):  # CLR EA, CLR ES, IE
        assert disabling not in IMAGE.code


SP, PORT_2 = 0x81, 2
CHIP_SELECTS, READ = 0x18, 0x02


def busy_rig(n=3):
    """A robot that gets everything at once: polls, settings, damage, and telemetry on its way out."""
    rig = Rig(slot=0, n=n)
    for seq in range(0, 18, 3):
        rig.send(encode(TeamFrame(3, seq, ((3000, -3000),) * n), n))
        rig.send(encode(ServiceFrame(seq + 1, 0, 1, (400, 40, 3000, 2000)), n))
        rig.send(encode(ServiceFrame(seq + 2, 0, 2, (5000,)), n))
        rig.send(b"\x2d\xd4" * 30)
    return rig


@pytest.mark.parametrize("n", [3, 5])
def test_a_busy_robot_never_faults(n):
    """The rig raises on any fault: LM629 written while busy, two chips on the bus, code outside the image."""
    rig = busy_rig(n)
    rig.run_to(rig.line_free + 600 * MS)
    accepted, rejected, stale = rig.counters
    assert (accepted, stale) == (18, 0)
    assert rejected > 0
    assert rig.board.left.status & 0x02 == rig.board.right.status & 0x02 == 0


def test_two_chips_are_never_selected_for_a_read():
    rig = busy_rig()
    rig.run_to(rig.line_free)
    for _, port, latch in rig.board.writes:
        if port == PORT_2 and not latch & READ:
            assert latch & CHIP_SELECTS


def each_cycle(rig, end):
    """Runs a robot cycle by cycle, as far as instructions can be cut."""
    while rig.pending and rig.pending[0][0] < end:
        rig.cpu.rxd.append(*rig.pending.pop(0))
    rig.cpu.rxd.settled_tick = end + MS
    while rig.cpu.cycles * CYCLE < end:
        rig.board.run((rig.cpu.cycles + 1) * CYCLE)
        yield


def test_the_stack_stays_far_from_the_end_of_memory():
    rig = busy_rig()
    start, _ = IMAGE.symbols.stack
    highest = 0
    for _ in each_cycle(rig, min(rig.line_free, rig.now + 250 * MS)):
        highest = max(highest, rig.cpu.sfr(SP))
    assert highest + 8 < 0x100  # both interrupts on top of the deepest call
    assert highest - start < 48


def test_the_serial_interrupt_is_short():
    """From RI to its being cleared: what the next character's gauge and the tick must tolerate."""
    rig = Rig()
    rig.send(encode(TeamFrame(0, 0, ((1, 1),) * 3), 3))
    since, longest = None, 0
    for _ in each_cycle(rig, rig.now + 20 * CHARACTER):
        pending = rig.cpu.sfr(0x98) & 1
        if not pending:
            since = None
        elif since is None:
            since = rig.cpu.cycles
        else:
            longest = max(longest, rig.cpu.cycles - since)
    assert 10 < longest < 70
