"""The options of `mirotwin fuzz`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import click

from miro_robot.image import SPACE_BYTES, Image
from mirotwin.firmware.bare_options import BAUD, CRYSTAL
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.triage import MINIMISE_S
from mirotwin.recording.decode_command import ROBOTS
from mirotwin.shell.command import Argument, Option, Options
from mirotwin.shell.debug_files import SourceFolders
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import FORCE, JOBS, NAME, OUT, PATH, QUIET, SEED, SLOT, Engine, Whole
from mirotwin.shell.times import wall_time
from mirotwin.verify.expectations import CHECK, EXPECT

LONGEST_S = 1e7
BARE = "Any 8051 firmware with a serial port"


class FuzzOptions(Options, frozen=True, kw_only=True):
    COMMAND = "fuzz"
    image: Annotated[str | None, Argument("[IMAGE.ihx]", NAME)] = None
    time_s: Annotated[float, Option("--time", type=wall_time(LONGEST_S), help="How long: 30s, 5min, 2h.")] = (
        60.0
    )
    jobs: Annotated[int | None, JOBS.saying("Processes of the engine. Default: the processors but one.")] = (
        None
    )
    kind: Annotated[
        str,
        Option(
            "--input",
            type=click.Choice(["bytes", "frames", "session"]),
            help="What an input is: characters; frames, whose CRC is made right; frames, pauses, damage, resets.",
        ),
    ] = "session"
    corpus: Annotated[
        Path | None,
        Option(
            type=PATH,
            metavar="DIR",
            help="Folder of recordings, stream files, captures and inputs of earlier campaigns to begin with.",
        ),
    ] = None
    expected: Annotated[
        tuple[str, ...],
        EXPECT.saying(
            "A check that judges each input that found something new, as for `run`; may be repeated.",
            apart="bare",
        ),
    ] = ()
    covering: Annotated[
        str | None,
        Option(metavar="SYMBOL", help="Look for an input that reaches this function, and end with it."),
    ] = None
    robots: Annotated[str, ROBOTS.saying("Slots of the network.", apart="bare")] = "3"
    slot: Annotated[int, SLOT.saying("Slot of the robot.", apart="bare")] = 0
    seed: Annotated[int | None, SEED.saying("Seed of the engine. Default: from the system.")] = None
    out: Annotated[
        Path | None,
        OUT.saying(
            "Folder for what it leaves. Default: runs/fuzz-IMAGE, with -2, -3, .. after an earlier campaign.",
            metavar="DIR",
        ),
    ] = None
    force: Annotated[bool, FORCE.saying("Replace an earlier campaign in --out.")] = False
    minimise_s: Annotated[
        float,
        Option("--minimise", type=wall_time(LONGEST_S), help="Longest time for making a crash small."),
    ] = MINIMISE_S
    sources: SourceFolders = ()
    engine: Engine = None
    quiet: Annotated[bool, QUIET.saying("No progress, and of the results only what failed.")] = False
    bare: Annotated[
        bool,
        Option(help="Fuzz IMAGE.ihx on a bare processor: nothing of the robot is connected.", heading=BARE),
    ] = False
    crystal: Annotated[
        int | None, CRYSTAL.saying("Its crystal. Default 24000000.", heading=BARE, needs="bare")
    ] = None
    baud: Annotated[
        int | None,
        BAUD.saying("Rate on RXD. Default: what the firmware sets.", heading=BARE, needs="bare"),
    ] = None
    boot_ms: Annotated[
        int | None,
        Option(
            type=Whole(1, 60_000),
            metavar="MS",
            help="Time to start up, unless it sleeps earlier. Default 200.",
            heading=BARE,
            needs="bare",
        ),
    ] = None
    protocol: Annotated[
        str | None,
        Option(
            metavar="NAME[:KEY=VALUE,..]",
            help="The format that makes frames of bodies.",
            heading=BARE,
            needs="bare",
        ),
    ] = None
    check: Annotated[
        str | None,
        CHECK.saying(
            "A check in Python that judges each input that found something new: by its name, or FILE.py:FUNCTION.",
            heading=BARE,
            needs="bare",
        ),
    ] = None
    check_all: Annotated[
        bool,
        Option(help="--check judges each input, not only those that are new.", heading=BARE, needs="check"),
    ] = False


def load_bare_firmware(path: str | None) -> Image:
    """The image of --bare, of any size that fits into a processor. Raises UsageError without one."""
    if path is None:
        raise click.UsageError("--bare needs an IMAGE.ihx.")
    return load_firmware(path, SPACE_BYTES)


def bare_spec(options: FuzzOptions, engine: Literal["compiled", "python"]) -> TargetSpec:
    """What the processes of the engine run."""
    parameters = {"crystal_hz": options.crystal, "boot_ms": options.boot_ms}
    return TargetSpec(
        board="bare",
        image=options.image or "",
        input=options.kind,
        protocol=options.protocol or "",
        check=(options.check or "") if options.check_all else "",
        baud=options.baud or 0,
        parameters={name: value for name, value in parameters.items() if value is not None},
        engine=engine,
    )
