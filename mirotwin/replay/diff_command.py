"""`mirotwin diff`: two recordings, what they were made from, and where they differ first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import msgspec

from miro_exact.bad_input import BadInput, amount
from miro_exact.inputs import RECORDING_BYTES, check_no_folder, read_input
from miro_sim.periods import Period
from miro_sim.scenario.file import parse as parse_scenario
from mirotwin.recording.compare import differences
from mirotwin.recording.difference import Difference
from mirotwin.recording.reader import Recording, parse
from mirotwin.recording.writer import MAGIC
from mirotwin.replay.compare_options import CompareOptions
from mirotwin.replay.differences import differences_as_json, print_differences, print_firmwares, print_json
from mirotwin.replay.exact_difference import (
    ExactDifference,
    Made,
    SourceDifference,
    locate,
    source_differences,
)
from mirotwin.replay.firmwares import annotated_of
from mirotwin.rerun.job import image_if_any
from mirotwin.shell.command import Argument, Options, command_of
from mirotwin.shell.console import plain_table, show
from mirotwin.shell.debug_files import LinesFrom, SourceFolders, checked_sources, load_images
from mirotwin.shell.options import ALL, NAME, QUIET, Engine
from mirotwin.shell.outputs import file_in
from mirotwin.shell.program import DIVERGENCE, DONE, complain

WORDS = ("A", "B")


class DiffOptions(Options, frozen=True, kw_only=True):
    COMMAND = "diff"
    a: Annotated[str, Argument("A", NAME)]
    b: Annotated[str, Argument("B", NAME)]
    compare: CompareOptions = CompareOptions()
    lines_from: LinesFrom = ()
    sources: SourceFolders = ()
    engine: Engine = None
    everything: Annotated[bool, ALL.saying("List every difference, not only the first of each channel.")] = (
        False
    )
    quiet: Annotated[bool, QUIET.saying("No tables.")] = False


@command_of(DiffOptions)
def diff(options: DiffOptions) -> int:
    """Compares the recordings A and B (run.mcap, or a run's folder): what they were made from, then all they hold.

    `bits` compares what the PCs did as well, and the digests of the states. Where both can be run again, the first
    tick is looked for at which their states differ, with the fields that do; and with two firmwares the first
    instruction.

    Exit code 4 when the recordings differ, 0 when they hold the same, whatever they were made from.
    """
    compare, sources = options.compare, checked_sources(options.sources)
    a, b = file_in(options.a), file_in(options.b)
    made = _made(a), _made(b)
    recordings = made[0].recording, made[1].recording
    origins = list(source_differences(*made))
    notes: list[str] = []
    one, other = _same_robots(recordings, notes)
    digests = _digests(compare, recordings, notes)
    rule = msgspec.structs.replace(compare.rule, host=compare.rule.kind == "bits", digests=digests)
    for path, recording in ((a, one), (b, other)):
        compare.check_reaches(path, recording.periods)
    found = differences(one.periods, other.periods, rule)
    lengths = len(one.periods), len(other.periods)
    images = load_images(options.lines_from, *(one.image for one in made))
    exact = ExactDifference()
    if found:
        annotated = [annotated_of(one.image, images, sources) for one in made if one.image is not None]
        exact = locate(made, annotated, found, notes)

    if not options.quiet and not compare.as_json:
        _print_sources(origins)
        if found:
            print_differences(found, options.everything, WORDS)
    code = _verdict(compare, origins, found, (one.periods, other.periods), exact, notes)
    if compare.as_json:
        document = {
            "a": a,
            "b": b,
            "sources": [one.as_json() for one in origins],
            "periods": {"a": lengths[0], "b": lengths[1]},
            **compare.rule_as_json(),
            **differences_as_json(found, options.everything, ("a", "b")),
            **exact.as_json(),
            "notes": notes,
            "exit_code": code,
        }
        print_json(document)
    return code


def _read(path: str) -> Recording:
    check_no_folder(path)
    data = read_input(path, prefix=MAGIC, prefix_limit=RECORDING_BYTES)
    if not MAGIC.startswith(data[: len(MAGIC)]):
        raise BadInput(path, "offset 0", "not a recording", "give a run.mcap that `mirotwin run` wrote")
    recording = parse(data, path)
    if not recording.periods:
        raise BadInput(path, "", "the recording holds no control period", "there is nothing to compare")
    if recording.source.resumed:
        what = f"a run that was resumed: it begins with control period {recording.periods[0].index}"
        raise BadInput(path, "", what, "replay it, or compare recordings of whole runs")
    if recording.broken_off:
        complain(f"{recording.broken_off}; it goes to control period {len(recording.periods) - 1}")
    return recording


def _made(path: str) -> Made:
    recording = _read(path)
    scenario = parse_scenario(recording.source.scenario_text, f"{path}: scenario.toml")
    return Made(path, recording, scenario, image_if_any(recording, path))


def _same_robots(recordings: tuple[Recording, Recording], notes: list[str]) -> tuple[Recording, Recording]:
    """Both with the robots that both have. Raises BadInput where they have none in common."""
    robots = [[(one.network, one.slot) for one in recording.periods[0].robots] for recording in recordings]
    if robots[0] == robots[1]:
        return recordings
    common = [place for place in robots[0] if place in robots[1]]
    for word, there in zip(WORDS, robots, strict=True):
        alone = ", ".join(
            f"net{network}/robot{slot}" for network, slot in there if (network, slot) not in common
        )
        if alone:
            notes.append(f"only {word} has {alone}")
    if not common:
        raise BadInput("", "", f"the recordings have no robot in common: {'; '.join(notes)}")
    return _only(recordings[0], common), _only(recordings[1], common)


def _only(recording: Recording, robots: Sequence[tuple[int, int]]) -> Recording:
    periods = []
    for period in recording.periods:
        by_place = {(robot.network, robot.slot): robot for robot in period.robots}
        kept = tuple(by_place[place] for place in robots)
        periods.append(msgspec.structs.replace(period, robots=kept))
    return msgspec.structs.replace(recording, periods=tuple(periods))


def _digests(compare: CompareOptions, recordings: tuple[Recording, Recording], notes: list[str]) -> bool:
    """Whether the digests say anything: they are of states of one form."""
    if compare.rule.kind != "bits":
        return False
    one, other = (recording.source.state for recording in recordings)
    if one != other:
        why = "their states have another form, by scenario or version of this program"
        notes.append(f"the digests are not compared: {why}")
    return one == other


def _print_sources(sources: Sequence[SourceDifference]) -> None:
    if not sources:
        return
    table = plain_table("made from", *WORDS)
    for one in sources:
        table.add_row(one.key, one.one, one.other)
    show(table)
    show("")


def _verdict(
    compare: CompareOptions,
    sources: Sequence[SourceDifference],
    found: Sequence[Difference],
    periods: tuple[Sequence[Period], Sequence[Period]],
    exact: ExactDifference,
    notes: Sequence[str],
) -> int:
    code = DONE
    if found:
        code = DIVERGENCE
        complain(f"the recordings differ in control period {exact.period}, {found[0].said(WORDS)}")
        if exact.state is not None:
            complain(f"their states differ from {exact.state} on")
        if exact.firmwares is not None:
            print_firmwares(exact.firmwares, WORDS)
    shorter, longer = sorted(periods, key=len)
    if len(shorter) != len(longer) and compare.rule.to_tick is None:
        code = DIVERGENCE
        complain(f"A has {amount(len(periods[0]), 'control period')}, B has {len(periods[1])}")
    for note in notes:
        complain(note)
    if code == DONE and not compare.as_json:
        how = "" if compare.rule.kind == "bits" else f" ({compare.described()})"
        whence = "; they were not made from the same" if sources else ""
        count = amount(compare.rule.compared(shorter), "control period")
        show(f"the recordings hold the same in all {count}{how}{whence}")
    return code
