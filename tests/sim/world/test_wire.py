"""A board alone on a wire of the world: input, waits, its end, and its state."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_protocol.actions import Power, RadioState, Reset
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.board_spec import BoardSpec
from miro_sim.scenario.board import PERIOD_TICKS, BoardScenario
from miro_sim.scenario.terminal import InputPiece, PinEvent, TerminalSpec
from miro_sim.world.conditions import (
    Command,
    Edge,
    Ended,
    Fault,
    Heard,
    Reached,
    Received,
    Sent,
    Transmitted,
    WheelSpeeds,
    When,
)
from miro_sim.world.waits import WaitExpired
from miro_sim.world.world import World
from tests import children
from tests.robot.mcs51.asm import image_of

BIT_TICKS = 2496
SERIAL = "MOV RCAP2H,#0FFh\nMOV RCAP2L,#0B2h\nMOV T2CON,#34h\nMOV SCON,#50h\n"
ECHO = SERIAL + "loop:\nJNB RI,$\nMOV A,SBUF\nCLR RI\nMOV SBUF,A\nJNB TI,$\nCLR TI\nSJMP loop"
HELLO = SERIAL + "MOV SBUF,#48h\nJNB TI,$\nCLR TI\nMOV SBUF,#69h\nSJMP $"
STORES = "MOV DPTR,#1234h\nMOV A,#5Ah\nMOVX @DPTR,A\nMOV DPTR,#0F0FFh\nMOVX @DPTR,A\nSJMP $"
TAKES = SERIAL + "loop:\nJNB RI,$\nCLR RI\nSJMP loop"
TOGGLES = "loop:\nCPL P1.3\nMOV R7,#50\nDJNZ R7,$\nSJMP loop"


def board_world(text, script=None, board=None, **keys):
    """A world of one board that runs `text`."""
    return World(BoardScenario(board=board or BoardSpec(), **keys), 0, image_of(text), script)


def wait(world, condition, within=4_000_000):
    return world.run_until(condition, within)


def board_of(world):
    return world.lines[0].board


def typed(data, **keys):
    return TerminalSpec(pieces=(InputPiece(data),), **keys)


def heard(world):
    return [(event.tick, event.value) for _, event in world.lines[0].log.since(0, ("heard",))]


def bits(world):
    return world.state.save()


# ---------------------------------------------------------------------------------------- what is done to it


def test_what_is_injected_comes_back_as_an_echo():
    world = board_world(ECHO)
    world.run_to(200_000)  # its timer has overflowed
    tick = world.inject(b"hi", at_tick=240_000)
    assert tick == 240_000
    event = wait(world, Received(byte=ord("i")))
    assert 240_000 + 19 * BIT_TICKS < event.tick < 240_000 + 20 * BIT_TICKS
    echo = wait(world, Heard(byte=ord("i")))
    assert heard(world)[1] == (echo.tick, ord("i"))
    world.step()
    assert [sent.data for sent in world.last.wire if sent.direction == DOWN] == [b"hi"]


def test_a_script_plays_at_its_ticks_with_a_bad_stop_bit():
    script = [Transmission(240_000, DOWN, b"abc", bad_stop=(1,))]
    world = board_world(TAKES, script, bit_ticks=BIT_TICKS)
    events = [wait(world, Received()) for _ in range(3)]
    assert [(chr(event.value), event.good_stop) for event in events][:2] == [("a", True), ("b", False)]


def test_a_receiver_that_is_off_takes_nothing_unless_the_bits_are_given():
    world = board_world("SJMP $")
    with pytest.raises(ValueError, match="the receiver is off, and no bit_ticks are given"):
        world.inject(b"x")
    with pytest.raises(ValueError, match="how long a bit of the script is must be given"):
        board_world("SJMP $", [Transmission(48_000, DOWN, b"x")])


def test_a_reset_begins_the_program_again():
    world = board_world("INC 30h\nSJMP $")
    wait(world, Ended())
    world.set_reset(1)
    world.run_for(2_400)
    world.set_reset(0)
    wait(world, Ended())
    board = board_of(world)
    assert (board.cpu.peek_iram(0x30), board.held) == (2, 0)


def test_power_that_comes_back_finds_zeros_in_all_ram():
    world = board_world(STORES)
    world.run_to(24_000)
    assert board_of(world).xram()[0x1234] == 0x5A
    world.set_power(0)
    world.run_for(2_400)
    assert not any(board_of(world).xram())
    world.set_power(1)
    world.run_for(24_000)
    assert board_of(world).xram()[0xF0FF] == 0x5A


def test_there_is_no_radio_robot_or_second_board():
    world = board_world(ECHO)
    assert (world.networks, world.robots, len(world.devices)) == ([], [], 1)
    with pytest.raises(ValueError, match="is a wire, which has no radio"):
        world.do(RadioState(24_000, 0, "down"))
    with pytest.raises(ValueError, match="is a wire with a board, and no robot"):
        world.robot()
    for action in (Reset(24_000, 0, 1, 1), Power(24_000, 0, 1, 1)):
        with pytest.raises(ValueError, match="no robot in slot 1"):
            world.do(action)


# ------------------------------------------------------------------------------------------------ waits


def test_conditions_of_a_board_are_those_of_a_robot():
    world = board_world(TOGGLES, bit_ticks=BIT_TICKS)
    first = wait(world, Edge(pin="P1.3", level=0))
    second = wait(world, Edge(pin="P1.3", level=0))
    assert second.tick - first.tick == 2 * 12 * (1 + 1 + 100 + 2)
    reached = wait(world, Reached(address=0))
    assert (board_of(world).cpu.pc, board_of(world).cpu.cycles * 12) == (0, reached.tick)
    true = wait(world, When(predicate=lambda device: device.board.cpu.cycles > 5_000))
    assert true.tick == 72_000
    with pytest.raises(WaitExpired):
        wait(world, [Heard(), Command(), Sent()], within=1_000_000)


def test_a_pin_that_the_outside_moves_has_edges_at_their_ticks():
    pins = (PinEvent(50_001, 3, 2, 0), PinEvent(90_005, 3, 2, 1), PinEvent(90_005, 1, 0, 0))
    world = board_world("wait:\nSJMP wait", terminal=TerminalSpec(pins=pins))
    fall = wait(world, Edge(pin="P3.2"))
    rise = wait(world, [Edge(pin="P1.0", level=1), Edge(pin="P3.2", level=1)])
    assert [(edge.tick, edge.value) for edge in (fall, rise)] == [(50_001, 0), (90_005, 1)]


def test_the_end_of_a_program_is_an_event_behind_its_last_character():
    world = board_world(HELLO)
    event = wait(world, Ended())
    (_, (last_tick, _)) = heard(world)
    assert last_tick < event.tick <= last_tick + 24
    assert [chr(value) for _, value in heard(world)] == ["H", "i"]
    world.run_for(PERIOD_TICKS)
    assert not world.stopped


def test_a_run_stops_at_the_end_of_the_program_or_before_an_address():
    world = board_world(HELLO, stop_at_end=True)
    world.run_to(1 << 40)
    assert world.finished
    assert board_of(world).ended
    world = board_world(HELLO, stop_at=(15,))
    world.run_to(1 << 40)
    assert world.finished
    assert board_of(world).cpu.pc == 15


def test_a_fault_stops_it_and_can_be_waited_for():
    world = board_world("NOP\nDB 0A5h\nSJMP $", stop_on_fault=False)
    assert wait(world, Fault()).address == 1
    world = board_world("NOP\nDB 0A5h\nSJMP $")
    world.run_to(1 << 40)
    assert world.stopped
    assert [fault.pc for fault in world.faults] == [1]


def test_each_world_has_its_own_clock():
    assert board_world(ECHO).clock == 24_000_000
    assert board_world(ECHO, board=BoardSpec(crystal_hz=11_059_200)).clock == 11_059_200


# -------------------------------------------------------------------------------------------- state


def test_pages_that_were_never_written_are_no_state():
    world = board_world(STORES)
    world.run_to(24_000)
    board = board_of(world)
    assert [board.pages[0], board.pages[257]] == [0x12, 0xF0]
    assert len(board.pages) == 2 * 257
    saved = bits(world)
    other = board_world(STORES)
    other.state.load(saved)
    assert board_of(other).xram() == board_of(world).xram()
    other.state.load(bits(board_world(STORES)))
    assert not any(board_of(other).xram())


def test_pages_out_of_order_are_refused_and_change_nothing():
    world = board_world(STORES)
    world.run_to(24_000)
    saved = bits(world)
    pages = board_of(world).pages
    changed = saved.replace(pages, pages[257:] + pages[:257])
    with pytest.raises(ValueError, match="no pages of RAM, in order"):
        world.state.load(changed)
    assert bits(world) == saved


def test_a_saved_world_of_another_image_or_board_is_refused():
    world = board_world(ECHO)
    saved = world.save()
    world.load(saved)
    for other in (board_world(HELLO), board_world(ECHO, stop_at_end=True)):
        with pytest.raises(ValueError, match="the saved world has"):
            other.load(saved)


@settings(deadline=None, max_examples=20)
@given(
    st.binary(min_size=1, max_size=6),
    st.lists(st.integers(1, 300_000), max_size=6),
    st.booleans(),
)
def test_however_it_is_cut_saved_and_waited_on_the_bits_are_the_same(data, cuts, wait):
    keys = {"terminal": typed(data, wait=wait), "board": BoardSpec(crystal_hz=11_059_200)}
    whole, cut = (board_world(ECHO, **keys) for _ in range(2))
    for ticks in cuts:
        cut.run_for(ticks)
        saved = cut.save()
        cut = board_world(ECHO, **keys)
        cut.load(saved)
        with pytest.raises(WaitExpired):
            cut.run_until(Transmitted(byte=0x100 - 1 if 255 not in data else 0), within=1_000)
    end_tick = 2 * PERIOD_TICKS
    whole.run_to(end_tick)
    cut.run_to(max(end_tick, cut.tick))
    if cut.tick == whole.tick:
        assert (cut.digest, bits(cut)) == (whole.digest, bits(whole))


def test_a_digest_holds_the_ram_that_was_written_since_the_last_one():
    text = (
        "l:\nMOV DPTR,#1234h\nMOVX A,@DPTR\nINC A\nMOVX @DPTR,A\nMOV DPTR,#2000h\nMOVX @DPTR,A\nend:\nSJMP $"
    )
    one, other = board_world(text), board_world(text)
    one.run_to(24_000)
    other.run_to(24_000)
    pages = board_of(other).pages
    other.state.load(bits(other).replace(pages, pages[:-1] + b"\x77"))
    assert board_of(other).xram()[0x20FF] == 0x77
    one.step()
    other.step()
    assert one.digest != other.digest


def test_input_that_waits_is_saved_and_no_part_of_the_digest():
    worlds = [board_world(ECHO, terminal=TerminalSpec(live=True)) for _ in range(2)]
    worlds[0].run_to(PERIOD_TICKS - 24)
    worlds[0].lines[0].terminal.input.add(b"x")
    for world in worlds:
        world.run_to(PERIOD_TICKS)
    assert worlds[0].digest == worlds[1].digest
    assert bits(worlds[0]) != bits(worlds[1])


def saved_and_digest():
    """A saved world and the digest at its end."""
    world = board_world(ECHO, terminal=typed(b"ab", wait=True))
    world.run_to(300_000)
    saved = world.save().hex()
    world.run_to(2_500_000)
    return f"{saved} {world.digest}"


def test_both_engines_give_the_same_bits():
    assert children.same_uncompiled(saved_and_digest)


def test_speeds_of_wheels_are_refused_where_there_are_none():
    with pytest.raises(ValueError, match="is a wire with a board, and no robot"):
        wait(board_world(ECHO), WheelSpeeds(left_m_s=0.1))
