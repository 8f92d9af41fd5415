"""Several boards on one line: an RS485 bus, or two serial ports wired to each other."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_protocol.actions import Put
from miro_robot.faults import FaultKind
from miro_sim.scenario.board import BoardScenario, OtherBoard
from miro_sim.scenario.board_file import board_of_table
from miro_sim.world.conditions import Edge, Value
from miro_sim.world.world import World
from tests import children
from tests.robot.mcs51.asm import image_of

CRYSTAL_HZ = 11_059_200
BIT = 1152  # ticks at 9600
DELAY = CRYSTAL_HZ // 10_000
BAUD = "MOV TMOD,#20h\nMOV TH1,#0FDh\nMOV TL1,#0FDh\nSETB TR1\nMOV SCON,#50h\nCLR P3.5\n"
SEND = "send:\nSETB P3.5\nMOV SBUF,A\nJNB TI,$\nCLR TI\nNOP\nCLR P3.5\nRET\n"
# Counts what it hears at 30h, keeps the last at 31h, answers with the next one.
ANSWERS = (
    BAUD
    + "loop:\nJNB RI,$\nMOV A,SBUF\nCLR RI\nMOV 31h,A\nINC 30h\nINC A\nACALL pause\nACALL send\nSJMP loop\n"
)
ASKS = (
    BAUD
    + "MOV A,#40h\nACALL pause\nloop:\nACALL send\nMOV R6,#20\nwait:\nJB RI,got\nMOV R7,#200\nDJNZ R7,$\nDJNZ R6,wait\n"
    + "SJMP loop\ngot:\nMOV A,SBUF\nCLR RI\nMOV 31h,A\nINC 30h\nACALL pause\nSJMP loop\n"
)
PAUSE = "pause:\nMOV R5,#10\np:\nMOV R7,#250\nDJNZ R7,$\nDJNZ R5,p\nRET\n"
LISTENS = BAUD + "loop:\nJNB RI,$\nMOV A,SBUF\nCLR RI\nMOV 31h,A\nINC 30h\nSJMP loop\n"
BUS = {"part": "rs485", "pins": {"di": "P3.1", "ro": "P3.0", "de": "P3.5"}}
LED = {"part": "led", "pins": {"pin": "P1.0"}}


def hex_of(text):
    code = image_of(text + SEND + PAUSE)
    records = []
    for first, end in code.used:
        for start in range(first, end, 16):
            data = code.code[start : min(start + 16, end)]
            record = bytes([len(data), start >> 8, start & 255, 0]) + data
            records.append(f":{(record + bytes([-sum(record) & 255])).hex().upper()}")
    return "\n".join([*records, ":00000001FF", ""])


def board(parts):
    return board_of_table({"crystal_hz": CRYSTAL_HZ, "parts": parts, "serial": {"baud": 9600}}, "mine")


def world_of(*programs, bus=True, **keys):
    spec = board({"lamp": LED, **({"bus": BUS} if bus else {})})
    others = {
        f"b{slot}": OtherBoard(board=spec, image=hex_of(text)) for slot, text in enumerate(programs[1:], 1)
    }
    keys.setdefault("stop_on_fault", False)
    scenario = BoardScenario(board=spec, board_name="b0", others=others, **keys)
    return World(scenario, 0, image_of(programs[0] + SEND + PAUSE))


def got(world, slot):
    cpu = world.device(0, slot).board.cpu
    return cpu.peek_iram(0x30), cpu.peek_iram(0x31)


def heard(world):
    return bytes(event.value for _, event in world.lines[0].log.since(0, ("heard",)))


@pytest.mark.parametrize("bus", [True, False], ids=["rs485", "wired"])
def test_two_boards_talk_and_a_pc_hears_both(bus):
    world = world_of(ASKS, ANSWERS, bus=bus)
    world.run_to(600_000)
    count, last = got(world, 0)
    assert count >= 3
    assert last == 0x40 + count
    assert heard(world)[:6] == b"@AABBC"
    assert world.faults == []


def test_a_board_hears_another_100_us_later():
    world = world_of(ASKS, LISTENS)
    world.run_to(300_000)
    talks, hears = (world.device(0, slot).board.cpu for slot in range(2))
    sent = [(tick + DELAY, level) for tick, level in talks.txd.edges()]
    first = world.run_until(Value(of="b0.bus.driving", equals=False))
    assert first.tick >= 300_000
    assert hears.rxd.edges() == [edge for edge in sent if edge in hears.rxd.edges()]
    assert got(world, 1)[0] >= 2


def test_three_boards_hear_one_and_not_themselves():
    world = world_of(ASKS, LISTENS, LISTENS)
    world.run_to(400_000)
    assert got(world, 1) == got(world, 2)
    assert got(world, 1)[0] >= 2
    assert got(world, 0)[0] == 0


def test_a_pc_talks_to_all_of_them():
    world = world_of(LISTENS, LISTENS)
    world.inject(b"xy", at_tick=50_000)
    world.run_to(200_000)
    assert got(world, 0) == got(world, 1) == (2, ord("y"))


def test_two_wired_boards_have_no_room_for_a_pc():
    with pytest.raises(ValueError, match="two boards are wired to each other"):
        world_of(LISTENS, LISTENS, bus=False).inject(b"x")


def test_two_drivers_at_once_are_a_fault_with_both_names():
    world = world_of(ASKS, ASKS.replace("#40h", "#15h"))
    world.run_to(100_000)
    names = [fault.detail for fault in world.faults]
    assert names[0] == "bus: b1.bus and that of b0 both drive"
    assert world.faults[0].kind is FaultKind.NET_CONTENTION


def test_a_broken_wire_leaves_a_board_alone():
    world = world_of(ASKS, ANSWERS)
    world.run_to(300_000)
    counts = got(world, 0)[0], got(world, 1)[0]
    world.do(Put(310_000, 0, 0, "b1.bus.broken", True))
    world.run_to(340_000)
    before = got(world, 0)[0], got(world, 1)[0]
    world.run_to(700_000)
    assert (got(world, 0)[0], got(world, 1)[0]) == before
    assert min(counts) >= 1
    world.do(Put(710_000, 0, 0, "b1.bus.broken", False))
    world.run_to(1_200_000)
    assert got(world, 1)[0] > before[1]


def test_paths_and_pins_have_the_board_s_name_in_front():
    blinks = "loop:\nCPL P1.0\nMOV R7,#250\nDJNZ R7,$\nSJMP loop\n"
    world = world_of(LISTENS, blinks, bus=False)
    assert world.run_until(Edge(pin="b1.P1.0", level=0)).value == 0
    assert world.run_until(Value(of="b1.lamp.on", equals=True), within=100_000).tick
    assert world.device().value("b0.lamp.on") == 0
    values = world.lines[0].part_values(world.tick)[0].values
    assert set(values) >= {"b0.lamp.on", "b1.lamp.on"}


# All of them


def at_random(seed):
    chance = random.Random(seed)
    programs = [chance.choice([ASKS, ANSWERS, LISTENS]) for _ in range(chance.choice([2, 2, 3]))]
    world = world_of(*programs, bus=len(programs) > 2 or chance.random() < 0.7)
    if world.lines[0].transceivers[0] is not None:
        tick = 20_000
        for _ in range(4):
            world.inject(bytes(chance.choices(range(256), k=chance.randint(1, 3))), at_tick=tick)
            tick += chance.randint(3, 9) * 10 * BIT
    return world


@settings(max_examples=20)
@given(st.integers(0, 1 << 30), st.lists(st.integers(1, 60_000), max_size=8))
def test_pieces_and_saved_worlds_change_no_bit(seed, pieces):
    whole, cut, loaded = (at_random(seed) for _ in range(3))
    end_tick = 2_400_000
    whole.run_to(end_tick)
    tick = 0
    for piece in pieces:
        tick = min(tick + piece, end_tick)
        cut.run_to(tick)
        loaded.run_to(tick)
        saved = loaded.save()
        loaded = at_random(seed)
        loaded.load(saved)
    for world in (cut, loaded):
        world.run_to(end_tick)
        assert (world.digest, world.save()) == (whole.digest, whole.save())
    assert [fault.tick for fault in cut.faults] == [fault.tick for fault in whole.faults]
    assert heard(cut) == heard(whole)


def digest():
    worlds = [at_random(seed) for seed in range(6)]
    for world in worlds:
        world.run_to(2_400_000)
    return " ".join(world.digest for world in worlds)


def test_both_engines_do_the_same():
    assert children.same_uncompiled(digest)


def test_what_carries_no_bus_is_refused():
    plain, radio = board({}), board({"radio": {"part": "bluetooth", "pins": {"rxd": "P3.1", "txd": "P3.0"}}})
    for spec, said in ((plain, "has no RS485 transceiver"), (radio, "stands between it and the line")):
        others = {"b1": OtherBoard(board=spec, image=hex_of(LISTENS))}
        scenario = BoardScenario(board=board({"bus": BUS}), board_name="b0", others=others)
        with pytest.raises(BadInput, match=said):
            World(scenario, 0, image_of(LISTENS))


def test_a_put_reaches_the_board_that_it_names():
    spec = board({"key": {"part": "button", "pins": {"pin": "P1.5"}}})
    others = {"b1": OtherBoard(board=spec, image=hex_of("loop:\nMOV 31h,P1\nSJMP loop\n"))}
    world = World(BoardScenario(board=board({}), board_name="b0", others=others), 0, image_of(LISTENS))
    world.do(Put(10_000, 0, 0, "b1.key.pressed", True))
    world.run_to(20_000)
    assert got(world, 1)[1] == 0xDF
