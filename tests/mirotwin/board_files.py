"""A board with a lamp and a key, its firmware, and its scenario, for the tests of commands."""

from tests.mirotwin.conftest import hex_file
from tests.robot.mcs51.asm import assemble

BOARD = """
chip = "stc89c52"
crystal_hz = 11_059_200
[straps]
mode = { pin = "P3.4", level = 1 }
[parts.lamp]
part = "led"
pins = { pin = "P2.0" }
[parts.key]
part = "button"
pins = { pin = "P3.2" }
bounce_ms = 3
"""
SCENARIO = """
board = "lamp.board.toml"
firmware = "lamp.hex"
duration_s = 0.5
put = { key.pressed = true }
"""
ECHO = """
MOV RCAP2H,#0FFh
MOV RCAP2L,#0DCh
MOV T2CON,#34h
MOV SCON,#50h
MOV SBUF,#52h
JNB TI,$
CLR TI
loop:
MOV C,P3.2
MOV P2.0,C
JNB RI,loop
MOV A,SBUF
CLR RI
MOV SBUF,A
JNB TI,$
CLR TI
SJMP loop
"""
"""The lamp follows the key; what comes is sent back, at 9600 baud."""
INVERTED = ECHO.replace("MOV P2.0,C", "CPL C\nMOV P2.0,C")
BIT_TICKS = 1152


def board_folder(folder, scenario=SCENARIO, board=BOARD, program=ECHO):
    """The scenario in a folder with all that it names."""
    (folder / "lamp.board.toml").write_text(board)
    hex_file(folder / "lamp.hex", assemble(program))
    hex_file(folder / "inverted.hex", assemble(INVERTED))
    path = folder / "lamp.scenario.toml"
    path.write_text(scenario)
    return path
