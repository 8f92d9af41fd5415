"""`mirotwin diff`: two recordings, or what two firmwares do, and where they differ first."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec.structs import replace

from miro_exact.bad_input import BadInput, amount
from miro_exact.inputs import RECORDING_BYTES, check_no_folder, read_input
from miro_sim.periods import Period, RobotId
from miro_sim.scenario.file import load
from miro_sim.scenario.file import parse as parse_scenario
from mirotwin.recording.compare import CompareRule
from mirotwin.recording.reader import parse
from mirotwin.recording.writer import MAGIC
from mirotwin.replay.difference import ComparedRun, RunDifference, compare_runs
from mirotwin.replay.lockstep.annotated_image import annotated_of
from mirotwin.replay.options import CompareOptions, refuse_given
from mirotwin.replay.sources import RunOrigin, SourceDifference, source_differences
from mirotwin.replay.text import difference_lines, difference_tables
from mirotwin.runs.job import (
    DEFAULT_SCENARIO,
    image_if_any,
    load_job,
    plugin_notes,
    world_of,
)
from mirotwin.runs.result import fault_lines
from mirotwin.runs.run import Run, replaying
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.command import Argument, Option, Options, command_line, command_of, operand
from mirotwin.shell.console import plain_table, show
from mirotwin.shell.debug_files import LinesFrom, SourceFolders, checked_sources, load_images
from mirotwin.shell.firmware_image import load_firmware
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
            help="What two images run: a scenario, or the bytes of a stream, a case or a recording.",
        ),
    ] = DEFAULT_SCENARIO
    seed: Annotated[int | None, SEED.saying("Master seed of all noise, for two images.")] = None
    settings: Annotated[
        tuple[str, ...], SET.saying("A key of the scenario, for two images, as for `run`.")
    ] = ()
    compare: CompareOptions = CompareOptions()
    lines_from: LinesFrom = ()
    sources: SourceFolders = ()
    engine: Engine = None
    everything: Annotated[bool, ALL.saying("List every difference, not only the first of each channel.")] = (
        False
    )
    quiet: Annotated[bool, QUIET.saying("No progress bar, no tables.")] = False

    @property
    def shows(self) -> bool:
        """Whether tables are printed."""
        return not self.quiet and not self.compare.as_json


class Side(msgspec.Struct, frozen=True):
    """A or B: the run, what it was made from, and what else there is to say of it."""

    path: str
    run: ComparedRun
    origin: RunOrigin
    notes: tuple[str, ...] = ()


@command_of(DiffOptions)
def diff(options: DiffOptions) -> int:
    """Compares the recordings A and B (run.mcap, or a run's folder): what they were made from, then all they hold. Or
    the firmware images A and B: what robots do with each of them, in a scenario or under the bytes of a stream.

    `bits` compares what the PCs did as well, and in recordings the digests of the states. Where both can be run again,
    the first tick is looked for at which their states differ, with the fields that do; and with two firmwares the
    first instruction.

    Exit code 4 when the runs differ, 0 when they are the same, whatever they were made from.
    """
    compare = options.compare
    if compare.kind == "answers":
        remedy = "`mirotwin replay` compares a recording made at a port with its twin"
        raise BadInput("", "--compare answers", "is for robots at a port, beside their twin", remedy)
    sources = checked_sources(options.sources)
    images = _are_images(options)
    one, other = _run_images(options) if images else _read_recordings(options)
    one, other = _with_same_robots(one, other)
    for side in (one, other):
        compare.check_reaches(side.path, side.run.periods)
    rule, notes = _rule(compare.rule, one, other)
    known = load_images(options.lines_from, one.run.image, other.run.image)
    annotate = partial(annotated_of, images=known, sources=sources)
    alike = one.origin.scenario == other.origin.scenario and one.origin.seed == other.origin.seed
    found = compare_runs(one.run, other.run, rule, (annotate, annotate), NAMES, alike)
    found = replace(found, notes=(*one.notes, *other.notes, *notes, *found.notes))
    origins = [*source_differences(one.origin, other.origin)]
    if options.shows:
        _print_tables(origins, found, options.everything)
    code = _report(options, one, other, origins, found)
    if compare.as_json:
        run = {"on": options.on, "seed": one.origin.seed} if images else {}
        document = {
            "a": one.path,
            "b": other.path,
            **run,
            "sources": [each.as_json() for each in origins],
            "periods": {"a": len(one.run.periods), "b": len(other.run.periods)},
            **compare.rule_as_json(),
            **found.as_json(options.everything),
            "exit_code": code,
        }
        print_json(document)
    return code


def _are_images(options: DiffOptions) -> bool:
    """Whether A and B are, not recordings. Raises BadInput where one is, and for options that are for images."""
    paths = file_in(options.a), file_in(options.b)
    images = [path for path in paths if _is_image(path)]
    if len(images) == 1:
        recording = paths[paths[0] == images[0]]
        line = command_line("replay", operand(recording), "--firmware", operand(images[0]))
        raise BadInput(images[0], "", f"is an image, and {recording} is none", f"give two, or use `{line}`")
    if not images:
        what = "is for two images, and a recording has its own"
        refuse_given(paths[0], what, options.given("on", "seed", "settings"))
    return bool(images)


def _is_image(path: str) -> bool:
    if path.endswith((".ihx", ".hex")) or not os.path.isfile(path):
        return path.endswith((".ihx", ".hex"))
    with open(path, "rb") as file:
        return file.read(1) == b":"


def _read_recordings(options: DiffOptions) -> tuple[Side, Side]:
    return _read_recording(file_in(options.a)), _read_recording(file_in(options.b))


def _read_recording(path: str) -> Side:
    check_no_folder(path)
    data = read_input(path, prefix=MAGIC, prefix_limit=RECORDING_BYTES)
    if not MAGIC.startswith(data[: len(MAGIC)]):
        remedy = "give a run.mcap that `mirotwin run` wrote, or two images (.ihx)"
        raise BadInput(path, "offset 0", "not a recording", remedy)
    recording = parse(data, path)
    if not recording.periods:
        raise BadInput(path, "", "the recording holds no control period", "there is nothing to compare")
    source = recording.source
    if source.resumed:
        what = f"a run that was resumed: it begins with control period {recording.periods[0].index}"
        raise BadInput(path, "", what, "replay it, or compare recordings of whole runs")
    if recording.broken_off:
        complain(f"{recording.broken_off}; it goes to control period {len(recording.periods) - 1}")
    complain(*plugin_notes(path, source))
    scenario = parse_scenario(source.scenario_text, f"{path}: scenario.toml")
    image = image_if_any(recording, path)
    ways = [partial(world_of, recording, path, scripted=scripted) for scripted in (False, True)]
    origin = RunOrigin(scenario, source.seed, source.firmware_sha256, image, source.plugins, source.state)
    return Side(path, ComparedRun(recording.periods, image, ways, recorded=True), origin)


def _run_images(options: DiffOptions) -> tuple[Side, Side]:
    """Runs both."""
    on = file_in(options.on, (*RECORDINGS, *CASES))
    if Path(on).is_file() and not on.endswith(".toml"):
        job = load_job(on, options.a, options.settings, options.seed)
        complain(*job.notes)
        spec, end_tick = job.spec, job.end_tick
    else:
        text = load(on, options.settings)
        tell_notes(text.notes)
        refuse_steps(text.scenario, text.origin)
        image, seed, end_tick = load_firmware(options.a), options.seed or 0, text.scenario.end_tick
        spec = RunSpec(scenario=text.scenario, image=image, seed=seed, origin=on)
    end_tick = min(end_tick, options.compare.rule.to_tick or end_tick)
    sides = []
    for name, path in zip(NAMES, (options.a, options.b), strict=True):
        image = load_firmware(path)
        with plain_parameters(on):
            run = Run(replace(spec, image=image, until_tick=end_tick, cut=True))
        with ProgressBar(f"running {name}", end_tick, not options.shows) as bar, replaying(on, run.world):
            run.play(bar.to)
        faults = tuple(f"{name}: {text}" for _, text in fault_lines(run.world.robots))
        origin = RunOrigin(spec.scenario, spec.seed, image.sha256, image)
        sides.append(Side(path, ComparedRun(run.periods, image, [spec.world]), origin, faults))
    return sides[0], sides[1]


def _with_same_robots(one: Side, other: Side) -> tuple[Side, Side]:
    """Both with the robots that both have, and a note on each that has more. Raises BadInput where none is in both."""
    here, there = _robots(one), _robots(other)
    if here == there:
        return one, other
    common = [place for place in here if place in there]
    sides = []
    for name, side, robots in ((NAMES[0], one, here), (NAMES[1], other, there)):
        alone = [f"net{network}/robot{slot}" for network, slot in robots if (network, slot) not in common]
        notes = (*side.notes, *([f"only {name} has {', '.join(alone)}"] if alone else []))
        periods = [_only(period, common) for period in side.run.periods]
        sides.append(replace(side, run=replace(side.run, periods=periods), notes=notes))
    if not common:
        both = "; ".join(note for side in sides for note in side.notes)
        raise BadInput("", "", f"the recordings have no robot in common: {both}")
    return sides[0], sides[1]


def _robots(side: Side) -> list[RobotId]:
    return [(robot.network, robot.slot) for robot in side.run.periods[0].robots]


def _only(period: Period, robots: Sequence[RobotId]) -> Period:
    by_place = {(robot.network, robot.slot): robot for robot in period.robots}
    return replace(period, robots=tuple(by_place[place] for place in robots))


def _rule(rule: CompareRule, one: Side, other: Side) -> tuple[CompareRule, list[str]]:
    """With what only recordings are compared in; and why digests are not, if they should."""
    bits, recorded = rule.kind == "bits", one.run.recorded
    digests = bits and recorded and one.origin.state == other.origin.state  # they are of states of one form
    why = "their states have another form, by scenario or version of this program"
    notes = [f"the digests are not compared: {why}"] if bits and recorded and not digests else []
    return replace(rule, host=bits, digests=digests), notes


def _print_tables(origins: Sequence[SourceDifference], found: RunDifference, everything: bool) -> None:
    if origins:
        table = plain_table("made from", *NAMES)
        for each in origins:
            table.add_row(each.key, each.a, each.b)
        show(table)
        show("")
    for part in difference_tables(found, everything) if found.differences else ():
        show(part)


def _report(
    options: DiffOptions, one: Side, other: Side, origins: Sequence[SourceDifference], found: RunDifference
) -> int:
    """Lines for people; the exit code."""
    noun = "recordings" if one.run.recorded else "images"
    shorter, longer = sorted((one.run.periods, other.run.periods), key=len)
    cut = len(shorter) != len(longer) and options.compare.to_time is None
    for line in difference_lines(found, f"the {noun} differ") if found.differences else ():
        complain(line)
    if cut:
        complain(f"A has {amount(len(one.run.periods), 'control period')}, B has {len(other.run.periods)}")
    for note in found.notes:
        complain(note)
    if found.differences or cut:
        return exit_code("differs")
    if not options.compare.as_json:
        extent = options.compare.extent(shorter)
        whence = "; they were not made from the same" if origins else ""
        recorded = f"the recordings hold the same in {extent}{whence}"
        show(recorded if one.run.recorded else f"on {options.on}, the images do the same in {extent}")
    return DONE
