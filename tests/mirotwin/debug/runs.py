"""Runs and debuggers for the tests of this folder."""

import json

from miro_robot.firmware import source_folder
from miro_robot.image.debug_info import Sources
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.runs.inspected_run import InspectedRun
from mirotwin.shell.firmware_image import load_firmware
from tests.sim.digests import GOLDEN

SECOND = 24_000_000
ASM = """
LJMP main
ORG 0Bh
INC 30h
RETI
ORG 30h
main:
MOV SP,#50h
MOV IE,#82h
MOV TMOD,#02h
SETB TR0
again:
LCALL twice
INC 31h
SJMP again
twice:
PUSH ACC
INC 32h
POP ACC
RET
"""
"""A program for the bare processor: calls within calls, and a timer that interrupts them."""


def robot_run(scenario="fig6", seed=7, firmware=None, index=0, settings=()):
    """A run of a scenario at its first tick."""
    return InspectedRun(World(load(scenario, settings).scenario, seed, load_firmware(firmware)), 0, index)


def golden_digest(name):
    """The digest at the end of a run that is frozen, as `fig6 6 s seed 7`."""
    return json.loads(GOLDEN.read_text())[name]


def debugger_of(run, everyone=False):
    """A debugger at the start of `run`, with the sources of the robot's own firmware."""
    return Debugger(Timeline(run), Symbols(run.image, Sources([source_folder()])), everyone)
