"""A board with a LED, a button and a serial port, and a program in assembler that uses them; for tests of waits."""

from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_file import board_of_table
from miro_sim.world.world import World
from tests.robot.mcs51.asm import image_of

CRYSTAL_HZ = 11_059_200
TABLE = {
    "crystal_hz": CRYSTAL_HZ,
    "nets": {"BLINK": "P1.3"},
    "parts": {
        "lamp": {"part": "led", "pins": {"pin": "BLINK"}},
        "dark": {"part": "led", "active": "high", "pins": {"pin": "!P1.4"}},
        "key": {"part": "button", "pins": {"pin": "P3.2"}},
    },
}
# P1.3 is low for 3 of 8 rounds of 100 cycles; P1.4 is high when the key is pressed; P2.0 ticks each round.
BLINKS = """
        MOV R6,#0
loop:
        INC R6
        MOV A,R6
        ANL A,#7
        ADD A,#0FDh
        MOV P1.3,C
        MOV C,P3.2
        CPL C
        MOV P1.4,C
        CPL P2.0
        MOV R7,#43
        DJNZ R7,$
        SJMP loop
"""
HELLO = """
        MOV TH1,#0FDh
        MOV TMOD,#20h
        MOV SCON,#50h
        SETB TR1
loop:
        JNB RI,$
        CLR RI
        MOV A,SBUF
        ACALL send
        MOV A,#3Dh
        ACALL send
        MOV A,#0Ah
        ACALL send
        SJMP loop
send:
        MOV SBUF,A
        JNB TI,$
        CLR TI
        RET
"""


def board_world(text=BLINKS, table=TABLE, seed=0, **keys):
    board = board_of_table(table, "mine.board.toml")
    return World(BoardScenario(board=board, **keys), seed, image_of(text))
