"""What a machine is given beside its firmware: levels on pins, serial input with conditions, a board file."""

from contextlib import suppress

from miro_exact.bad_input import BadInput
from miro_robot.board import Board
from miro_robot.image import load_hex
from miro_robot.parts.resolve import resolve
from miro_robot.plant import IdealWheels
from miro_robot.wiring import WiringError, load_wiring
from miro_sim.scenario.board_file import load_board
from miro_sim.scenario.terminal import InputPiece, PinEvent, read_pins
from tests.alone import Alone
from tests.fuzz.target import Draws, Target, always, folder, refused
from tests.mirotwin.mutated_files import ECHO, hex_records
from tests.states import snapshot

_NAME = "fuzz.ihx"


def _pins(data):
    try:
        events = read_pins(data.decode("utf-8", "replace"), "fuzz.pins")
    except BadInput as error:
        return refused(error)
    text = "".join(f"{event.tick} * P{event.port}.{event.bit} {event.level}\n" for event in events)
    assert read_pins(text, "again") == events, "written and read again, the events differ"
    return f"{min(len(events), 3)} events"


def _serial():
    """Pieces of input with conditions, and pins, for a program that sends back what it gets."""
    path = folder() / _NAME
    path.write_bytes(hex_records(ECHO))
    image = load_hex(path)

    def run(data):
        draw = Draws(data)
        baud = (None, 9600, 4800, draw.below(1 << 20))[draw.below(4)]
        crystal_hz = (24_000_000, 11_059_200, draw.below(1 << 27))[draw.below(3)]
        gap_ticks, cut = draw.below(1 << 16), 1 + draw.below(1 << 12)
        pieces, pins, tick = [], [], 0
        while draw.left:
            kind = draw.below(4)
            if kind == 3:
                tick += draw.below(1 << 16)
                pins.append(PinEvent(tick, 1 + draw.below(3), draw.below(8), draw.below(2)))
                continue
            when = draw.take(draw.below(4)) if kind == 1 else b""
            delay_ticks = draw.below(1 << 24) if kind else None
            pieces.append(InputPiece(draw.take(draw.below(16)), when, delay_ticks))
        sent = ([], [])
        try:
            whole, parts = (
                Alone(
                    *(image, False, tuple(pieces), baud, lambda some, at=at: sent[at].extend(some)),
                    crystal_hz=crystal_hz,
                    gap_ticks=gap_ticks,
                    pins=tuple(pins),
                    wait=bool(gap_ticks & 1),
                )
                for at in range(2)
            )
        except ValueError as error:
            return refused(error)
        ended = whole.run(max_cycles=8_000)
        for cycles in (cut, cut + 7, 8_000):
            again = parts.run(max_cycles=cycles)
        assert (sent[0], ended) == (sent[1], again), "run in parts, the output differs"
        assert whole.cpu.cycles == parts.cpu.cycles, "run in parts, the time differs"
        if ended == "cycles":
            assert len(snapshot(whole)) == len(snapshot(parts))
        return f"{ended}, {min(len(sent[0]), 3)} characters"

    return run


def _board():
    path = folder() / "fuzz-board.toml"
    code = folder() / _NAME
    code.write_bytes(hex_records(_BUS_PROGRAM))
    image = load_hex(code)

    def run(data):
        path.write_bytes(data)
        with suppress(BadInput):  # also where the fast board cannot be it
            resolve(load_board(f"{path}"))
        try:
            wiring = load_wiring(path)
        except WiringError as error:
            return refused(error)
        board = Board(wiring, IdealWheels(), 1, 5)
        board.load(image)
        board.cpu.rxd.settled_tick = 1 << 40
        board.run(12 * 3000)
        return f"ran, {len(wiring.latch)} latches, {min(board.fault_count, 2)} faults"

    return run


# MOV DPTR,#8000h; loop: INC A; MOVX @DPTR,A; MOVX A,@DPTR; MOV P0..P3,A; INC DPTR; SJMP loop
_BUS_PROGRAM = bytes.fromhex("908000 04 F0 E0 F580 F590 F5A0 F5B0 A3 80F2".replace(" ", ""))


TARGETS = {
    "pins": Target("levels on pins", always(_pins)),
    "serial": Target("serial input with conditions and pins, in parts", _serial, most_bytes=128),
    "board": Target(
        "board files, and the board that comes of one",
        _board,
        words=b"[latches.OUT]\n|[buffers.IN]\n|address = |mask = |initial = |CTRL.0|P3.6|left.hi|!".split(
            b"|"
        ),
    ),
}
