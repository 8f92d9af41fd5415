"""What is debugged: SUBJECT and the options that say how it runs, opened as a timeline with its symbols."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, NamedTuple

from miro_robot.firmware import source_folder
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.firmware.bare_options import BareRequest
from mirotwin.firmware.coverage_files import with_debug_files
from mirotwin.firmware.subject import Request, open_run
from mirotwin.rerun.inspected_run import BareRun, RobotRun
from mirotwin.shell.command import Option, Options
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import NAME, SEED, SET, Engine, Firmware, Whole


class SubjectOptions(Options, frozen=True, kw_only=True):
    """How SUBJECT runs."""

    subject: str
    seed: Annotated[int | None, SEED.saying("Scenario: master seed of all noise. Default 0.")] = None
    settings: Annotated[tuple[str, ...], SET] = ()
    firmware: Firmware = None
    network: Annotated[int | None, Option(type=Whole(0), help="Network of the robot. Default 0.")] = None
    robot: Annotated[
        int | None, Option(type=Whole(0, 4), help="Slot of the robot. Default: the lowest used.")
    ] = None
    sources: Annotated[
        tuple[str, ...], Option(metavar="FOLDER", type=NAME, help="Folder of the C files; may be repeated.")
    ] = ()
    engine: Engine = None


class Session(NamedTuple):
    """`said`: what there is to know of a case before anything is asked."""

    timeline: Timeline
    symbols: Symbols
    said: list[str]


def open_subject(options: SubjectOptions) -> Session:
    """Raises BadInput."""
    request = Request(
        subject=options.subject, seed=options.seed, firmware=options.firmware, settings=options.settings,
        network=options.network, robot=options.robot, from_tick=0, to_tick=None, engine=options.engine,
        bare=BareRequest(),
    )  # fmt: skip
    run = open_run(request)
    assert isinstance(run, RobotRun | BareRun)
    image = with_debug_files(run.image)
    folder = source_folder()
    own = [folder] if folder is not None and load_firmware(named=False).sha256 == run.image.sha256 else []
    return Session(Timeline(run), Symbols(image, [*map(Path, options.sources), *own]), [])
