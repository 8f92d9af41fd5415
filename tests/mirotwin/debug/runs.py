"""Runs and debuggers for the tests of this folder."""

from miro_robot.firmware import source_folder
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.rerun.inspected_run import RobotRun
from mirotwin.shell.firmware_image import load_firmware

SECOND = 24_000_000


def robot_run(scenario="fig6", seed=3, firmware=None, index=0):
    """A run of a scenario at its first tick."""
    return RobotRun(World(load(scenario, ()).scenario, seed, load_firmware(firmware)), 0, index)


def debugger_of(run, everyone=False):
    """A debugger at the start of `run`, with the sources of the robot's own firmware."""
    return Debugger(Timeline(run), Symbols(run.image, [source_folder()]), everyone)
