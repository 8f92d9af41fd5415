"""Waveforms: every edge of every wire on its tick, against a twin that looks on every tick."""

import io
import itertools
import re
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import nanoseconds
from miro_protocol.frames import TeamFrame, encode
from miro_robot import inspect
from miro_robot.board import Board
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.inspect.waveform import SETTLING_TICKS, SIGNALS, Waveform
from miro_robot.lm629.chip import PWM_TICKS
from miro_robot.wiring import Latch, load_wiring
from tests.naive.waveform import Sampler, Treadmill
from tests.robot.inspect.reading import read, tick_of
from tests.robot.mcs51.asm import assemble
from tests.robot.mcs51.rig import cpu_with
from tests.states import restore, snapshot

MS = 24_000
BIT = 2500
IMAGE = load_hex(image_path())
SENT_AT = 5 * MS
FRAME = encode(TeamFrame(3, 0, ((100, -90), (0, 0), (0, 0))), 3)
ACTS_AT = SENT_AT + len(FRAME) * 10 * BIT
"""The end of the frame: after it the chips get their commands, the motors start and an answer is sent."""


def board_at(tick):
    """The robot's board with the firmware, on a treadmill, to which one frame is sent; run up to `tick`."""
    board = Board(load_wiring(), Treadmill(), slot=0, robots=3)
    board.cpu.load(IMAGE.code, IMAGE.used)
    at = SENT_AT
    for byte in FRAME:
        for bit in [0] + [byte >> n & 1 for n in range(8)] + [1]:
            board.cpu.rxd.append(at, bit)
            at += BIT
    board.run(tick)
    return board


def waveform_of(board, begin, end, piece=2 * MS, **window):
    out = io.StringIO()
    waveform = Waveform(out, board, **window).attach(board.cpu)
    for tick in [*range(begin + piece, end, piece), end]:
        board.run(tick)
    waveform.close()
    return out.getvalue()


def recorded(cpu, *cycles):
    """The waveform of a CPU without a board that is run to these cycles."""
    out = io.StringIO()
    waveform = Waveform(out).attach(cpu)
    for cycle in cycles:
        cpu.run(cycle)
    waveform.close()
    return read(out.getvalue().encode())


def sampled(sampler, first_tick, end_tick):
    """The changes of the naive twin, per wire, as a file that begins at `first_tick` has them."""
    wires = {}
    for signal in SIGNALS:
        if signal.name not in sampler.changes:
            continue
        for bit, wire in enumerate(signal.wires()):
            changes = []
            for tick, level in sampler.changes[signal.name]:
                if tick <= first_tick:
                    changes = [(first_tick, level >> bit & 1)]
                elif tick < end_tick and changes[-1][1] != level >> bit & 1:
                    changes.append((tick, level >> bit & 1))
            wires[wire] = changes
    return wires


@pytest.mark.slow
@pytest.mark.parametrize(
    ("begin", "length", "moving"),
    [
        pytest.param(0, 2 * MS, {"left_rst_n", "right_busy", "left_hi", "p3_2", "d0"}, id="start-up"),
        pytest.param(
            ACTS_AT, 4 * MS, {"left_pwm", "right_sign", "asleep", "isr_timer1", "d7", "txd"}, id="a frame"
        ),
        pytest.param(ACTS_AT - 2 * MS, MS, {"isr_serial", "rxd", "high_priority"}, id="characters"),
    ],
)
def test_every_edge_of_every_wire_is_where_a_look_on_every_tick_finds_it(begin, length, moving):
    board = board_at(begin)
    state, cycles = snapshot(board), board.cpu.cycles
    text = waveform_of(board, begin, begin + length, piece=7_777)
    vcd = read(text.encode())
    assert vcd.first_tick == (12 * cycles + SETTLING_TICKS if begin else 0)
    assert vcd.last_tick >= begin + length - PWM_TICKS - 60
    twin = board_at(0)
    restore(twin, state)
    sampler = Sampler(twin.cpu, twin)
    sampler.run(vcd.last_tick)
    expected = sampled(sampler, vcd.first_tick, vcd.last_tick)
    assert set(vcd.wires) == set(expected)
    for wire, changes in vcd.until(vcd.last_tick).items():
        assert changes == expected[wire], wire
    assert moving <= {wire for wire, changes in vcd.wires.items() if len(changes) > 1}


