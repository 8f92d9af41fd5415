"""A car of parts around a processor that drives, counts and measures."""

import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import NEVER_TICK
from miro_exact.state import Flat
from miro_robot.build import board_of
from miro_robot.parts.nets import Observer
from miro_sim.scenario.board_file import board_of_table
from miro_sim.scenario.terminal import PinEvent
from tests.alone import Alone
from tests.robot.mcs51.asm import image_of
from tests.states import difference

HZ = 11_059_200
CAR = f"""
crystal_hz = {HZ}
[parts.bridge]
part = "l298"
pins = {{ ena = "P1.4", in1 = "P1.5", in2 = "P1.6" }}
[parts.motor]
part = "dc_motor"
pins = {{ a = "bridge.out1", b = "bridge.out2" }}
inertia_kg_m2 = 1e-4
friction_nm = 0.005
[parts.wheel]
part = "encoder"
pins = {{ shaft = "motor.shaft", a = "P3.4", b = "P3.2" }}
lines = 200
[parts.eyes]
part = "hc_sr04"
pins = {{ trig = "P1.1", echo = "P1.0" }}
noise_cm = 2.0
[parts.horn]
part = "buzzer"
pins = {{ pin = "P2.0" }}
[parts.neck]
part = "servo"
pins = {{ pwm = "P1.1" }}
[parts.key]
part = "button"
pins = {{ pin = "P3.3" }}
bounce_ms = 2.0
"""
PROGRAM = """
    AJMP main
    ORG 3
    INC 30h             ; falling edges of channel b
    RETI
main:
    MOV TMOD,#05h       ; timer 0 counts falling edges of channel a
    SETB TR0
    SETB IT0
    MOV IE,#81h
    CLR P1.6
    CLR P1.1
again:
    SETB P1.4
    MOV R7,#200
on:
    DJNZ R7,on
    JNB P3.3,held       ; a key that is held leaves the motor on
    CLR P1.4
held:
    MOV R7,#60
off:
    DJNZ R7,off
    CPL P2.0
    SETB P1.1
    MOV R7,#6
asks:
    DJNZ R7,asks
    CLR P1.1
    MOV R6,#200
waits:
    JB P1.0,answers
    DJNZ R6,waits
answers:
    MOV R5,#0
counts:
    JNB P1.0,done       ; 5 cycles a count
    INC R5
    CJNE R5,#255,counts
done:
    CJNE R5,#0,keeps
    SJMP again
keeps:
    MOV 31h,R5
    SJMP again
"""


def car(seed=0):
    spec = board_of_table(tomllib.loads(CAR), "car.board.toml")
    board = board_of(spec, image_of(PROGRAM), seed)
    board.cpu.rxd.settled_tick = NEVER_TICK
    board.put("eyes", "distance_cm", 20.0, 0)
    return board


def test_it_drives_counts_and_measures():
    board = car()
    board.run(HZ)
    assert 0.1 < board.value("bridge", "a.duty") < 0.9
    assert 60 < board.value("motor", "rpm") < 260
    counts = board.value("wheel", "counts")
    cpu = board.cpu
    counted = cpu.sfr(0x8C) << 8 | cpu.sfr(0x8A)
    assert counted > 200
    assert abs(counted - counts / 4) <= 1
    assert abs(cpu.peek_iram(0x30) - counted & 0xFF) in (0, 1, 255)
    assert 5 * 12e6 / HZ * cpu.peek_iram(0x31) == pytest.approx(20 * 58, abs=5 * 2 * 58)
    assert board.value("eyes", "pings") > 100
    assert board.value("horn", "sounded_ms") == pytest.approx(500, rel=0.1)


def test_the_processor_is_as_alone_with_the_edges_of_the_parts_from_a_file():
    """The parts are exact at its pins: nothing of what it does tells them from a file of levels."""
    board = car()
    nets = board.nets
    pins = {nets.number(f"P{port}.{bit}"): (port, bit) for port, bit in ((1, 0), (3, 2), (3, 3), (3, 4))}
    edges = [(0, net, 0) for net in pins if not nets.levels[net]]
    observer = Observer(pins)
    nets.observe(observer)
    for tick, pressed in ((HZ // 8, True), (HZ // 6, False)):
        board.run(tick)
        board.put("key", "pressed", pressed, tick)
    end = HZ // 4
    board.run(end)
    edges += observer.take(end)
    assert len(edges) > 100
    events = tuple(PinEvent(tick, *pins[net], level) for tick, net, level in edges)
    alone = Alone(image_of(PROGRAM), crystal_hz=HZ, pins=events)
    alone.run(pause=board.cpu.cycles)
    assert alone.cpu.cycles == board.cpu.cycles
    assert difference(Flat(board.cpu), Flat(alone.cpu).save(), Flat(board.cpu).save()) is None


@settings(max_examples=12)
@given(st.lists(st.integers(1, HZ // 5), min_size=1, max_size=8))
def test_any_cuts_any_looks_and_loading_at_any_tick_give_the_same(cuts):
    end = HZ // 5
    whole = car(3)
    whole.run(HZ // 10)
    whole.put("key", "pressed", True, HZ // 10)
    whole.run(end)
    board = car(3)
    pressed = False
    for tick in sorted({*cuts, HZ // 10, end}):
        board.run(tick)
        if tick == HZ // 10:
            board.put("key", "pressed", True, tick)
            pressed = True
        for name, key in (("motor", "turns"), ("neck", "angle_deg"), ("bridge", "a.duty")):
            board.value(name, key)
        other = car(3)
        Flat(other).load(Flat(board).save())
        board = other
    assert pressed
    assert Flat(board).save() == Flat(whole).save()


@pytest.mark.parametrize("order", [reversed, sorted])
def test_the_order_of_the_file_changes_no_bit(order):
    table = tomllib.loads(CAR)
    table["parts"] = {name: table["parts"][name] for name in order(list(table["parts"]))}
    board = board_of(board_of_table(table, "car.board.toml"), image_of(PROGRAM), 0)
    board.cpu.rxd.settled_tick = NEVER_TICK
    board.put("eyes", "distance_cm", 20.0, 0)
    board.run(HZ // 10)
    same = car()
    same.run(HZ // 10)
    assert Flat(board).save() == Flat(same).save()
