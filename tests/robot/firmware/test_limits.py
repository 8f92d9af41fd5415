"""Limits that must hold whatever the robot is doing: stack, latency, bus."""

import pytest

from miro_protocol.frames import ServiceFrame, TeamFrame, encode
from tests.robot.firmware.rig import CHARACTER, CYCLE, IMAGE, MS, Rig

SP, PSW, PORT_2 = 0x81, 0xD0, 2
CHIP_SELECTS, READ = 0x18, 0x02


def busy_rig(n=3):
    """A robot that gets everything at once: polls, settings, damage, and telemetry on its way out."""
    rig = Rig(slot=0, n=n)
    seq = 0
    for step in range(6):
        rig.send(encode(TeamFrame(3, seq, ((3000, -3000),) * n), n))
        rig.send(encode(ServiceFrame(seq + 1, 0, 1, (400, 40, 3000, 2000)), n))
        rig.send(encode(ServiceFrame(seq + 2, 0, 2, (5000,)), n))
        rig.send(b"\x2d\xd4" * 30)
        seq += 3
        assert step < 6
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


def test_the_stack_stays_far_from_the_end_of_memory():
    rig = busy_rig()
    symbol = IMAGE.symbols.find("__start__stack")
    assert symbol is not None
    start = symbol.address
    highest = 0
    end = min(rig.line_free, rig.now + 250 * MS)
    while rig.pending and rig.pending[0][0] < end:
        rig.cpu.rxd.append(*rig.pending.pop(0))
    rig.cpu.rxd.settled_tick = end + MS
    while rig.cpu.cycles * CYCLE < end:
        rig.board.run((rig.cpu.cycles + 1) * CYCLE)
        highest = max(highest, rig.cpu.sfr(SP))
    assert highest + 8 < 0x100  # both interrupts on top of the deepest call
    assert highest - start < 48


def test_the_serial_interrupt_is_short():
    """From RI to its being cleared: what the next character's gauge and the tick must tolerate."""
    rig = Rig()
    rig.send(encode(TeamFrame(0, 0, ((1, 1),) * 3), 3))
    end = rig.now + 20 * CHARACTER
    while rig.pending and rig.pending[0][0] < end:
        rig.cpu.rxd.append(*rig.pending.pop(0))
    rig.cpu.rxd.settled_tick = end + MS
    since, longest = None, 0
    while rig.cpu.cycles * CYCLE < end:
        rig.board.run((rig.cpu.cycles + 1) * CYCLE)
        pending = rig.cpu.sfr(0x98) & 1
        if not pending:
            since = None
        elif since is None:
            since = rig.cpu.cycles
        else:
            longest = max(longest, rig.cpu.cycles - since)
    assert 10 < longest < 70