def test_a_pulse_of_the_bridge_has_the_length_that_its_magnitude_says():
    vcd = read(waveform_of(board_at(ACTS_AT), ACTS_AT, ACTS_AT + 20 * MS).encode())
    seen = set()
    for side in ("left", "right"):
        edges = vcd.wires[f"{side}_pwm"][1:]
        for (rise, level), (fall, _) in itertools.pairwise(edges):
            if level == 1:
                magnitude = sum(vcd.level_at(f"{side}_magnitude{bit}", rise) << bit for bit in range(7))
                assert fall - rise == 4 * 4 * magnitude
                seen.add(magnitude)
        rises = [tick for tick, level in edges if level == 1]
        assert {(later - first) % PWM_TICKS for first, later in itertools.pairwise(rises)} == {0}
    assert len(seen) > 5


def test_without_a_board_there_are_the_wires_of_the_cpu_alone():
    cpu = cpu_with("loop:\nCPL P1.3\nSJMP loop")
    vcd = recorded(cpu, 100)
    assert vcd.last_tick == 12 * cpu.cycles
    assert vcd.wires["p1_3"] == [(0, 1)] + [(12 + 36 * n, n & 1) for n in range(33)]
    assert not {wire for wire in vcd.wires if wire.startswith(("left", "right", "d"))}


def test_more_edges_than_a_line_keeps_are_all_there():
    cpu = cpu_with("loop:\nCPL P3.1\nSJMP loop")
    cpu.txd.unread = True
    assert len(recorded(cpu, 15_000).wires["txd"]) == 1 + 5_000


TWO_PRIORITIES = """
LJMP main
ORG 0Bh
INC 30h
CPL P1.0
RETI
ORG 1Bh
CPL P1.1
MOV R2,#9
DJNZ R2,$
CPL P1.1
RETI
main:
MOV SP,#40h
MOV TMOD,#22h
MOV TH0,#-23
MOV TH1,#-91
MOV IE,#8Ah
MOV IP,#02h
MOV TCON,#50h
loop:
CPL P2.7
MOV SBUF,30h
MOV PCON,#01h
SJMP loop
"""


def looked_at_on_every_tick(text, end_tick):
    sampler = Sampler(cpu_with(text))
    sampler.run(end_tick)
    return sampled(sampler, 0, end_tick)


@pytest.mark.parametrize("mode", ["#00h", "#80h"], ids=["shift register", "mode 2"])
def test_a_cpu_with_two_priorities_and_sleep_is_as_a_look_on_every_tick_finds_it(mode):
    text = TWO_PRIORITIES.replace("MOV SP,#40h", f"MOV SP,#40h\nMOV SCON,{mode}")
    vcd = recorded(cpu_with(text), 1, 500, 501, 502, 600, 3000)
    assert vcd.until(vcd.last_tick) == looked_at_on_every_tick(text, vcd.last_tick)
    assert min(len(vcd.wires[wire]) for wire in ("isr_timer1", "asleep", "txd", "p3_1")) > 20
    both = [tick for tick, level in vcd.wires["isr_timer0"] if level and vcd.level_at("isr_timer1", tick)]
    assert both, "no routine was interrupted"


def test_a_routine_that_began_before_the_recording_is_unknown_until_none_is_in_service():
    cpu = cpu_with(TWO_PRIORITIES)
    while cpu.pc != 0x1B:
        cpu.step()
    began = 12 * cpu.cycles
    out = io.StringIO()
    waveform = Waveform(out).attach(cpu)
    cpu.run(cpu.cycles + 2000)
    waveform.close()
    assert waveform.tap.start[12:20] == [1, 0, 2, 2, 2, 2, 2, 2]
    assert read(out.getvalue().encode()).first_tick == began + SETTLING_TICKS


@pytest.mark.slow
def test_a_window_has_what_the_whole_has_there():
    whole = read(waveform_of(board_at(0), 0, 31 * MS).encode())
    first, end = SENT_AT + 22 * MS + 11, SENT_AT + 25 * MS + 3
    part = read(waveform_of(board_at(0), 0, 31 * MS, first_tick=first, end_tick=end).encode())
    late = read(waveform_of(board_at(20 * MS), 20 * MS, 31 * MS, first_tick=first, end_tick=end).encode())
    assert (part.first_tick, part.last_tick) == (first, end)
    for wire, changes in part.wires.items():
        inside = [change for change in whole.wires[wire] if first < change[0] < end]
        assert changes == [(first, whole.level_at(wire, first)), *inside], wire
    assert late == part


