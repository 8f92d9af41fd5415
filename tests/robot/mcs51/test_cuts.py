"""How a run is cut does not change it: one that stops after each cycle ends in the state of one in a single piece."""

import pytest

from miro_robot.mcs51.cpu import ASLEEP, BREAKPOINT
from tests.robot.mcs51.rig import cpu_with, sfr, whole_and_cut
from tests.states import restore, snapshot

T2EX_LOW, T2_AND_T2EX_LOW = 0xFD, 0xFC  # on P1
INT0_LOW, T0_LOW = 0xFB, 0xEF  # on P3


def test_a_pin_that_moves_while_scon_is_written_takes_no_tick_from_the_serial_port():
    """4316E section 2.13: mode 2 is clocked by the crystal. T0 falls in the second cycle of MOV SCON."""

    def prepare():
        cpu = cpu_with("MOV IE,#90h\nMOV SCON,#90h\nMOV SBUF,#0A5h\nMOV SCON,#98h\nSJMP $")
        cpu.set_external(3, T0_LOW, 12 * 7)
        return cpu

    whole, cut = whole_and_cut(prepare, 300)
    assert whole.txd.edges() == cut.txd.edges()
    assert snapshot(whole) == snapshot(cut)


@pytest.mark.parametrize(("cycle", "flag"), [(6, 0), (7, 0), (8, 0x02)])
def test_what_an_instruction_writes_into_tcon_comes_after_a_fall_in_its_last_cycle(cycle, flag):
    """4316E section 2.4: a register changes at the end of its instruction, and INT0 is sampled before that."""
    cpu = cpu_with("SETB IT0\n" + "NOP\n" * 5 + "MOV TCON,#01h\nNOP\nSJMP $")
    cpu.set_external(3, INT0_LOW, 12 * cycle)
    cpu.run(20)
    assert sfr(cpu, "TCON") == 0x01 | flag


def test_a_port_latch_that_holds_rxd_low_is_received_as_a_break():
    """4316E section 2.5: RXD is the pin, and a latch of 0 pulls it down."""

    def prepare():
        return cpu_with(
            "LJMP main\nORG 0023h\nCLR RI\nMOV P1,#0\nRETI\nmain:\nMOV SCON,#90h\nMOV IE,#90h\nCLR P3.0\nSJMP $"
        )

    whole, cut = whole_and_cut(prepare, 200)
    assert whole.bus.ports == cut.bus.ports
    assert (1, 0x00) in [(port, latch) for port, latch, _ in whole.bus.ports]
    assert snapshot(whole) == snapshot(cut)


@pytest.mark.parametrize(
    ("t2con", "rcap2"), [("0Fh", 0x00), ("0Ch", 0xFF)], ids=["counter", "reload of FFFFh"]
)
def test_tf2_interrupts_a_cycle_before_exf2_of_the_same_cycle(t2con, rcap2):
    """4316E section 2.16: TF2 is polled in its own cycle. A fall on T2 and T2EX in cycle 24 sets both flags in 25."""

    def prepare():
        cpu = cpu_with(
            "LJMP main\nORG 002Bh\nSJMP $\nORG 0040h\nmain:\nMOV IE,#0A0h\n"
            f"MOV RCAP2L,#{rcap2}\nMOV RCAP2H,#{rcap2}\nMOV TL2,#0FFh\nMOV TH2,#{0xFF - rcap2}\n"
            f"MOV T2CON,#{t2con}\n" + "NOP\n" * 40
        )
        cpu.set_external(1, T2_AND_T2EX_LOW, 12 * 24)
        return cpu

    cpu = prepare()
    assert cpu.run_until_any((0x2B,), 100) == BREAKPOINT
    assert cpu.cycles == 28
    whole, cut = whole_and_cut(prepare, 27)
    assert snapshot(whole) == snapshot(cut)


@pytest.mark.parametrize("pulse", [1, 2])
def test_a_low_level_is_answered_though_the_pin_falls_again_in_the_polling_cycle(pulse):
    """4316E section 2.16: the level is latched at S5P2 and the copy is polled a cycle later, whatever the pin does."""
    cpu = cpu_with("LJMP main\nORG 0003h\nSJMP $\nORG 0040h\nmain:\nMOV IE,#81h\n" + "NOP\n" * 40)
    for number in range(4):
        cpu.set_external(3, 0xFF if number % 2 else INT0_LOW, 12 * (20 + number * pulse))
    assert cpu.run_until_any((3,), 100) == BREAKPOINT
    assert cpu.cycles == 24


SLEEPER = "LJMP main\nORG 0023h\nCLR RI\nRETI\nmain:\nMOV SCON,#{scon}\nMOV IE,#90h\nsleep:\nMOV PCON,#1\nSJMP sleep"


def sleeper(text, *edges):
    cpu = cpu_with(text)
    cpu.stop_asleep = 1
    for number, tick in enumerate(edges):
        cpu.rxd.append(tick, number % 2)
    return cpu


@pytest.mark.parametrize(
    "edges", [(1000, 1001), (1000, 1010), (1000, 1100), (1000, 1640), (1000, 1700, 4000, 4010)]
)
@pytest.mark.parametrize("scon", ["90h", "0B0h"], ids=["mode 2", "mode 2, SM2"])
def test_a_sleeper_that_noise_on_rxd_does_not_wake_ends_its_run_in_the_same_cycle(scon, edges):
    whole, cut = whole_and_cut(lambda: sleeper(SLEEPER.format(scon=scon), *edges), 2000)
    assert whole.cycles < 2000
    assert snapshot(whole) == snapshot(cut)


@pytest.mark.parametrize("enabled", ["82h", "90h", "92h"])
def test_a_run_ends_where_the_processor_falls_asleep_in_a_routine_that_nothing_interrupts(enabled):
    """Timer 0 and a character raise flags later on, but their interrupts wait for RETI."""
    text = "LJMP main\nORG 000Bh\nMOV PCON,#1\nSJMP $\nmain:\nMOV SCON,#90h\nMOV TMOD,#2\nMOV TH0,#206\n"
    text += f"MOV TL0,#240\nMOV IE,#{enabled}\nSETB TF0\nSETB TR0\nSJMP $"
    whole, cut = whole_and_cut(lambda: sleeper(text, 1000, 1640), 2000)
    assert snapshot(whole) == snapshot(cut)


@pytest.mark.parametrize("reason", [BREAKPOINT, ASLEEP])
@pytest.mark.parametrize("port", [(1, T2EX_LOW), (3, INT0_LOW)], ids=["T2EX", "INT0"])
def test_a_state_loads_where_a_run_ended_in_the_cycle_in_which_a_pin_moves(port, reason):
    text = "MOV T2CON,#0Ch\n" + "NOP\n" * 8 + ("MOV PCON,#1\nNOP" if reason == ASLEEP else "NOP\nNOP\nNOP")
    ended, reached = sleeper(text), sleeper(text)
    reached.stop_asleep = 0
    for cpu in (ended, reached):
        cpu.set_external(*port, 12 * 12)
    assert ended.run_until_any((13 if reason == BREAKPOINT else 0x100,), 100) == reason
    reached.run(ended.cycles)
    assert snapshot(ended) == snapshot(reached)
    again = sleeper(text)
    restore(again, snapshot(ended))
    assert snapshot(again) == snapshot(ended)
