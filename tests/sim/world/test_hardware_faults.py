"""Hardware faults as actions: what each changes, that it is saved, and that how a run is cut changes no bit of it."""

import pytest

from miro_protocol.actions import FAULTS, Fault, Power, fault_text
from miro_sim.world.world import World
from tests.sim.world.board_rig import board_world
from tests.sim.world.test_broken_encoders import MS, driven

BROKEN = 201 * MS + 7
MENDED = 260 * MS + 5_001
PAIRS = [
    ("encoder left lost", "encoder left ok"),
    ("encoder right b0", "encoder right ok"),
    ("lm629 left busy", "lm629 left ok"),
    ("lm629 right dead", "lm629 right ok"),
    ("rxd inverted", "rxd ok"),
    ("rxd 0", "rxd ok"),
    ("rxd 1", "rxd ok"),
    ("power dip", "power dip"),
    ("flip 2Ah.3", "flip 2Ah.3"),
    ("motor left open", "motor left ok"),
    ("wheel right blocked", "wheel right ok"),
    ("pin P0.3 1", "pin P0.3 ok"),
    ("pin P0.6 0", "pin P0.6 1"),
    ("pin P2.3 0", "pin P2.3 ok"),
    ("pin P3.2 0", "pin P3.2 ok"),
]


def broken_and_mended(pair, ticks=()):
    world = driven(2279)
    for tick, what in zip((BROKEN, MENDED), pair, strict=True):
        world.do(Fault(tick, 0, 0, what))
    for tick in ticks:
        world.run_to(tick)
    return world


@pytest.mark.parametrize("pair", PAIRS, ids=[pair[0] for pair in PAIRS])
def test_pieces_and_saved_worlds_change_no_bit_and_the_state_is_another_one(pair):
    end = 300 * MS
    whole = broken_and_mended(pair, [end])
    near = [tick + ahead for tick in (BROKEN, MENDED) for ahead in (-121, -120, -1, 0, 1, 13, 2048)]
    in_pieces = broken_and_mended(pair, sorted(near))
    other = driven(2279)
    other.load(in_pieces.save())
    untouched = driven(2279)
    for world in (in_pieces, other, untouched):
        world.run_to(end)
    assert whole.digest == in_pieces.digest == other.digest != untouched.digest
    assert whole.faults == []


def test_a_fault_that_waits_in_a_saved_world_still_comes():
    world, other = broken_and_mended(("rxd 0", "rxd ok"), [100 * MS]), driven(2279)
    other.load(world.save())
    for each in (world, other):
        each.run_to(300 * MS)
    assert world.digest == other.digest


def test_a_dip_of_the_supply_begins_all_again_and_keeps_ram():
    world = driven(2279)
    world.run_to(200 * MS)
    board = world.robot().board
    before = [board.cpu.peek_iram(address) for address in range(0xF0, 0x100)]
    board.cpu.poke_iram(0xF0, before[0] ^ 0xFF)
    board.dip()
    assert board.cpu.pc == 0
    assert board.left.pwm == board.right.pwm == 0
    assert [board.cpu.peek_iram(address) for address in range(0xF0, 0x100)] == [before[0] ^ 0xFF, *before[1:]]
    assert board.fault_count == 0


def test_a_robot_without_supply_has_no_dip():
    world = driven(2279)
    world.do(Power(1000, 0, 0, 0))
    world.do(Fault(2000, 0, 0, "power dip"))
    world.run_to(3000)
    assert not world.robot().board.powered


def test_an_inverted_wire_has_the_other_level_at_each_tick():
    worlds = [driven(2279), driven(2279)]
    worlds[1].do(Fault(62 * MS, 0, 0, "rxd inverted"))
    for tick in range(62 * MS, 64 * MS, 20_000):
        for world in worlds:
            world.run_to(tick)
        lines = [world.robot().board.cpu.rxd for world in worlds]
        for seen in range(tick, tick + 120, 7):
            assert lines[0].level_at(seen) == 1 - lines[1].level_at(seen)


def test_a_fault_is_an_action_of_its_period_and_an_event_of_its_robot():
    world = broken_and_mended(("encoder left lost", "power dip"))
    done = []
    world.observers.append(lambda period: done.extend(period.actions))
    world.run_to(300 * MS)
    assert done == [Fault(BROKEN, 0, 0, "encoder left lost"), Fault(MENDED, 0, 0, "power dip")]
    events = [str(event) for _, event in world.networks[0].log.since(0)]
    assert f"tick {BROKEN}: net0/robot0: hardware encoder left lost" in events
    assert f"tick {MENDED}: net0/robot0: power 1" in events  # all begins again


@pytest.mark.parametrize(
    "what",
    [
        "encoder left",
        "encoder middle lost",
        "flip 2A.3",
        "flip 100h.3",
        "flip 2Ah.8",
        "",
        "pin P3.0 0",
        "pin P1.8 1",
    ],
)
def test_what_is_no_fault_is_refused(what):
    world: World = driven(2279)
    before = world.save()
    with pytest.raises(ValueError, match="is no hardware fault; write one of"):
        world.do(Fault(1000, 0, 0, what))
    assert world.save() == before


def test_a_board_has_flips_and_else_values_that_are_put():
    world = board_world()
    world.do(Fault(world.earliest_action_tick, 0, 0, "flip 30h.7"))
    world.run_for(200)
    assert world.device().board.cpu.peek_iram(0x30) == 0x80
    with pytest.raises(ValueError, match="is a fault of a robot; put a value of the part"):
        world.do(Fault(world.earliest_action_tick, 0, 0, "encoder left lost"))


def test_a_fault_has_one_spelling():
    assert fault_text(" flip  2ah.3") == "flip 2Ah.3"
    assert all(
        fault_text(f"{word} {values.split('|')[0]}")
        for word, values in FAULTS.items()
        if word in ("power", "rxd")
    )
