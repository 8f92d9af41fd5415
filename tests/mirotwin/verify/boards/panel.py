"""A panel: a LED that blinks, a button, PWM on P2.0, answers on the serial port; its firmware in C, built by SDCC."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from miro_protocol.toml_text import tables
from miro_robot.image import load_hex
from miro_sim.scenario.board_file import board_of_table
from tests.robot.inspect.programs import build

BOARD = """
chip = "stc89c52"
crystal_hz = 11_059_200
[nets]
BLINK = "P1.3"
[parts.lamp]
part = "led"
pins = { pin = "BLINK" }
[parts.key]
part = "button"
pins = { pin = "P3.2" }
"""
PROGRAM = (Path(__file__).parent / "panel.c").read_text()
DEAF = PROGRAM.replace("if (RI)", "if (0)")
SLOW = PROGRAM.replace("if (++phase == 10)", "if (++phase == 20)")
STARVES = PROGRAM.replace("ticks++;", "ticks++; if (counts) for (;;) ;")


@cache
def panel():
    """The board."""
    return board_of_table(tables(BOARD), "panel.board.toml")


@cache
def built(program):
    """The image and the text of its .ihx."""
    with TemporaryDirectory() as folder:
        path = build(Path(folder), program)
        return load_hex(path), path.read_text()


def project(folder, steps="", expect="", program=PROGRAM, duration_s=1.0, name="mine"):
    """A folder with the board, the image and a scenario; the scenario's path."""
    (folder / "panel.board.toml").write_text(BOARD)
    (folder / "panel.ihx").write_text(built(program)[1])
    path = folder / f"{name}.scenario.toml"
    head = f'board = "panel.board.toml"\nfirmware = "panel.ihx"\nduration_s = {duration_s}\n'
    path.write_text(f"{head}step = [\n{steps}\n]\n[expect]\n{expect}\n")
    return path
