"""A board with a few assembled lines in its flash, on the bench: no radio, no motors."""

import msgspec

from miro_robot.board import Board
from miro_robot.image import Symbol
from miro_robot.plant import Plant
from miro_robot.wiring import load_wiring
from tests.robot.mcs51 import asm

CYCLE = 12
MS = 24_000

START = "LJMP main\nORG 30h\nmain:\n"
"""Interrupt vectors are free up to 30h; `main` begins in cycle 2."""

RESET = "CLR P2.5\nNOP\nNOP\nSETB P2.5\nMOV R6,#5\nwait:\nMOV R7,#0\nDJNZ R7,$\nDJNZ R6,wait\n"
"""The reset handshake by waiting: 4 cycles to the end of the pulse, then 2575 cycles (the chip takes 2048)."""


def image_of(text):
    """The assembled lines as an image; its labels are its symbols."""
    return asm.image_of(text, {name: Symbol(at, "code") for name, at in asm.labels_of(text).items()})


def board_with(text, wiring=None, stop_on_fault=True, options=None, plant=None):
    """The MIRO board, or one wired otherwise, with `text` in its flash and a silent radio."""
    board = Board(wiring or load_wiring(), plant or Plant(), 0, 3, options, stop_on_fault)
    board.load(image_of(text))
    board.cpu.rxd.settled_tick = 1 << 60
    return board


def raw_movx_wiring():
    """What the manual of no chip recommends: the strobes of the LM629 on /WR and /RD of a MOVX, D7..D0 on P0, and
    the high address byte as PS (P2.0) and chip selects (P2.3, P2.4).
    """
    wiring = load_wiring()
    strobes = {
        f"{side}.{pin}": net for side in ("left", "right") for pin, net in (("wr", "P3.6"), ("rd", "P3.7"))
    }
    return msgspec.structs.replace(wiring, name="raw", nets={**wiring.nets, **strobes})
