"""Idle and power-down: what stops, what goes on, what ends them."""

import pytest

from tests.robot.mcs51.rig import cpu_with, sfr, whole_and_cut
from tests.states import snapshot

TIMER_WAKES = """
LJMP main
ORG 000Bh
INC 30h
RETI
ORG 0040h
main:
MOV TMOD,#02h
MOV TH0,#00h
MOV IE,#82h
SETB TR0
sleep:
ORL PCON,#01h
INC 31h
SJMP sleep
"""


def test_an_idle_cpu_is_woken_by_a_timer_and_goes_on_behind_the_instruction_that_put_it_to_sleep():
    cpu = cpu_with(TIMER_WAKES)
    cpu.run(256 * 20)
    assert (cpu.peek_iram(0x30), cpu.peek_iram(0x31)) == (19, 19)
    assert cpu.idle == 1
    assert cpu.instructions < 130
    assert cpu.idle_cycles > 256 * 18


def test_idle_time_is_the_same_in_one_run_and_in_many():
    whole, cut = whole_and_cut(lambda: cpu_with(TIMER_WAKES), 5000)
    assert snapshot(whole) == snapshot(cut)


@pytest.mark.parametrize("pending", ["NOP", "SETB TF0"])
def test_idle_lasts_until_an_enabled_interrupt(pending):
    cpu = cpu_with(f"MOV TMOD,#02h\nSETB TR0\n{pending}\nMOV IE,#84h\nORL PCON,#01h\nSJMP $")
    cpu.run(10_000)
    assert cpu.idle == 1
    assert cpu.cycles == 10_000
    assert cpu.asleep()
    assert sfr(cpu, "PCON") == 0x01


def test_a_pin_wakes_an_idle_cpu_to_the_cycle():
    cpu = cpu_with("SJMP main\nNOP\nCLR P1.0\nSJMP $\nmain:\nSETB IT0\nMOV IE,#81h\nORL PCON,#01h\nSJMP $")
    cpu.run(500)
    cpu.set_external(3, 0xFB, 12 * 500)
    cpu.run(600)
    assert cpu.bus.ports == [(1, 0xFE, 12 * 505)]  # sampled in 500, LCALL in 502 and 503, CLR in 504
    assert cpu.idle_cycles == 502 - 7


def test_power_down_freezes_timers_and_only_reset_leaves_it():
    cpu = cpu_with("MOV IE,#82h\nMOV TMOD,#02h\nSETB TR0\nMOV PCON,#03h\nSJMP $")
    cpu.run(1000)
    assert cpu.powered_down == 1
    assert cpu.idle == 0
    frozen = sfr(cpu, "TL0")
    cpu.set_external(3, 0x00, 12 * 1000)
    cpu.run(50_000)
    assert (sfr(cpu, "TL0"), cpu.pc, cpu.cycles) == (frozen, 11, 50_000)
    assert cpu.txd.settled_tick == 12 * 50_000
    cpu.reset()
    cpu.run(50_020)
    assert cpu.pc == 11
    assert sfr(cpu, "TL0") == frozen


def test_a_level_that_went_low_while_reset_was_held_interrupts_after_it():
    cpu = cpu_with(
        "LJMP main\nORG 0003h\nINC 30h\nCLR EX0\nRETI\nORG 0040h\nmain:\nMOV IE,#81h\nSETB TR0\nSJMP $"
    )
    cpu.hold()
    cpu.set_external(3, 0xFB, 12 * 10)
    cpu.run(100)
    cpu.reset()
    assert sfr(cpu, "TCON") == 0x02
    cpu.run(120)
    assert cpu.peek_iram(0x30) == 1


def test_an_idle_cpu_with_nothing_enabled_sleeps_on_and_general_flags_are_kept():
    cpu = cpu_with("MOV PCON,#0Dh\nSJMP $")
    cpu.run(100)
    assert sfr(cpu, "PCON") == 0x0D
    assert cpu.asleep()
