"""A board of parts for the tests of commands: a key, a lamp, an echo on the serial port."""

from miro_robot.board_spec import BoardSpec, PartSpec
from miro_robot.parts.button import Button
from miro_robot.parts.led import Led
from miro_sim.scenario.board import BoardScenario
from mirotwin.runs.spec import RunSpec
from tests.mirotwin.conftest import hex_file
from tests.robot.mcs51.asm import assemble, image_of

CRYSTAL_HZ = 11_059_200
PROGRAM = """
MOV SCON,#50h
MOV TMOD,#20h
MOV TH1,#0FDh
SETB TR1
SETB TI
again:
JB INT0,up
CLR P1.0
SJMP next
up:
SETB P1.0
next:
INC 30h
JNB RI,again
CLR RI
MOV A,SBUF
JNB TI,$
CLR TI
MOV SBUF,A
SJMP again
"""
"""The lamp at P1.0 is lit while the key at P3.2 is pressed; the serial port echoes at 9600 baud."""
IMAGE = image_of(PROGRAM)
SPEC = BoardSpec(
    name="lamp",
    crystal_hz=CRYSTAL_HZ,
    nets={"KEY": ("P3.2",)},
    parts={
        "key": PartSpec(keys=Button(), pins={"pin": "KEY"}),
        "lamp": PartSpec(keys=Led(), pins={"pin": "P1.0"}),
    },
)


def world_of(script=None, **more):
    """The board with the program, run by `script`, or by who injects."""
    scenario = BoardScenario(board=SPEC, **more)
    return RunSpec(scenario=scenario, image=IMAGE, script=script).world()


BOARD_FILE = """
crystal_hz = 11_059_200
[nets]
KEY = "P3.2"
[parts.key]
part = "button"
pins = { pin = "KEY" }
[parts.lamp]
part = "led"
pins = { pin = "P1.0" }
"""


def files_of_board(folder):
    """`lamp.board.toml` and `lamp.hex` in a folder."""
    board = folder / "lamp.board.toml"
    board.write_text(BOARD_FILE)
    return board, hex_file(folder / "lamp.hex", assemble(PROGRAM))
