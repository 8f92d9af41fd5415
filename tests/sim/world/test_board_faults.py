"""Hardware faults of a board of a file: its wire to RXD, its supply, its port pins."""

import pytest

from miro_protocol.actions import Fault
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.image import load_hex
from miro_sim.scenario.board import PERIOD_TICKS, BoardScenario
from miro_sim.scenario.board_file import board_of_table, load_board
from miro_sim.world.world import World
from tests import children
from tests.robot.mcs51.asm import image_of
from tests.sim.world.board_rig import CRYSTAL_HZ, TABLE, board_world

MS = CRYSTAL_HZ // 1000
DATA = bytes(range(0x41, 0x55))
BIT_TICKS = CRYSTAL_HZ // 9600
CHARACTER = 10 * BIT_TICKS
BEGIN, END = 20 * MS, 2 * PERIOD_TICKS
BROKEN, MENDED = (BEGIN + round(place * CHARACTER) for place in (10.4, 22.7))
# Sends back what it receives, and keeps each in 30h .. and at 1230h .. of external RAM.
ECHO = """
        MOV TH1,#0FDh
        MOV TMOD,#20h
        MOV SCON,#50h
        SETB TR1
        MOV R0,#30h
        MOV DPTR,#1230h
loop:
        JNB RI,$
        CLR RI
        MOV A,SBUF
        MOV @R0,A
        INC R0
        MOVX @DPTR,A
        INC DPTR
        CPL P1.3
        MOV SBUF,A
        JNB TI,$
        CLR TI
        SJMP loop
"""
XRAM = {**TABLE, "xram": "external"}
PAIRS = [
    ("rxd inverted", "rxd ok"),
    ("rxd 0", "rxd ok"),
    ("rxd 1", "rxd ok"),
    ("rxd 0", "rxd inverted"),
    ("power dip", "power dip"),
    ("pin P1.3 0", "pin P1.3 ok"),
]


def echoing(pair=(), ticks=()):
    """A board to which a PC sends DATA; within its 6th character something breaks, within its 12th it is mended."""
    script = [
        Transmission(BEGIN + 2 * place * CHARACTER, DOWN, bytes([value])) for place, value in enumerate(DATA)
    ]
    script += [Fault(tick, 0, 0, what) for tick, what in zip((BROKEN, MENDED), pair, strict=False)]
    scenario = BoardScenario(
        board=board_of_table(XRAM, "mine.board.toml"), bit_ticks=BIT_TICKS, stop_on_fault=False
    )
    world = World(scenario, 0, image_of(ECHO), script)
    for tick in ticks:
        world.run_to(tick)
    return world


def received(world):
    log = world.device().board.log
    return bytes(log.event(serial)[3] for serial in range(log.first, log.end) if log.event(serial)[1] == 0)


@pytest.mark.parametrize("pair", PAIRS, ids=" to ".join)
def test_pieces_and_saved_worlds_change_no_bit_and_the_state_is_another_one(pair):
    whole, untouched = echoing(pair, [END]), echoing((), [END])
    near = [tick + ahead for tick in (BROKEN, MENDED) for ahead in (-121, -120, -119, -1, 0, 1, 12, 2048)]
    in_pieces, other = echoing(pair, sorted(near)), echoing(pair, [BROKEN + 3000])
    fresh = echoing(pair)
    fresh.load(other.save())
    for world in (in_pieces, other, fresh):
        world.run_to(END)
    digests = {world.digest for world in (whole, in_pieces, other, fresh)}
    assert len(digests) == 1
    assert digests != {untouched.digest}
    assert (received(untouched), whole.faults) == (DATA, [])


def test_both_engines_have_the_same_digests():
    code = f"from {__name__} import *; print([echoing(pair, [END]).digest for pair in PAIRS])"
    assert children.uncompiled(code).strip() == str([echoing(pair, [END]).digest for pair in PAIRS])


@pytest.mark.parametrize("what", ["rxd 1", "rxd 0", "rxd inverted"])
def test_what_is_on_the_wire_while_it_is_broken_is_lost_and_the_rest_is_received(what):
    got = received(echoing((what, "rxd ok"), [END]))
    assert got.startswith(DATA[:5])
    assert got.endswith(DATA[12:])
    assert not set(got[5:-8]) & set(DATA[6:11])


def test_an_inverted_wire_has_the_other_level_at_each_tick_and_a_mended_one_the_same():
    worlds = [echoing(), echoing(("rxd inverted", "rxd ok"))]
    for tick in range(BEGIN, BEGIN + 30 * CHARACTER, BIT_TICKS // 3):
        levels = []
        for world in worlds:
            world.run_to(tick)
            levels.append(world.device().board.cpu.rxd.level_at(tick))
        assert levels[0] ^ levels[1] == (BROKEN <= tick < MENDED)


def test_a_dip_of_the_supply_begins_all_again_and_keeps_ram():
    world = echoing(("power dip",), [BROKEN + 1])
    board = world.device().board
    assert board.cpu.pc < 12
    assert bytes(board.cpu.peek_iram(0x30 + place) for place in range(5)) == DATA[:5]
    assert board.xram()[0x1230:0x1235] == DATA[:5]
    world.run_to(END)
    assert bytes(board.cpu.peek_iram(0x30 + place) for place in range(10)) != DATA[:10]


def test_a_part_sees_the_shorted_pin_until_it_is_mended():
    world = board_world()
    for what, expected in (("pin P1.3 1", {False}), ("pin P1.3 0", {True}), ("pin P1.3 ok", {False, True})):
        world.run_to(world.do(Fault(world.earliest_action_tick, 0, 0, what)))
        seen = set()
        for _ in range(100):
            world.run_for(1200)
            seen.add(world.device().value("lamp.on"))  # while P1.3 is low
        assert seen == expected, what


@pytest.mark.parametrize(
    "what", ["encoder left lost", "lm629 left busy", "motor left open", "wheel left blocked"]
)
def test_what_only_a_robot_has_is_refused(what):
    world = board_world()
    with pytest.raises(ValueError, match="is a fault of a robot; put a value of the part"):
        world.do(Fault(world.earliest_action_tick, 0, 0, what))


def test_a_wire_that_the_board_drives_cannot_break():
    world = board_world(
        table={"crystal_hz": CRYSTAL_HZ, "parts": {"key": {"part": "button", "pins": {"pin": "P3.0"}}}}
    )
    with pytest.raises(ValueError, match=r"something on the board drives P3\.0 \(RXD\)"):
        world.do(Fault(world.earliest_action_tick, 0, 0, "rxd 0"))


def test_a_pin_that_no_file_says_a_word_of_cannot_be_shorted():
    world = World(BoardScenario(), 0, image_of("SJMP $"))
    with pytest.raises(ValueError, match="no board file says what is wired to the pins"):
        world.do(Fault(world.earliest_action_tick, 0, 0, "pin P1.3 0"))


def test_two_outputs_that_meet_because_of_a_short_are_no_fault_of_the_firmware():
    folder = children.ROOT / "examples" / "boards" / "follower"
    scenario = BoardScenario(board=load_board(str(folder / "follower.board.toml")))
    world = World(scenario, 0, load_hex(folder / "follower.ihx"), [])
    world.do(Fault(585_323, 0, 0, "pin P0.3 1"))  # R/W of the display, which drives its bus from then on
    world.run_to(scenario.clock // 2)
    assert (world.faults, world.stopped) == ([], False)


def test_edges_that_a_broken_wire_has_carried_are_forgotten():
    world = echoing(("rxd inverted",), [END])
    assert world.lines[0].whole.ticks == []
