"""A board with parts on a wire of the world: what a test puts and reads, its records, and its state."""

from typing import Annotated, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import Meta

from miro_exact.clock import NEVER_TICK
from miro_exact.state import TICK
from miro_protocol.actions import Power, Put, Reset
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.board_spec import BoardSpec, PartSpec
from miro_robot.parts.button import Button
from miro_robot.parts.keys import HIGH, IN, LOW, STRONG, PartKeys, Pin
from miro_robot.parts.led import Led
from miro_robot.parts.part import Part
from miro_sim.scenario.board import PERIOD_TICKS, BoardScenario
from miro_sim.world.conditions import Edge
from miro_sim.world.waits import WaitExpired
from miro_sim.world.world import World
from tests import children
from tests.robot.mcs51.asm import image_of

MODES = ("pulse", "none")
CRYSTAL_HZ = 11_059_200
NEVER = NEVER_TICK


class Pinger(PartKeys, frozen=True, kw_only=True, tag="pinger"):
    """400 us after each fall of `trig` there is a pulse on `echo`, longer by up to 100 us of noise."""

    PINS = (Pin("trig", IN), Pin("echo", STRONG))
    PUTS = {
        "width_us": Annotated[float, Meta(ge=1.0, le=30_000.0)],
        "mode": Literal["pulse", "none"],
        "loud": bool,
    }
    READS = {"width_us": "of a pulse", "pulses": "so far", "mode": "pulse or none", "loud": "a flag"}

    def make(self, place):
        return PingerPart(self, place)


class PingerPart(Part):
    STATE = {"width_us": "d", "pulses": TICK, "kind": "B", "loud": "B", "up": "B"}

    def __init__(self, keys, place):
        Part.__init__(self, keys, place)
        self.width_us, self.pulses, self.kind, self.loud, self.up = 500.0, 0, 0, 0, 0

    def start(self, tick):
        self.up = 0
        self.drive(1, LOW)

    def changed(self, pins, tick):
        if pins & 1 and not self.level(0) and not self.kind and self.next_tick == NEVER:
            self.next_tick = tick + self.ticks(400)

    def due(self, tick):
        self.up = 1 - self.up
        self.drive(1, HIGH if self.up else LOW)
        self.pulses += self.up
        width_us = self.width_us + 100.0 * self.place.noise.uniform(self.pulses)
        self.next_tick = tick + self.ticks(width_us) if self.up else NEVER

    def put(self, name, value, tick):
        if name == "mode":
            self.kind = MODES.index(value)
        elif name == "loud":
            self.loud = int(value)
        else:
            self.width_us = value

    def read(self, name, tick):
        return (
            MODES[self.kind] if name == "mode" else bool(self.loud) if name == "loud" else getattr(self, name)
        )


BOARD = BoardSpec(
    crystal_hz=CRYSTAL_HZ,
    parts={
        "eyes": PartSpec(keys=Pinger(), pins={"trig": "P1.1", "echo": "P1.0"}),
        "lamp": PartSpec(keys=Led(), pins={"pin": "P2.0"}),
        "key": PartSpec(keys=Button(bounce_ms=2.0), pins={"pin": "P3.2"}),
    },
)
PINGS = """
loop:
CLR P1.1
SETB P1.1
wait:
JNB P1.0,wait
high:
INC R2
JB P1.0,high
MOV C,P3.2
MOV P2.0,C
SJMP loop
"""


def wired_world(script=None, seed=0, text=PINGS, board=BOARD, **keys):
    return World(BoardScenario(board=board, **keys), seed, image_of(text), script)


def put(tick, path, value):
    return Put(tick, 0, 0, path, value)


# --------------------------------------------------------------------------------------------- what is put


def test_what_is_put_acts_first_on_its_tick():
    world = wired_world()
    world.do(put(500_004, "key.pressed", True))
    world.run_to(500_004)
    assert world.device().value("key.pressed") is False
    world.run_to(500_005)
    assert world.device().value("key.pressed") is True


def test_a_scenario_puts_values_at_power_on():
    world = wired_world(put={"eyes.width_us": 900, "eyes.mode": "none"})
    world.run_to(200_000)
    values = world.device().values()
    assert (values["eyes.width_us"], values["eyes.mode"], values["eyes.pulses"]) == (900.0, "none", 0)


