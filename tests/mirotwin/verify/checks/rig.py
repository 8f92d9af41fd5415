"""For the tests of the checks: a silent host whose frames a test sends, and firmware with one mistake planted."""

import shutil
from functools import cache

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.frames import TeamFrame, encode
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import parse
from miro_sim.world.world import World
from mirotwin.verify.checks.monitors import Checks
from tests.mutants.build import build
from tests.mutants.draw import SOURCE, source_files
from tests.mutants.planted import PLANTED
from tests.mutants.sdcc import needs_sdcc as needs_sdcc

MS = 24_000
SILENT = """
name = "silent"
duration_s = 1.0
stop_on_fault = {stop}

[expect]
{expect}

[[network]]
host = "silent"
radio = {{ bit_error_rate = 0.0, squelch = {squelch} }}

[[network.robot]]
slot = 1
reference.kind = "line"
"""


@cache
def own_image():
    return load_hex(image_path())


def silent_world(expect, image=None, squelch=True, stop=True):
    """One robot in slot 1 of 3 whose host sends nothing, and its checks (lines of `[expect]`)."""
    flags = {"squelch": str(squelch).lower(), "stop": str(stop).lower()}
    scenario = parse(SILENT.format(expect=expect, **flags), "silent")
    world = World(scenario, 3, image or own_image())
    return world, Checks(world)


def team(seq, left, right, ask=False):
    """Velocities for the robot in slot 1."""
    return TeamFrame(3 if ask else 0, seq, ((11, 22), (left, right), (33, 44)))


def send(world, messages, period_ticks=CONTROL_PERIOD_TICKS):
    """Sends each so long after the one before, the first one period from now."""
    for message in messages:
        world.run_to(world.tick + period_ticks)
        world.inject(message if isinstance(message, bytes) else encode(message, 3))


def finish(world, checks):
    """Runs to the end; the verdicts by name."""
    while not world.finished:
        world.step()
    checks.finish()
    return {one.name: one.verdict for one in checks.verdicts()}


@cache
def planted(mistake):
    """The firmware with a mistake of the table `tests.mutants.planted`."""
    one = PLANTED[mistake]
    return built(one.file, one.right, one.wrong)


@cache
def built(file, right, wrong):
    """The firmware with `right` in a source file, where it stands once, replaced by `wrong`."""
    text = source_files()[file]
    assert text.count(right) == 1
    found = build({file: text.replace(right, wrong)})
    assert not found.error, found.error
    return load_hex(found.image)


def built_in(folder, file, right, wrong):
    """The same as files of one's own: the sources in `firmware`, the image with its symbols in `out`."""
    image = built(file, right, wrong)
    shutil.copytree(SOURCE, folder / "firmware")
    (folder / "firmware" / file).write_text(source_files()[file].replace(right, wrong), encoding="utf-8")
    shutil.copytree(image.path.parent, folder / "out")
    return load_hex(folder / "out" / image.path.name)
