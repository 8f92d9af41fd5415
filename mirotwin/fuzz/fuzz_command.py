"""`mirotwin fuzz`: searches for inputs that make firmware fail, with a coverage-guided engine. This module is one of
the few that use the wall clock.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from contextlib import suppress
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, cast

import click
from msgspec.structs import replace

from miro_exact import engine as engines
from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.plugins import PluginError
from miro_robot.harness.harness import AWAKE_TICKS
from miro_robot.image import FLASH_BYTES, SPACE_BYTES, Image
from miro_robot.mcs51.opcodes import SFRS
from miro_sim.scenario.board_scenario import BoardText, check_single, is_board, load_any
from miro_sim.scenario.file import changed
from mirotwin.firmware.bare_options import CRYSTAL
from mirotwin.firmware.code_place import address_of
from mirotwin.fuzz.board_target import BoardTarget
from mirotwin.fuzz.campaign import AFTER_S, Campaign, Covering
from mirotwin.fuzz.corpus import read_corpus
from mirotwin.fuzz.engine import Engine, Explorer
from mirotwin.fuzz.engines import engine_for
from mirotwin.fuzz.files import CampaignFolder, check_outside, unused
from mirotwin.fuzz.input_coverage import InputCoverage
from mirotwin.fuzz.making import make_target
from mirotwin.fuzz.oracle import oracle_of
from mirotwin.fuzz.results import CampaignResults, clock
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import Target
from mirotwin.fuzz.triage import MINIMISE_S, Crash, Triage
from mirotwin.recording.decode_command import ROBOTS
from mirotwin.runs.spec import silent_scenario
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.console import show
from mirotwin.shell.debug_files import SourceFolders, source_folders
from mirotwin.shell.firmware_image import image_for, load_firmware
from mirotwin.shell.options import (
    BAUD,
    FIRMWARE,
    FORCE,
    JOBS,
    JSON,
    JUNIT,
    NAME,
    OUT,
    PATH,
    QUIET,
    SEED,
    SET,
    SLOT,
    Whole,
)
from mirotwin.shell.options import Engine as EngineOption
from mirotwin.shell.outputs import check_file
from mirotwin.shell.plugin_files import PART, PluginFiles
from mirotwin.shell.processes import cores
from mirotwin.shell.program import Terminated, complain, show_line
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.times import Time, TimeType, wall_time
from mirotwin.shell.verdicts import VERDICTS
from mirotwin.verify.checks.expect import expectations_in
from mirotwin.verify.expectations import EXPECT, as_settings, in_files, table_alone
from mirotwin.verify.steps.reading import steps_in

if TYPE_CHECKING:
    from rich.progress import ProgressColumn

LONGEST_S = 1e7
BOARD_S = 60
"""Duration of the scenario of a board that is given without a scenario, in seconds."""
_NINE_BITS = 0x80  # of SCON: SM0
BARE = "Any 8051 firmware with a serial port"
BOARD = "A board with parts"
_FOR_ANY = ("protocol", "baud", "boot_ms")
"""Options of either of these."""
_NOT_FOR_BOARDS = ("robots", "slot", "bare", "crystal", "expect_all", "faults")


class FuzzOptions(Options, frozen=True, kw_only=True):
    COMMAND = "fuzz"
    image: Annotated[str | None, Argument("[IMAGE.ihx|BOARD]", NAME)] = None
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
    after: Annotated[
        Time | None,
        Option(
            type=TimeType(),
            help="How long each run goes on after its last character, such as 200ms. Default: until the firmware"
            f" sleeps; {1000 * AWAKE_TICKS // TICKS_PER_SECOND}ms if it never does.",
        ),
    ] = None
    faults: Annotated[
        bool,
        Option(help="Hardware of the robot breaks, too: RAM, LM629s, motors, wheels, port pins, the supply."),
    ] = False
    expected: Annotated[
        tuple[str, ...],
        EXPECT.saying(
            "A check that judges each input that found something new, as for `run`; may be repeated.",
        ),
    ] = ()
    covering: Annotated[
        str | None,
        Option(
            metavar="SYMBOL|ADDRESS", help="Look for an input that reaches this function, and end with it."
        ),
    ] = None
    until_crash: Annotated[bool, Option(help="End with the first failure that is confirmed.")] = False
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
        float, Option("--minimise", type=wall_time(LONGEST_S), help="Longest time for making a crash small.")
    ] = MINIMISE_S
    sources: SourceFolders = ()
    engine: EngineOption = None
    as_json: Annotated[bool, JSON.saying("Print one JSON document instead of the results.")] = False
    junit: Annotated[Path | None, JUNIT] = None
    quiet: Annotated[bool, QUIET.saying("No progress, and of the results only what failed.")] = False
    bare: Annotated[
        bool,
        Option(
            help="Fuzz IMAGE.ihx on a bare processor: nothing is on the board.",
            heading=BARE,
        ),
    ] = False
    crystal: Annotated[
        int | None, CRYSTAL.saying("Its crystal. Default 24000000.", heading=BARE, needs="bare")
    ] = None
    baud: Annotated[
        int | None,
        BAUD.saying("Rate on RXD. Default: what the firmware sets, or the board says.", heading=BARE),
    ] = None
    boot_ms: Annotated[
        int | None,
        Option(
            type=Whole(1, 60_000),
            metavar="MS",
            help="Time to start up, unless it sleeps earlier. Default 200; on a board with parts: see above.",
            heading=BARE,
        ),
    ] = None
    protocol: Annotated[
        str | None,
        Option(
            metavar="NAME[:KEY=VALUE,..]",
            help="The format that makes frames of bodies: by its name, or FILE.py:CLASS[:KEY=VALUE,..].",
            heading=BARE,
        ),
    ] = None
    expect_all: Annotated[
        bool,
        Option(help="--expect judges each input, not only those that are new.", heading=BARE, needs="bare"),
    ] = False
    firmware: Annotated[
        str | None,
        FIRMWARE.saying("Image on the board. Default: the one that the scenario names.", heading=BOARD),
    ] = None
    settings: Annotated[
        tuple[str, ...],
        SET.saying("A key of the board's scenario, such as put.eyes.distance_cm=60.", heading=BOARD),
    ] = ()
    parts: Annotated[tuple[str, ...], PART.saying(PART.help, heading=BOARD)] = ()
    steps: Annotated[
        int | None,
        Option(
            type=Whole(0, 10_000),
            metavar="N",
            help="Steps of the scenario that bring the board up. Default: those before the first that is no wait.",
            heading=BOARD,
        ),
    ] = None


LINE_S = 10.0
"""Wall time between two plain lines, where stderr is no terminal."""
INTERRUPTED_S = 5.0
"""Longest time in which inputs are still examined after a Ctrl-C, in seconds."""


@command_of(FuzzOptions)
def fuzz(options: FuzzOptions) -> int:
    """Searches for inputs that make IMAGE.ihx (default: the robot's own firmware) fail, on the robot's board.

    Each input starts when the firmware has booted. Firmware faults and the rules of the protocol are checked in each. A
    failing input is minimised, repeated in a World, and written to --out as crashes/NAME.stream, a case for `mirotwin
    replay`. At the end the functions and lines that no input reached are listed.

    With --bare IMAGE.ihx is any 8051 firmware with a serial port, on a processor without the robot's hardware.

    BOARD is a NAME.board.toml, with --firmware, or the scenario of a board. Inputs are characters, values of its parts
    and levels on pins that nothing drives. Inputs start after the first waits of the scenario's steps. Without steps
    they start when the firmware sleeps, or when its receiver is on and no new branch was executed for 300 ms; or after
    --boot-ms. The scenario's [expect] judges each input.

    Ctrl-C ends a campaign early and keeps its results.

    Exit code 1: a failure was found and confirmed, or --covering was not reached.
    """
    if options.image is not None and options.image.endswith(".toml"):
        return _fuzz_board(options)
    if given := options.given("firmware", "settings", "parts", "steps"):
        raise click.UsageError(f"{given[0]} needs a BOARD (NAME.board.toml, or the scenario of a board).")
    if not options.bare and (given := options.given(*_FOR_ANY)):
        raise click.UsageError(f"{given[0]} needs --bare, or a BOARD.")
    if options.bare and options.image is None:
        raise click.UsageError("--bare needs an IMAGE.ihx.")
    if options.expect_all and not options.expected:
        raise click.UsageError("--expect-all needs --expect.")
    firmware = load_firmware(options.image, SPACE_BYTES if options.bare else FLASH_BYTES)
    robots = int(options.robots)
    if options.slot >= robots:
        reason = f"--slot {options.slot} does not exist among {robots} robots"
        raise click.UsageError(f"{reason}; give 0 to {robots - 1}.")
    parameters = {"crystal_hz": options.crystal, "boot_ms": options.boot_ms}
    hertz = options.crystal or TICKS_PER_SECOND
    spec = replace(
        _common(options, hertz),
        board="bare" if options.bare else "miro",
        image=options.image or "",
        robots=robots,
        slot=options.slot,
        expected=options.expected if options.expect_all else (),
        parameters={name: value for name, value in parameters.items() if value is not None},
    )
    return _campaign(spec, firmware, options, _expected(options), hertz)


def _fuzz_board(options: FuzzOptions) -> int:
    """A campaign on a board with parts."""
    source = str(options.image)
    if given := options.given(*_NOT_FOR_BOARDS):
        raise click.UsageError(f"{given[0]} is not for a board with parts, which {source} is.")
    PluginFiles(parts=options.parts).bring()
    lasts = (f"duration_s={BOARD_S}",) if is_board(source) else ()
    text = load_any(source, (*options.settings, *lasts, *as_settings(options.expected)))
    if not isinstance(text, BoardText):
        remedy = "give a board, or fuzz the robot by `mirotwin fuzz IMAGE.ihx`"
        raise BadInput(source, "", "is a scenario of robots", remedy)
    check_single(text.scenario, source, "fuzzing")
    expectations_in(text)
    steps = steps_in(text)
    leading = len(list(takewhile(lambda step: not step.CHANGES or step.VERB == "pause_ms", steps)))
    count = leading if options.steps is None else options.steps
    if count > len(steps):
        raise BadInput(source, "--steps", f"{count} of {amount(len(steps), 'step')}", "give fewer")
    if count < len(steps):
        complain(f"{source}: steps {count + 1} to {len(steps)} are left out: inputs take their place")
    image = image_for(text, options.firmware)
    hertz = text.scenario.clock
    spec = replace(
        _common(options, hertz),
        board="wired",
        image=str(image.path),
        expected=options.expected,
        parameters={
            "tables": text.tables,
            "steps": count,
            "boot_ms": options.boot_ms or 0,
            "parts": options.parts,
        },
    )
    return _campaign(spec, image, options, text.scenario.expect, hertz)


def _common(options: FuzzOptions, hertz: int) -> TargetSpec:
    """The fields of the target specification that all boards share."""
    return TargetSpec(
        input=options.kind,
        protocol=options.protocol or "",
        baud=options.baud or 0,
        after_ticks=None if options.after is None else options.after.ticks(hertz),
        engine=cast(Literal["compiled", "python"], engines.active()),
        faults=options.faults,
    )


def _campaign(
    spec: TargetSpec, image: Image, options: FuzzOptions, expected: dict[str, Any], hertz: int
) -> int:
    default = Path("runs") / f"fuzz-{image.path.stem}"
    folder = CampaignFolder(options.out or (default if options.force else unused(default)), options.force)
    check_outside(folder.path, options.corpus)
    if options.junit is not None:
        check_file(options.junit, "--junit", options.image, options.firmware)
    covering = _covering(options.covering, image)
    target = make_target(spec)
    oracle = oracle_of(target, expected)
    inputs = dict.fromkeys(filter(None, target.seeds()))
    if options.corpus is not None:
        taken, notes = read_corpus(options.corpus, target.inputs_of)
        inputs |= dict.fromkeys(taken)
        for note in notes:
            complain(note)
    _check_at_rest(target, image, hertz)
    if isinstance(target, BoardTarget) and spec.board == "wired":
        complain(f"{image.path}: {target.note()}", *target.chip_notes())
        for name, reason in target.left_out.items():
            complain(f"{name}: left out, it fails without any input: {reason}")
        judged = {*target.left_out, *(check.name for check in target.checks)}
        expected = {
            name: value for name, value in expected.items() if name not in judged and value is not False
        }
    reached = InputCoverage(image, lambda: make_target(spec))
    if covering is not None and covering.address in reached.total:
        reason = f"{covering.name} runs while the firmware starts, before any input"
        raise BadInput("", "--covering", reason, "name a function that an input has to reach")
    triage = Triage(reached, oracle, folder, source_folders(image, options.sources), options.minimise_s)
    with folder.filled():
        failing, passing, silent = _sorted_out(target, inputs)
        engine = _engine(spec, passing, folder, options)
        tell = (lambda crash: None) if options.quiet else _tell
        campaign = Campaign(engine, triage, expected, covering, tell, options.until_crash)
        campaign.begin_with(failing, (*passing, *silent))
        return _run(campaign, options.time_s if passing else 0.0, options)


def _engine(spec: TargetSpec, passing: list[bytes], folder: CampaignFolder, options: FuzzOptions) -> Engine:
    """An engine that starts with the passing inputs; the base `Engine`, which generates none, if there are no such
    inputs.
    """
    if not passing:
        complain("every input fails or executes no branch: there is nothing to go on from")
        return Engine()
    jobs = max(1, cores() - 1) if options.jobs is None else options.jobs
    engine, notes = engine_for(spec, passing, folder, make_target(spec), jobs, options.seed)
    for note in notes:
        complain(note)
    return engine


def _sorted_out(target: Target, inputs: Iterable[bytes]) -> tuple[list[bytes], list[bytes], list[bytes]]:
    """Sorts inputs into failing ones, ones that an engine can start with, and ones that execute no branch."""
    failing: list[bytes] = []
    passing: list[bytes] = []
    silent: list[bytes] = []
    explorer = Explorer(target)
    for data in inputs:
        edges = explorer.run(data)
        (failing if target.failure else passing if edges else silent).append(data)
    return failing, passing, silent


def _run(campaign: Campaign, time_s: float, options: FuzzOptions) -> int:
    """Runs the campaign to its end, also after an interruption; returns the exit code."""
    stopped: BaseException | None = None
    left, quiet = 0, options.quiet
    with FuzzProgress(campaign.triage.target.image.path.name, time_s, quiet) as progress:
        campaign.show = progress.show
        try:
            campaign.run(time_s)
            left = 0 if campaign.crashed else campaign.finish(AFTER_S)
        except (KeyboardInterrupt, Terminated) as error:
            stopped, limit_s = error, 1.0
            if isinstance(error, KeyboardInterrupt):
                limit_s = INTERRUPTED_S
                complain(f"interrupted; looking for {limit_s:.0f} s at most at what is left")
            left = campaign.finish(limit_s)
        except PluginError as error:
            stopped = BadInput("", "--expect", f"{error.what}; the campaign has ended", error.remedy)
            stopped.__cause__ = error
        except BadInput as error:  # of the engine: earlier results are reported first
            stopped = error
            with suppress(BadInput, PluginError):
                left = campaign.finish(INTERRUPTED_S)
    own = in_files(options.expected)
    plugins = PluginFiles(parts=options.parts)
    code = _report(CampaignResults(campaign, left, stopped is None, own, plugins), options)
    if stopped is not None:
        raise stopped
    return code


def _report(results: CampaignResults, options: FuzzOptions) -> int:
    """Shows a campaign's results, then writes its files; returns the exit code."""
    quiet = options.quiet or options.as_json
    if not quiet:
        for part in results.overview():
            if isinstance(part, str):
                show_line(part)
            else:
                show(part)
    for note in results.notes():
        complain(note)
    if options.as_json:
        results.for_programs.print_json()
    else:
        for line in results.crashes():
            show_line(line)
    results.write()  # after the results were shown: a full disk must not hide them
    results.for_programs.write_junit(options.junit)
    if not quiet:
        show_line(f"written to {results.out}")
    return VERDICTS[results.verdict].code


class FuzzProgress(ProgressBar):
    """A context manager; `show(campaign)` may be called as often as one likes."""

    PATIENCE_S = 0.0

    def __init__(self, subject: str, time_s: float, quiet: bool) -> None:
        super().__init__(f"fuzzing {subject}", time_s, quiet)
        self._time_s = time_s
        self._quiet = quiet
        self._line_s = time.monotonic()

    def __enter__(self) -> Self:
        self.to(0.0, note="starting")
        return self

    def show(self, campaign: Campaign) -> None:
        """Draws the line again, or writes one if the last is some time ago."""
        run_s = campaign.run_s
        if self._shown:
            self.to(min(run_s, self._time_s), note=progress_text(campaign))
        elif not self._quiet and time.monotonic() - self._line_s >= LINE_S:
            self._line_s = time.monotonic()
            left = clock(max(0.0, self._time_s - run_s))
            complain(f"{self.what}: {clock(run_s)}: {progress_text(campaign)}, {left} left")

    def _columns(self) -> list[ProgressColumn]:
        from rich.progress import BarColumn, TextColumn, TimeRemainingColumn

        words = [TextColumn(f"{{task.{key}}}", markup=False) for key in ("description", "fields[note]")]
        return [*words, BarColumn(bar_width=16), TimeRemainingColumn()]


def progress_text(campaign: Campaign) -> str:
    """Rates and counts of a campaign, in short."""
    edges, triage = campaign.progress().edges, campaign.triage
    parts = [f"{campaign.rate:.0f}/s"]
    if edges is not None:  # else the engine has not reported yet
        parts.append(amount(edges, "edge"))
    parts.append(amount(len(triage.confirmed) or "no", "crash", "crashes"))
    if triage.unconfirmed:
        parts.append(f"{len(triage.unconfirmed)} unconfirmed")
    return ", ".join(parts)


def _tell(crash: Crash) -> None:
    kind = "found" if crash.confirmed else "found, but not confirmed in a World"
    complain(f"{kind}: {crash.name}: {crash.verdict}")


def _expected(options: FuzzOptions) -> dict[str, Any]:
    """The checks of --expect as a table. Raises BadInput for one that there is not, or with wrong parameters."""
    if options.bare:
        return table_alone(options.expected, "fuzz")
    text = changed(silent_scenario(()), "fuzz", as_settings(options.expected))
    expectations_in(text)
    return dict(text.scenario.expect)


def _covering(symbol: str | None, image: Image) -> Covering | None:
    """The function and its address. Raises BadInput for an unknown function."""
    if symbol is None:
        return None
    return Covering(symbol, address_of(symbol, image, str(image.path), f"--covering {symbol}"))


def _check_at_rest(target: Target, image: Image, crystal_hz: int) -> None:
    """Raises BadInput for firmware in which something is wrong before it has received anything."""
    target.run(b"")
    failure = target.failure
    if not target.harness.sleeps and target.harness.after_ticks < 0:
        after = (
            f"{1000 * AWAKE_TICKS / crystal_hz:.3g} ms after its last character (--after gives another time)"
        )
        complain(f"{image.path}: never sleeps (IDL); each run goes on for {after}")
    if target.cpu.sfr(SFRS["SCON"]) & _NINE_BITS:
        why = "inputs are characters of 8 without a pause, which it reads as others"
        complain(f"{image.path}: takes characters of 9 bits; {why}")
    if failure is not None:
        reason = f"fails before it has heard anything: {failure.check}: {failure.what}"
        raise BadInput(image.path, "", reason, "mend that first: each input would find it")
