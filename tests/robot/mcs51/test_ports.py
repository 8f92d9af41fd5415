"""Ports: latches, pins, and which instruction sees which.

4316E is Atmel's 8051 Hardware Manual.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.mcs51.cpu import Cpu
from tests.robot.mcs51.asm import assemble
from tests.robot.mcs51.rig import RecordingBus, cpu_with, sfr, stepped
from tests.states import snapshot


def with_p1_held(text, steps):
    """Runs `text` with P1 latched at FF and the outside pulling it to A5."""
    cpu = cpu_with(text)
    cpu.set_external(1, 0xA5, 0)
    for _ in range(steps):
        cpu.step()
    return cpu


@pytest.mark.parametrize(
    ("text", "latch"),
    [
        ("INC P1", 0x00),
        ("DEC P1", 0xFE),
        ("ORL P1,#00h", 0xFF),
        ("ANL P1,#0FEh", 0xFE),
        ("XRL P1,#0Fh", 0xF0),
        ("ORL P1,A", 0xFF),
        ("CPL P1.0", 0xFE),
        ("CLR P1.1", 0xFD),
        ("SETB P1.1", 0xFF),
        ("MOV P1.2,C", 0xFB),
        ("DJNZ P1,0000h", 0xFE),
        ("JBC P1.1,0000h", 0xFD),
    ],
)
def test_read_modify_write_reads_the_latch(text, latch):
    """4316E, instruction set and section 2.5."""
    assert sfr(with_p1_held(text, 1), "P1") == latch


@pytest.mark.parametrize(
    ("text", "steps", "a"),
    [
        ("MOV A,P1", 1, 0xA5),
        ("XRL A,P1", 1, 0xA5),
        ("XCH A,P1", 1, 0xA5),
        ("PUSH P1\nPOP ACC", 2, 0xA5),
        ("MOV 30h,P1\nMOV A,30h", 2, 0xA5),
        ("MOV C,P1.1\nRLC A", 2, 0x00),
        ("MOV C,P1.2\nRLC A", 2, 0x01),
        ("ORL C,/P1.1\nRLC A", 2, 0x01),
        ("JB P1.1,0004h\nINC A", 2, 0x01),
        ("CJNE A,P1,0003h\nRLC A", 2, 0x01),
    ],
)
def test_everything_else_reads_the_pins(text, steps, a):
    assert with_p1_held(text, steps).a == a


def test_a_pin_is_latch_and_outside():
    cpu = cpu_with("MOV P1,#0Fh\nMOV A,P1")
    cpu.set_external(1, 0x3C, 0)
    cpu.step()
    cpu.step()
    assert cpu.a == 0x0C


def test_port_writes_are_told_with_the_tick_of_the_following_cycle():
    cpu = stepped("MOV P2,#12h\nCLR P2.1\nMOV P2,#10h\nMOV P2,A")
    assert cpu.bus.ports == [(2, 0x12, 24), (2, 0x10, 36), (2, 0x00, 72)]


@pytest.mark.parametrize(("tick", "seen"), [(21, 0x00), (22, 0xFF), (33, 0xFF), (34, 0xFF)])
@pytest.mark.parametrize("port", [0, 1, 2])
def test_a_pin_is_read_at_s5p2_of_the_first_cycle(tick, seen, port):
    cpu = cpu_with(f"NOP\nMOV R0,P{port}\nMOV A,R0")  # the read is in cycle 1: S5P2 is tick 21
    cpu.set_external(port, 0x00, tick)
    cpu.run(4)
    assert cpu.a == seen


def test_a_push_from_a_port_callback_is_seen_by_the_next_instruction():
    cpu = cpu_with("CLR P2.0\nMOV A,P0")
    cpu.bus.port_written = lambda port, latch, tick: cpu.set_external(0, 0x5A, tick)
    cpu.run(2)
    assert cpu.a == 0x5A


def test_p3_0_reads_the_rxd_line_and_its_latch():
    cpu = cpu_with("MOV A,P3\nMOV A,P3\nMOV A,P3\nCLR P3.0\nMOV A,P3")
    cpu.rxd.append(21, 0)
    cpu.rxd.append(33, 1)
    seen = []
    for _ in range(5):
        cpu.step()
        seen.append(cpu.a)
    assert seen == [0xFF, 0xFE, 0xFF, 0xFF, 0xFE]


def test_pushes_out_of_order_are_refused():
    cpu = cpu_with("NOP")
    cpu.set_external(1, 0, 1200)
    with pytest.raises(ValueError, match="P3 pushed for tick 600"):
        cpu.set_external(3, 0, 600)


def test_of_two_pushes_before_one_sample_the_last_counts():
    cpu = cpu_with("SETB IT0\nNOP\nNOP\nNOP")
    cpu.set_external(3, 0xFB, 24)
    cpu.set_external(3, 0xFF, 30)
    cpu.run(6)
    assert sfr(cpu, "TCON") == 0x01


class Watchful(RecordingBus):
    """Has the run end after each write of a port: the next one begins with a look at all pins."""

    def port_written(self, port, latch, tick):
        self.cpu.request_stop()


WRITES = [f"CPL P{port}.{bit}" for port in (1, 3) for bit in range(8) if (port, bit) not in ((3, 0), (3, 1))]
LONG_WRITES = ["MOV P1,#5Ah", "MOV P3,#0C3h", "XRL P3,#0F0h", "MOV 30h,P1", "MUL AB", "NOP"]


@given(
    st.lists(st.sampled_from(WRITES + LONG_WRITES), min_size=1, max_size=20),
    st.lists(st.tuples(st.integers(0, 300), st.sampled_from([1, 3]), st.integers(0, 255)), max_size=4),
    st.integers(1, 40),
)
def test_pins_that_nothing_samples_are_as_if_they_were_sampled_after_each_write(lines, pushes, cycles):
    states = []
    for bus in (RecordingBus(), Watchful()):
        cpu = Cpu(bus)
        bus.cpu = cpu
        cpu.load(assemble("\n".join([*lines, "SJMP $"])))
        for tick, port, levels in sorted(pushes):
            cpu.set_external(port, levels, tick)
        while cpu.cycles < cycles:
            cpu.run(cycles)
        states.append(snapshot(cpu))
    assert states[0] == states[1]


@pytest.mark.parametrize("latch", [0x00, 0xFF])
@pytest.mark.parametrize("outside", [0x00, 0xFF])
def test_a_shorted_pin_is_read_as_the_rail_whatever_drives_it(latch, outside):
    cpu = cpu_with(f"MOV P1,#{latch}\nMOV A,P1\nINC P1\nMOV R2,P1\nMOV A,P1")
    cpu.set_external(1, outside, 0)
    cpu.step()
    cpu.hold_pins(1, 0x20, 0x08, outside)
    cpu.step()
    assert cpu.a == (latch & outside | 0x08) & ~0x20
    cpu.step()
    assert sfr(cpu, "P1") == (latch + 1) & 0xFF  # of the latch, as before
    cpu.step()
    cpu.hold_pins(1, 0, 0, outside)
    cpu.step()
    assert cpu.a == (latch + 1) & outside & 0xFF


def test_a_shorted_pin_is_an_edge_for_timers_and_interrupts():
    cpu = cpu_with("MOV TMOD,#05h\nMOV TCON,#11h\nNOP\nNOP\nNOP\nNOP\nMOV A,TCON\nMOV R2,TL0")
    for _ in range(3):
        cpu.step()
    cpu.hold_pins(3, 0x14, 0, 0xFF)  # INT0, T0
    for _ in range(5):
        cpu.step()
    assert (cpu.a & 0x02, cpu.peek_iram(2)) == (0x02, 1)
