"""`mirotwin diff`: the first difference of two recordings, or of one run with two firmwares."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec.structs import replace

from miro_exact.bad_input import BadInput, amount
from miro_exact.inputs import RECORDING_BYTES, check_no_folder, read_input
from miro_robot.image import FLASH_BYTES, SPACE_BYTES
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import BoardText, load_any
from mirotwin.recording.capture.options import CaptureOptions
from mirotwin.recording.compare import CompareRule, only_robots, robots_of
from mirotwin.recording.reader import parse
from mirotwin.recording.writer import MAGIC
from mirotwin.replay.difference import ComparedRun, RunDifference, compare_runs
from mirotwin.replay.lockstep.annotated_image import annotated_of
from mirotwin.replay.options import CompareOptions, check_reaches, extent, refuse_given, rule_as_json
from mirotwin.replay.text import difference_lines, difference_tables, source_tables
from mirotwin.runs.job import DEFAULT_SCENARIO, load_job, recorded_spec, recording_notes
from mirotwin.runs.made_from import MadeFrom, source_differences
from mirotwin.runs.result import fault_lines
from mirotwin.runs.run import Run, replaying
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.command import Argument, Option, Options, command_line, command_of, operand
from mirotwin.shell.console import show
from mirotwin.shell.debug_files import LinesFrom, SourceFolders, checked_sources, load_images
from mirotwin.shell.firmware_image import image_for, load_firmware
from mirotwin.shell.json_text import print_json
from mirotwin.shell.options import (
    ALL,
    NAME,
    QUIET,
    SEED,
    SET,
    Engine,
    ScenarioName,
    plain_parameters,
    refuse_steps,
)
from mirotwin.shell.outputs import RECORDINGS, file_in
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.shell.program import complain, tell_notes
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import DONE, exit_code
from mirotwin.verify.cases.artifacts import CASES

NAMES = ("A", "B")


class DiffOptions(Options, frozen=True, kw_only=True):
    COMMAND = "diff"
    a: Annotated[str, Argument("A", NAME)]
    b: Annotated[str, Argument("B", NAME)]
    on: Annotated[
        str,
        Option(
            "--on",
            metavar="SCENARIO|FILE",
            type=ScenarioName(),
            help="What two images run: a scenario, or the bytes of a stream, a case, a recording or a capture.",
        ),
    ] = DEFAULT_SCENARIO
    seed: Annotated[int | None, SEED.saying("Master seed of all noise, for two images.")] = None
    settings: Annotated[
        tuple[str, ...], SET.saying("A key of the scenario, for two images, as for `run`.")
    ] = ()
    compare: CompareOptions = CompareOptions()
    capture: CaptureOptions = CaptureOptions()
    lines_from: LinesFrom = ()
    sources: SourceFolders = ()
    plugins: PluginFiles = PluginFiles()
    engine: Engine = None
    everything: Annotated[bool, ALL.saying("List every difference, not only the first of each channel.")] = (
        False
    )
    quiet: Annotated[bool, QUIET.saying("No progress bar, no tables.")] = False

    @property
    def shows(self) -> bool:
        """True if tables are printed."""
        return not self.quiet and not self.compare.as_json


@command_of(DiffOptions)
def diff(options: DiffOptions) -> int:
    """Compares the recordings A and B (run.mcap, or a run's folder): their sources, then their content. Or the firmware
    images A and B: the behaviour of robots with each of them, in a scenario or under the bytes of a stream.

    `bits` compares the PCs, too, and in recordings the digests of the states. If both runs can be repeated, the first
    tick with a difference of their states is searched, with the fields that differ; with two firmwares also the first
    instruction.

    Exit code 4: the runs differ; 0: they are the same, from the same sources or not.
    """
    compare = options.compare
    if compare.kind == "answers":
        remedy = "`mirotwin replay` compares a recording made at a port with its twin"
        raise BadInput("", "--compare answers", "is for robots at a port, beside their twin", remedy)
    sources = checked_sources(options.sources)
    options.plugins.bring()
    first, other = _run_images(options) if _are_images(options) else _read_recordings(options)
    first, other = _with_same_robots(first, other)
    (spec, *_), (other_spec, *_) = first.ways, other.ways
    rule, notes = _rule(compare.rule(spec.scenario.clock), first, other)
    for run in (first, other):
        check_reaches(rule, run.ways[0].origin, run.periods)
    known = load_images(options.lines_from, spec.image, other_spec.image)
    annotate = partial(annotated_of, images=known, sources=sources)
    alike = (spec.scenario, spec.seed) == (other_spec.scenario, other_spec.seed)
    difference = compare_runs(first, other, rule, (annotate, annotate), NAMES, alike)
    difference = replace(difference, notes=(*first.notes, *other.notes, *notes, *difference.notes))
    made = [MadeFrom(run.ways[0], run.state, run.plugins) for run in (first, other)]
    origins = [*source_differences(*made)]
    if options.shows:
        show(*source_tables(origins, NAMES), *difference_tables(difference, options.everything))
    code = _report(options, first, other, difference, alike=not origins)
    if compare.as_json:
        document: dict[str, Any] = {"a": file_in(options.a), "b": file_in(options.b)}
        if not first.recorded:
            document |= {"on": options.on, "seed": spec.seed}
        document["sources"] = msgspec.to_builtins(origins)
        document["periods"] = {"a": len(first.periods), "b": len(other.periods)}
        document |= rule_as_json(rule) | difference.as_json(options.everything) | {"exit_code": code}
        print_json(document)
    return code


def _are_images(options: DiffOptions) -> bool:
    """True if A and B are images, False for recordings.

    Raises BadInput for one of each, and for image options with recordings.
    """
    paths = file_in(options.a), file_in(options.b)
    images = [path for path in paths if _is_image(path)]
    if len(images) == 1:
        recording = paths[paths[0] == images[0]]
        line = command_line("replay", operand(recording), "--firmware", operand(images[0]))
        raise BadInput(
            images[0], "", f"is an image, and {recording} a recording", f"give two images, or use `{line}`"
        )
    if not images:
        reason = "is for two images, and a recording has its own"
        refuse_given(paths[0], reason, options.given("on", "seed", "settings"))
    return bool(images)


def _is_image(path: str) -> bool:
    if path.endswith((".ihx", ".hex")) or not os.path.isfile(path):
        return path.endswith((".ihx", ".hex"))
    with open(path, "rb") as file:
        return file.read(1) == b":"


def _read_recordings(options: DiffOptions) -> tuple[ComparedRun, ComparedRun]:
    return _read_recording(file_in(options.a), options), _read_recording(file_in(options.b), options)


def _read_recording(path: str, options: DiffOptions) -> ComparedRun:
    check_no_folder(path)
    data = read_input(path, prefix=MAGIC, prefix_limit=RECORDING_BYTES)
    if not MAGIC.startswith(data[: len(MAGIC)]):
        remedy = "give a run.mcap, or two images (.ihx); `mirotwin replay FILE --out FOLDER` makes one of a capture"
        raise BadInput(path, "offset 0", "not a recording", remedy)
    recording = parse(data, path)
    source = recording.source
    if not recording.periods:
        raise BadInput(path, "", "the recording holds no control period", "there is nothing to compare")
    if source.resumed:
        reason = f"a run that was resumed: it begins with control period {recording.periods[0].index}"
        raise BadInput(path, "", reason, "replay it, or compare recordings of whole runs")
    complain(*recording_notes(recording, path))
    sent = recorded_spec(recording, path)
    if isinstance(sent.scenario, BoardScenario):
        options.compare.refuse_of_robots(path)
    ways = replace(sent, computed=True), sent
    return ComparedRun(recording.periods, ways, True, source.state, source.plugins)


def _run_images(options: DiffOptions) -> tuple[ComparedRun, ComparedRun]:
    on = file_in(options.on, (*RECORDINGS, *CASES))
    if Path(on).is_file() and not on.endswith(".toml"):
        job = load_job(on, options.a, options.settings, options.seed, capture=options.capture)
        complain(*job.notes)
        spec, end_tick = job.spec, job.end_tick
        if job.alone:
            options.compare.refuse_of_robots(on)
    else:
        text = load_any(on, (*options.plugins.settings(options.settings), *options.settings))
        tell_notes(text.notes)
        refuse_steps(text.scenario, text.origin)
        if isinstance(text, BoardText):
            options.compare.refuse_of_robots(on)
        image, seed, end_tick = image_for(text, options.a), options.seed or 0, text.scenario.end_tick
        spec = RunSpec.of(text, image, seed)
    end_tick = min(end_tick, options.compare.rule(spec.scenario.clock).to_tick or end_tick)
    period_ticks = spec.scenario.period_ticks
    end_tick = -(-end_tick // period_ticks) * period_ticks  # what is compared are whole ones
    spec = replace(spec, until_tick=end_tick, cut=True)
    runs = []
    for name, path in zip(NAMES, (options.a, options.b), strict=True):
        limit = SPACE_BYTES if isinstance(spec.scenario, BoardScenario) else FLASH_BYTES
        again = replace(spec, image=load_firmware(path, limit))
        with plain_parameters(on):
            run = Run(again)
        with ProgressBar(f"running {name}", end_tick, not options.shows) as bar, replaying(on, run.world):
            run.play(bar.to)
        faults = [f"{name}: {text}" for _, text in fault_lines(run.world.devices)]
        runs.append(ComparedRun(run.periods, [again], notes=faults))
    return runs[0], runs[1]


def _with_same_robots(first: ComparedRun, other: ComparedRun) -> tuple[ComparedRun, ComparedRun]:
    """Both with the robots that both have, and a note on each that has more. Raises BadInput where none is in both."""
    here, there = robots_of(first.periods), robots_of(other.periods)
    if here == there:
        return first, other
    common = [place for place in here if place in there]
    runs = []
    for name, run, robots in ((NAMES[0], first, here), (NAMES[1], other, there)):
        alone = [f"net{network}/robot{slot}" for network, slot in robots if (network, slot) not in common]
        notes = [*run.notes, *([f"only {name} has {', '.join(alone)}"] if alone else [])]
        runs.append(replace(run, periods=only_robots(run.periods, common), notes=notes))
    if not common:
        both = "; ".join(note for run in runs for note in run.notes)
        raise BadInput("", "", f"the recordings have no robot in common: {both}")
    return runs[0], runs[1]


def _rule(rule: CompareRule, run: ComparedRun, other: ComparedRun) -> tuple[CompareRule, list[str]]:
    """The rule for two recordings, with remarks: the reason why digests are not compared although the rule
    asks for it.
    """
    bits, recorded = rule.kind == "bits", run.recorded
    digests = bits and recorded and run.state == other.state  # they are of states of one form
    why = "their states have another form, by scenario or version of this program"
    notes = [f"the digests are not compared: {why}"] if bits and recorded and not digests else []
    period_ticks = run.ways[0].scenario.period_ticks
    return replace(rule, host=bits, digests=digests, period_ticks=period_ticks), notes


def _report(
    options: DiffOptions, run: ComparedRun, other: ComparedRun, difference: RunDifference, alike: bool
) -> int:
    """Lines for people; the exit code. `alike`: they were made from the same."""
    noun = "recordings" if run.recorded else "images"
    shorter, longer = sorted((run.periods, other.periods), key=len)
    cut = len(shorter) != len(longer) and options.compare.to_time is None
    complain(*difference_lines(difference, f"the {noun} differ"))
    if cut:
        complain(f"A has {amount(len(run.periods), 'control period')}, B has {len(other.periods)}")
    complain(*difference.notes)
    if difference.differences or cut:
        return exit_code("differs")
    if not options.compare.as_json:
        whole = extent(difference.rule, shorter)
        whence = "" if alike else "; they were not made from the same"
        recorded = f"the recordings hold the same in {whole}{whence}"
        show(recorded if run.recorded else f"on {options.on}, the images do the same in {whole}")
    return DONE