def test_a_period_has_what_was_put_and_the_values_at_its_end():
    world = wired_world([put(0, "eyes.loud", True), put(100_000, "eyes.width_us", 20_000)])
    period = world.step()
    assert period.actions == (put(0, "eyes.loud", True), put(100_000, "eyes.width_us", 20_000.0))
    (parts,) = period.values
    assert (parts.tick, parts.network, parts.slot) == (PERIOD_TICKS, 0, 0)
    assert list(parts.values) == [
        *("eyes.width_us", "eyes.pulses", "eyes.mode", "eyes.loud"),
        *("key.pressed", "key.closed", "lamp.on", "lamp.flashes"),
    ]
    assert parts.values == world.device().values()


def test_a_put_is_an_event_that_says_what():
    world = wired_world([put(100_000, "eyes.width_us", 60)])
    world.run_to(200_000)
    assert [str(event) for _, event in world.lines[0].log.since(0)] == [
        "tick 100000: net0/robot0: put eyes.width_us = 60"
    ]


@pytest.mark.parametrize(
    ("path", "value", "what"),
    [
        ("eyes", 1, "'eyes' is not PART.KEY; name a part"),
        ("eye.width_us", 1, "the board has no part 'eye'; did you mean eyes"),
        ("nose.width_us", 1, "the board has no part 'nose'; its parts are eyes, key, lamp"),
        ("eyes.with_us", 1, "nothing can be put at 'with_us' of part 'eyes' .pinger.; did you mean width_us"),
        ("eyes.pulses", 1, "nothing can be put at 'pulses'.*use width_us, mode or loud"),
        ("lamp.on", True, "nothing can be put at 'on' of part 'lamp' .led.; leave it out"),
        ("eyes.width_us", "far", "eyes.width_us = 'far': expected a number, got a string"),
        ("eyes.width_us", 0.5, "eyes.width_us = 0.5: is out of range; must be >= 1.0"),
        ("eyes.width_us", True, "expected a number, got true or false"),
        ("eyes.mode", "off", "use none or pulse"),
        ("eyes.loud", 1, "expected true or false, got a whole number"),
        ("eyes.width_us", float("inf"), "is out of range"),
    ],
)
def test_what_no_part_takes_is_refused_and_changes_nothing(path, value, what):
    world = wired_world()
    before = world.save()
    with pytest.raises(ValueError, match=what):
        world.do(put(1_000, path, value))
    with pytest.raises(ValueError, match=what):
        wired_world(put={path: value})
    assert world.save() == before


def test_a_value_that_no_part_has_is_refused():
    device = wired_world().device()
    with pytest.raises(ValueError, match=r"part 'lamp' .led. has no value 'flash'; did you mean flashes"):
        device.value("lamp.flash")
    with pytest.raises(ValueError, match=r"the board has no parts; add .parts.eyes. to the board's file"):
        World(BoardScenario(), 0, image_of("SJMP $")).device().value("eyes.width_us")


def test_a_put_on_a_board_without_parts_is_refused():
    world = World(BoardScenario(), 0, image_of("SJMP $"))
    with pytest.raises(ValueError, match="the board has no parts"):
        world.do(put(1_000, "eyes.width_us", 60))


# -------------------------------------------------------------------------------------------- state

SCRIPT = (
    put(0, "eyes.width_us", 333.25),
    put(700_001, "key.pressed", True),
    put(700_301, "eyes.width_us", 2_000),
    Reset(1_000_003, 0, 0, 1),
    Reset(1_000_903, 0, 0, 0),
    Power(1_400_000, 0, 0, 0),
    put(1_500_000, "key.pressed", False),
    Power(1_600_001, 0, 0, 1),
    put(1_900_007, "eyes.mode", "none"),
)
END_TICK = 2 * PERIOD_TICKS


def scripted(script=SCRIPT):
    world = wired_world(script)
    world.run_to(END_TICK)
    return world


@pytest.fixture(scope="module")
def whole():
    return scripted()


@settings(deadline=None, max_examples=25)
@given(st.data())
def test_cut_saved_and_announced_at_any_tick_the_bits_are_the_same(whole, data):
    world = wired_world([item for item in SCRIPT if not item.tick])
    for action in SCRIPT[1:]:
        latest = action.tick - 120
        world.run_to(data.draw(st.integers(min(world.tick, latest), latest)))
        world.do(action)
        if data.draw(st.booleans()):
            other = wired_world([])
            other.load(world.save())
            world = other
        if action.tick < 1_000_000 and data.draw(st.booleans()):
            with pytest.raises(WaitExpired):
                world.run_until(Edge(pin="P1.7"), within=data.draw(st.integers(1, 100)))
    world.run_to(END_TICK)
    assert (world.digest, world.state.save()) == (whole.digest, whole.state.save())