def test_a_window_that_is_empty_or_never_reached_is_refused():
    with pytest.raises(ValueError, match="ticks 5 to 5: the window is empty"):
        Waveform(io.StringIO(), first_tick=5, end_tick=5)
    out = io.StringIO()
    board = board_at(0)
    waveform = Waveform(out, board, first_tick=MS).attach(board.cpu)
    board.run(MS // 2)
    with pytest.raises(ValueError, match="the run ended before tick 24000, nothing was written"):
        waveform.close()
    assert out.getvalue() == ""


def test_equal_runs_have_equal_files_however_they_are_cut():
    texts = {waveform_of(board_at(0), 0, 3 * MS, piece=piece) for piece in (3 * MS, 12, 1_000, 9_999)}
    assert len({text[: text.rindex("#")] for text in texts}) == 1


def test_who_is_watched_does_the_same_and_is_left_alone_after():
    watched, free = board_at(0), board_at(0)
    waveform_of(watched, 0, 30 * MS)
    free.run(30 * MS)
    assert snapshot(watched) == snapshot(free)
    assert watched.cpu.inspector is None
    assert watched.probe is None
    assert watched.left.encoder_edges is watched.right.encoder_edges is None


def test_two_waveforms_of_one_board_at_a_time_are_refused():
    board = board_at(0)
    first = Waveform(io.StringIO(), board).attach(board.cpu)
    with pytest.raises(ValueError, match="watched already; close that waveform first"):
        Waveform(io.StringIO(), board).attach(board.cpu)
    board.run(MS)
    first.close()
    assert board.cpu.inspector is None


def test_the_header_has_no_clock_and_every_wire_one_bit():
    text = waveform_of(board_at(0), 0, MS)
    vcd = read(text.encode())
    assert vcd.header["date"] == "1970-01-01"
    assert str(vcd.header["timescale"]) == "1 ns"
    assert vcd.sizes == {1}
    assert text.index(" rxd ") < text.index(" txd ") < text.index("$scope", text.index(" txd "))
    assert vcd.scopes["left_wr_n"] == "robot.left"


ACTIONS = """
CPL P1.3; CPL P2.0; MOV P2,#5Ah; MOV P0,R0; MOV P3,#0FDh; MOV P3,#0FEh; MOV P3,#0FFh; XRL P1,#18h; INC R0; MUL AB;
MOV SBUF,R0; MOV SCON,#00h; MOV SCON,#90h; MOV IP,#02h; MOV IP,#08h; CLR TXD; MOV PCON,#01h; MOV IE,#8Ah;
MOV IE,#00h; MOVX @DPTR,A; SETB TF1; NOP
"""


@pytest.mark.slow
@settings(max_examples=40)
@given(
    st.lists(st.sampled_from(re.split(r";\s", ACTIONS.strip())), min_size=1, max_size=30),
    st.lists(st.integers(1, 300), max_size=4),
)
def test_whatever_a_program_does_is_as_a_look_on_every_tick_finds_it(actions, cuts):
    head, _, _ = TWO_PRIORITIES.partition("loop:")
    text = "\n".join([head, "loop:", *actions, "LJMP loop"])
    vcd = recorded(cpu_with(text), *sorted(cuts), 400)
    assert vcd.until(vcd.last_tick) == looked_at_on_every_tick(text, vcd.last_tick)


def test_a_strobe_on_an_output_latch_moves_when_movx_writes_it():
    wiring = load_wiring()
    nets = {net: source.replace("P2.", "CTRL.") for net, source in wiring.nets.items()}
    latch = Latch("CTRL", address=0x8000, mask=0x8000)
    board = Board(msgspec.structs.replace(wiring, nets=nets, latch=(latch,)), Treadmill())
    board.cpu.load(assemble("MOV DPTR,#8000h\nMOV A,#0F7h\nMOVX @DPTR,A\nSJMP $"))
    out = io.StringIO()
    waveform = Waveform(out, board).attach(board.cpu)
    board.run(10_000)
    waveform.close()
    vcd = read(out.getvalue().encode())
    assert vcd.wires["left_cs_n"] == [
        (0, 1),
        (12 * 3 + 18, 0),
    ]  # S3P2 of the second cycle of MOVX, after 2 + 1
    assert vcd.wires["right_cs_n"] == [(0, 1)]


def test_every_wire_is_explained():
    text = (Path(inspect.__file__).parent / "README.md").read_text()
    explained = set(re.findall(r"`(\w+)`", text))
    for signal in SIGNALS:
        if signal.scope != "right":
            ends = {signal.wires()[0], signal.wires()[-1]} if signal.scope != "ports" else {"p0_0", "p0_7"}
            assert ends <= explained, signal.name


@settings(max_examples=300)
@given(st.integers(0, 1 << 50))
def test_a_time_stamp_tells_its_tick(tick):
    assert tick_of(nanoseconds(tick)) == tick
    assert nanoseconds(tick + 1) > nanoseconds(tick)
