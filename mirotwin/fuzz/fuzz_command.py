"""`mirotwin fuzz`: inputs that make firmware fail, found by an engine that is guided by what the firmware executes."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal, cast

import click

from miro_exact import engine as engines
from miro_exact.bad_input import BadInput, did_you_mean
from miro_exact.clock import TICKS_PER_SECOND
from miro_host.plugins import PluginError
from miro_robot.harness.harness import AWAKE_TICKS
from miro_robot.image import Image
from miro_sim.scenario.file import changed
from mirotwin.fuzz.campaign import AFTER_S, Campaign, Covering
from mirotwin.fuzz.corpus import read_corpus
from mirotwin.fuzz.engine import Engine, engine_for
from mirotwin.fuzz.files import CampaignFolder, check_outside, unused
from mirotwin.fuzz.fuzz_options import FuzzOptions, bare_spec, load_bare_firmware
from mirotwin.fuzz.fuzz_progress import FuzzProgress
from mirotwin.fuzz.fuzz_summary import CampaignEnd, report
from mirotwin.fuzz.input_coverage import InputCoverage
from mirotwin.fuzz.oracle import oracle_of
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import Target
from mirotwin.fuzz.triage import Crash, Triage
from mirotwin.shell.command import command_of
from mirotwin.shell.debug_files import sources_of
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.program import Terminated, complain
from mirotwin.verify.bare.exchange import NamedCheck, check_named
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.expectations import as_settings
from mirotwin.verify.rig_options import silent_scenario

AWAKE_MS = 1000 * AWAKE_TICKS // TICKS_PER_SECOND
INTERRUPTED_S = 5.0
"""How long inputs are still looked at after a Ctrl-C."""


@command_of(FuzzOptions)
def fuzz(options: FuzzOptions) -> int:
    """Looks for inputs that make IMAGE.ihx (default: the robot's own firmware) fail, on the robot's board.

    Each input is played from the moment at which the firmware is up. Faults and the promises of the protocol are judged
    in each; what fails is made small, played again in a World, and left in --out as crashes/NAME.stream, a case for
    `mirotwin replay`. Afterwards it says which functions and lines no input has reached.

    With --bare it is any 8051 firmware with a serial port, on a processor to which nothing of the robot is connected.

    Ctrl-C ends a campaign early, with all that was found.

    Exit code 1: something was found and confirmed, or --covering was not reached.
    """
    active = cast(Literal["compiled", "python"], engines.active())
    firmware = load_bare_firmware(options.image) if options.bare else load_firmware(options.image)
    robots, slot = int(options.robots), options.slot
    if slot >= robots:
        raise click.UsageError(f"--slot {slot} does not exist among {robots} robots; give 0 to {robots - 1}.")
    if not options.bare:
        spec = TargetSpec(
            image=options.image or "", input=options.kind, robots=robots, slot=slot, engine=active
        )
        return _campaign(spec, firmware, options, None, _expected(options.expected))
    check = None if options.check is None else check_named(options.check)
    expected = {} if check is None else {check.name: True}
    return _campaign(bare_spec(options, active), firmware, options, check, expected)


def _campaign(
    spec: TargetSpec,
    image: Image,
    options: FuzzOptions,
    check: NamedCheck | None,
    expected: dict[str, Any],
) -> int:
    default = Path("runs") / f"fuzz-{image.path.stem}"
    folder = CampaignFolder(options.out or (default if options.force else unused(default)), options.force)
    check_outside(folder.path, options.corpus)
    covering = _covering(options.covering, image)
    target = spec.make()
    oracle = oracle_of(target, check)
    inputs = target.seeds()
    if options.corpus is not None:
        corpus = read_corpus(options.corpus, spec.input, spec.robots)
        inputs = list(dict.fromkeys((*inputs, *corpus.inputs)))
        for note in corpus.notes:
            complain(note)
    _check_at_rest(target, image)
    reached = InputCoverage(image, spec.make)
    if covering is not None and covering.address in reached.total:
        what = f"{covering.name} runs while the firmware starts, before any input"
        raise BadInput("", "--covering", what, "name a function that an input has to reach")
    folder.make()
    triage = Triage(reached, oracle, folder, sources_of(image, options.sources), options.minimise_s)
    with folder.filled():
        failing, passing, silent = _sorted_out(target, inputs)
        engine = _engine(spec, passing, folder, options)
        campaign = Campaign(engine, triage, folder, expected, covering, _teller(options.quiet))
        campaign.begin_with(failing, (*passing, *silent))
        check_in_file = check.text if check is not None and check.from_file else None
        return _run(campaign, options.time_s if passing else 0.0, options.quiet, check_in_file)


def _engine(spec: TargetSpec, passing: list[bytes], folder: CampaignFolder, options: FuzzOptions) -> Engine:
    """One that goes on from the inputs that pass; one that makes up none where there are none."""
    if not passing:
        complain("every input fails or executes no branch: there is nothing to go on from")
        return Engine()
    engine, notes = engine_for(spec, passing, folder, spec.make(), _jobs(options.jobs), options.seed)
    for note in notes:
        complain(note)
    return engine


def _sorted_out(target: Target, inputs: list[bytes]) -> tuple[list[bytes], list[bytes], list[bytes]]:
    """Those that fail, those that an engine can begin with, and those that execute no branch."""
    failing: list[bytes] = []
    passing: list[bytes] = []
    silent: list[bytes] = []
    edges = bytearray(target.map_size)
    target.use_map(edges)
    for data in inputs:
        edges[:] = bytes(len(edges))
        if target.run(data):
            failing.append(data)
        else:
            (passing if any(edges) else silent).append(data)
    return failing, passing, silent


def _run(campaign: Campaign, time_s: float, quiet: bool, check_in_file: str | None) -> int:
    """The campaign to its end, whatever ends it; the exit code."""
    stopped: BaseException | None = None
    left = 0
    with FuzzProgress(campaign.triage.target.image.path.name, time_s, quiet) as progress:
        try:
            campaign.run(time_s, progress.show)
            left = campaign.finish(progress.show, AFTER_S)
        except (KeyboardInterrupt, Terminated) as error:
            stopped, limit_s = error, 1.0
            if isinstance(error, KeyboardInterrupt):
                limit_s = INTERRUPTED_S
                complain(f"interrupted; looking for {limit_s:.0f} s at most at what is left")
            left = campaign.finish(progress.show, limit_s)
        except PluginError as error:
            stopped = BadInput("", "--expect", f"{error.what}; the campaign has ended", error.remedy)
            stopped.__cause__ = error
        except BadInput as error:  # of the engine: what was found until then is told first
            stopped = error
            with suppress(BadInput, PluginError):
                left = campaign.finish(progress.show, INTERRUPTED_S)
    ended = CampaignEnd(left=left, complete=stopped is None, check=check_in_file)
    code = report(campaign, ended, quiet)
    if stopped is not None:
        raise stopped
    return code


def _teller(quiet: bool) -> Any:
    def tell(crash: Crash) -> None:
        kind = "found" if crash.confirmed else "found, but not confirmed in a World"
        complain(f"{kind}: {crash.name}: {crash.verdict}")

    return (lambda crash: None) if quiet else tell


def _expected(checks: tuple[str, ...]) -> dict[str, Any]:
    """The checks of --expect as a table. Raises BadInput for one that there is not, or with wrong parameters."""
    if not checks:
        return {}
    return dict(changed(silent_scenario(()), "fuzz", as_settings(checks), expectations_of).expect)


def _covering(symbol: str | None, image: Image) -> Covering | None:
    """Where the function begins. Raises BadInput for one that is not there."""
    if symbol is None:
        return None
    found = image.symbols.find(symbol)
    if found is None or found.space != "code":
        if not image.symbols.names:
            remedy = "put the .map or .cdb that the linker wrote beside the image"
            raise BadInput(image.path, f"--covering {symbol}", "the image has no symbols", remedy)
        functions = [name for name, one in image.symbols.names.items() if one.space == "code"]
        remedy = did_you_mean(symbol, functions) or "`mirotwin fw disasm` lists the functions"
        raise BadInput(image.path, f"--covering {symbol}", "there is no such function", remedy)
    return Covering(symbol, found.address)


def _check_at_rest(target: Target, image: Image) -> None:
    """Raises BadInput for firmware in which something is wrong before it has heard anything."""
    target.run(b"")
    failure = target.failure
    harness = getattr(target, "harness", None)
    if harness is not None and not harness.sleeps:
        complain(
            f"{image.path}: never sleeps (IDL); each run goes on for {AWAKE_MS} ms after its last character"
        )
    if failure is not None:
        what = f"fails before it has heard anything: {failure.check}: {failure.what}"
        raise BadInput(image.path, "", what, "mend that first: each input would find it")


def _jobs(jobs: int | None) -> int:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores - 1) if jobs is None else jobs