ECHO = """
MOV RCAP2H,#0FFh
MOV RCAP2L,#0DCh
MOV T2CON,#34h
MOV SCON,#50h
loop:
CPL P1.1
JNB RI,loop
CLR RI
MOV A,SBUF
MOV SBUF,A
SJMP loop
"""
BIT_TICKS = 1152
BYTES = (Transmission(150_000, DOWN, b"ab"), Transmission(300_001, DOWN, b"c", bad_stop=(0,)))


@settings(deadline=None, max_examples=15)
@given(st.data())
def test_bytes_among_puts_give_the_same_bits_whoever_sends_them_and_when(data):
    keys = {"text": ECHO, "bit_ticks": BIT_TICKS}
    items = sorted((*SCRIPT, *BYTES), key=lambda item: item.tick)
    whole = wired_world(items, **keys)
    whole.run_to(END_TICK)
    world = wired_world([item for item in SCRIPT if not item.tick], **keys)
    for item in items:
        if not item.tick:
            continue
        latest = item.tick - 120
        world.run_to(data.draw(st.integers(min(world.tick, latest), latest)))
        if isinstance(item, Transmission):
            world.inject(item.data, at_tick=item.tick, bad_stop=item.bad_stop)
        else:
            world.do(item)
        if data.draw(st.booleans()):
            other = wired_world([], **keys)
            other.load(world.save())
            world = other
    world.run_to(END_TICK)
    assert (world.digest, world.state.save()) == (whole.digest, whole.state.save())


def test_noise_of_parts_follows_the_seed():
    worlds = [wired_world(seed=seed) for seed in (0, 1)]
    for world in worlds:
        world.run_to(100_000)
    assert worlds[0].state.save() != worlds[1].state.save()


def test_a_saved_world_of_another_board_or_with_other_values_at_power_on_is_refused():
    saved = wired_world().save()
    other_parts = BoardSpec(
        crystal_hz=CRYSTAL_HZ, parts={**BOARD.parts, "key": PartSpec(keys=Button(), pins={"pin": "P3.2"})}
    )
    for other in (wired_world(put={"eyes.width_us": 5}), wired_world(board=other_parts), wired_world(seed=3)):
        with pytest.raises(ValueError, match="the saved world has"):
            other.load(saved)
    wired_world(expect={"no_fault": True}, step=({"pause_ms": 3},)).load(saved)


def test_the_order_of_the_parts_in_a_file_changes_no_bit(whole):
    board = BoardSpec(crystal_hz=CRYSTAL_HZ, parts=dict(reversed(BOARD.parts.items())))
    world = wired_world(SCRIPT, board=board)
    world.run_to(END_TICK)
    assert (world.digest, world.identity()) == (whole.digest, whole.identity())


def test_a_saved_put_that_no_part_takes_is_refused():
    world, other = wired_world(), wired_world()
    world.do(put(50_000, "eyes.width_us", 60))
    saved = world.state.save()
    for text in (b"eyes.width_us = 00", b"eyes.width_us = -6", b"nose.width_us = 60"):
        with pytest.raises(ValueError, match=r"eyes|nose|no number"):
            other.state.load(saved.replace(b"eyes.width_us = 60", text))
    assert other.state.save() == wired_world().state.save()


def saved_and_digest():
    """A saved world and the digest a period later."""
    world = wired_world(SCRIPT)
    world.run_to(1_950_000)
    saved = world.save().hex()
    world.step()
    return f"{saved} {world.digest}"


def test_both_engines_give_the_same_bits():
    assert children.same_uncompiled(saved_and_digest)


# --------------------------------------------------------------------------------------------- RXD

KEY_ON_RXD = BoardSpec(parts={"key": PartSpec(keys=Button(), pins={"pin": "P3.0"})})


def test_a_key_on_rxd_is_polled_and_saved():
    world, other = (
        wired_world(text="loop:\nMOV C,P3.0\nMOV P1.7,C\nSJMP loop", board=KEY_ON_RXD) for _ in range(2)
    )
    world.do(put(1_000, "key.pressed", True))
    world.run_to(5_000_000)
    assert not world.device().board.cpu.sfr(0x90) & 0x80
    other.state.load(world.state.save())
    assert other.state.save() == world.state.save()


def test_nothing_can_be_sent_to_a_board_that_drives_rxd():
    world = wired_world(board=KEY_ON_RXD, bit_ticks=2_500)
    with pytest.raises(ValueError, match=r"something on the board drives P3\.0 \(RXD\)"):
        world.inject(b"x")
