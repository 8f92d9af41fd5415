"""A Bluetooth module, and an RS485 transceiver, between the serial port and who is on its line."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_protocol.actions import Power, Put
from miro_robot.faults import FaultKind
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_file import board_of_table
from miro_sim.world.world import World
from tests import children
from tests.robot.mcs51.asm import image_of

CRYSTAL_HZ = 11_059_200
BIT = 1152  # ticks at 9600
CHARACTER = 10 * BIT
BAUD = "MOV TMOD,#20h\nMOV TH1,#0FDh\nMOV TL1,#0FDh\nSETB TR1\nMOV SCON,#50h\nCLR P3.5\n"
ECHO = (
    BAUD + "loop:\nJNB RI,$\nMOV A,SBUF\nCLR RI\nSETB P3.5\nMOV SBUF,A\nJNB TI,$\nCLR TI\nCLR P3.5\nSJMP loop"
)
BLUETOOTH = {"part": "bluetooth", "pins": {"rxd": "P3.1", "txd": "P3.0", "state": "P3.2"}}
RS485 = {"part": "rs485", "pins": {"di": "P3.1", "ro": "P3.0", "de": "P3.5", "re": "P3.5"}}


def world_of(part, program=ECHO, **keys):
    board = board_of_table(
        {"crystal_hz": CRYSTAL_HZ, "parts": {"line": part}, "serial": {"baud": 9600}}, "mine"
    )
    return World(BoardScenario(board=board, stop_on_fault=False, **keys), 0, image_of(program))


def heard(world):
    return bytes(event.value for _, event in world.lines[0].log.since(0, ("heard",)))


def lost(world):
    return world.device().value("line.lost")


# Bluetooth


def test_a_connected_module_is_a_line():
    world = world_of(BLUETOOTH)
    world.inject(b"hello", at_tick=50_000)
    world.run_to(200_000)
    assert (heard(world), lost(world)) == (b"hello", 0)


def test_without_a_master_nothing_comes_through_either_way():
    world = world_of(BLUETOOTH, put={"line.connected": False})
    world.inject(b"ab", at_tick=50_000)
    world.run_to(100_000)
    assert (heard(world), lost(world)) == (b"", 2)
    world.do(Put(110_000, 0, 0, "line.connected", True))
    world.inject(b"c", at_tick=120_000)
    world.run_to(126_000)
    world.do(Put(127_000, 0, 0, "line.connected", False))
    world.run_to(200_000)
    assert (heard(world), lost(world)) == (b"", 3)  # the answer went nowhere


def test_the_state_pin_says_whether_a_master_is_there():
    world = world_of(BLUETOOTH, "loop:\nMOV A,P3\nMOV 30h,A\nSJMP loop")
    seen = []
    for tick, connected in ((10_000, True), (20_000, False), (30_000, True)):
        world.do(Put(tick, 0, 0, "line.connected", connected))
        world.run_to(tick + 1_000)
        seen.append(world.device().board.cpu.peek_iram(0x30) >> 2 & 1)
    assert seen == [1, 0, 1]


@pytest.mark.parametrize(("baud", "said"), [(9600, b"x"), (9900, b"x"), (10_100, b""), (19_200, b"")])
def test_another_rate_than_the_module_s_is_lost(baud, said):
    world = world_of({**BLUETOOTH, "baud": baud}, BAUD + "MOV SBUF,#78h\nSJMP $")
    world.run_to(100_000)
    assert (heard(world), lost(world)) == (said, 1 - len(said))


def test_the_host_sends_with_the_module_s_rate():
    world = world_of({**BLUETOOTH, "baud": 38_400})
    assert world.bit_ticks == 288


def test_without_supply_it_carries_nothing():
    world = world_of(BLUETOOTH)
    world.do(Power(10_000, 0, 0, 0))
    world.do(Power(100_000, 0, 0, 1))
    world.inject(b"a", at_tick=50_000)
    world.inject(b"b", at_tick=150_000)
    world.run_to(200_000)
    assert (heard(world), lost(world)) == (b"b", 1)


# RS485


def test_answers_to_a_pc_that_sends_on_are_lost_and_a_fault():
    world = world_of(RS485)
    world.inject(b"hello", at_tick=50_000)
    world.run_to(50_000 + 9 * BIT)
    assert world.device().value("line.driving") is False
    world.run_to(200_000)
    board = world.device().board
    assert (heard(world), lost(world)) == (b"o", 4)
    assert {fault.kind for fault in board.faults} == {FaultKind.NET_CONTENTION}
    assert "line and the PC both drive" in board.faults[0].detail


def test_a_pc_that_waits_gets_all_answers():
    world = world_of(RS485)
    for number in range(4):
        world.inject(b"abcd"[number : number + 1], at_tick=50_000 + 3 * CHARACTER * number)
    world.run_to(250_000)
    assert (heard(world), lost(world), world.faults) == (b"abcd", 0, [])
    assert world.device().value("line.drove_us") == pytest.approx(9.5 * 104.2, rel=0.1)


@pytest.mark.parametrize(
    "program",
    ["MOV SBUF,#55h\nSJMP $", "MOV SBUF,#55h\nMOV R7,#255\nDJNZ R7,$\nSETB P3.5\nSJMP $"],
    ids=["never", "late"],
)
def test_what_is_sent_without_the_driver_is_lost(program):
    world = world_of(RS485, BAUD + program)
    world.run_to(100_000)
    assert (heard(world), lost(world)) == (b"", 1)


def test_a_driver_that_is_left_before_the_stop_bit_loses_the_character():
    left = "SETB P3.5\nMOV SBUF,#55h\nMOV R7,#255\nDJNZ R7,$\nCLR P3.5\nSJMP $"
    world = world_of(RS485, BAUD + left)
    world.run_to(100_000)
    assert (heard(world), lost(world)) == (b"", 1)


def test_a_pc_that_begins_while_the_board_drives_is_a_fault_at_its_first_bit():
    world = world_of(
        RS485, BAUD + "SETB P3.5\nMOV R6,#40\nl:\nMOV R7,#250\nDJNZ R7,$\nDJNZ R6,l\nCLR P3.5\nSJMP $"
    )
    world.inject(b"x", at_tick=50_000)
    world.run_to(400_000)
    assert [(fault.kind, fault.tick) for fault in world.faults] == [(FaultKind.NET_CONTENTION, 50_000)]


# All of them


def sent_at_random(part, seed):
    chance = random.Random(seed)
    world = world_of(part)
    tick = 20_000
    for _ in range(8):
        world.inject(bytes(chance.choices(range(256), k=chance.randint(1, 3))), at_tick=tick)
        tick += chance.randint(4, 9) * CHARACTER
        if part is BLUETOOTH and chance.random() < 0.4:
            world.do(Put(tick - chance.randint(1, 3_000), 0, 0, "line.connected", chance.random() < 0.7))
    return world


@pytest.mark.parametrize("part", [BLUETOOTH, RS485], ids=["bluetooth", "rs485"])
@settings(max_examples=15)
@given(st.integers(0, 1 << 30), st.lists(st.integers(1, 90_000), max_size=8))
def test_pieces_and_saved_worlds_change_no_bit(part, seed, pieces):
    whole, cut, loaded = (sent_at_random(part, seed) for _ in range(3))
    end_tick = 2_500_000
    whole.run_to(end_tick)
    tick = 0
    for piece in pieces:
        tick = min(tick + piece, end_tick)
        cut.run_to(tick)
        loaded.run_to(tick)
        saved = loaded.save()
        loaded = world_of(part)
        loaded.load(saved)
    for world in (cut, loaded):
        world.run_to(end_tick)
        assert (world.digest, lost(world), world.save()) == (whole.digest, lost(whole), whole.save())


def digest():
    worlds = [sent_at_random(part, seed) for part in (BLUETOOTH, RS485) for seed in range(3)]
    for world in worlds:
        world.run_to(2_500_000)
    return " ".join(world.digest for world in worlds)


def test_both_engines_do_the_same():
    assert children.same_uncompiled(digest)


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        (
            {"line": {**BLUETOOTH, "pins": {"rxd": "P1.1", "txd": "P3.0"}}},
            'parts.line.pins.rxd: line carries the serial line, and rxd is not on P3.1; write rxd = "P3.1"',
        ),
        (
            {"a": BLUETOOTH, "line": RS485},
            "parts.line.pins.di: a carries the serial line, too; leave one of them out",
        ),
    ],
)
def test_it_is_at_the_serial_port_and_alone_there(parts, said):
    with pytest.raises(BadInput) as found:
        board_of_table({"crystal_hz": CRYSTAL_HZ, "parts": parts}, "mine.board.toml")
    assert said in str(found.value)
