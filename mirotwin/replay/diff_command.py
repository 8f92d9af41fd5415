"""`mirotwin diff`: two recordings, what they were made from, and where they differ first.

Where both can be run again: the exact tick and fields, and the instruction where firmwares differ.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Any

import msgspec

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.inputs import RECORDING_BYTES, check_no_folder, read_input
from miro_robot.image import Image
from miro_robot.inspect.symbol_names import SymbolNames
from miro_sim.periods import Period
from miro_sim.scenario.file import parse as parse_scenario
from miro_sim.scenario.keys import Scenario
from miro_sim.world.world import World
from mirotwin.recording.compare import differences
from mirotwin.recording.difference import DIGEST, Difference, shown
from mirotwin.recording.reader import Recording, parse
from mirotwin.recording.recorder import RunSource
from mirotwin.recording.writer import MAGIC
from mirotwin.replay.annotated_image import AnnotatedImage, annotated_of
from mirotwin.replay.compare_options import CompareOptions
from mirotwin.replay.differences import differences_as_json, print_differences, print_firmwares, print_json
from mirotwin.replay.firmwares import FirmwareDifference, first_instruction
from mirotwin.replay.lockstep import LOOK_TICKS, StateDifference, first_difference
from mirotwin.replay.state_fields import Record
from mirotwin.rerun.job import image_if_any, repeating, warn_of_plugins, world_of
from mirotwin.shell.command import Argument, Options, command_of
from mirotwin.shell.console import plain_table, show
from mirotwin.shell.debug_files import LinesFrom, SourceFolders, checked_sources, load_images
from mirotwin.shell.options import ALL, NAME, QUIET, Engine, plain_parameters
from mirotwin.shell.outputs import file_in
from mirotwin.shell.program import complain
from mirotwin.shell.verdicts import DONE, exit_code


class SourceDifference(Record, frozen=True):
    """`key`: `seed`, `firmware`, or a key of the scenario as for `--set`. Values as text, "nothing" for none."""

    key: str
    a: str
    b: str


class Made(msgspec.Struct, frozen=True):
    """A recording, and what it was made from. `image` None: what it holds is none."""

    path: str
    recording: Recording
    scenario: Scenario
    image: Image | None

    @property
    def source(self) -> RunSource:
        return self.recording.source


def source_differences(one: Made, other: Made) -> Iterator[SourceDifference]:
    """Seed, firmware, and the keys of the scenario that differ, those that a scenario leaves out included."""
    if one.source.seed != other.source.seed:
        yield SourceDifference("seed", str(one.source.seed), str(other.source.seed))
    if one.source.firmware_sha256 != other.source.firmware_sha256:
        hashes = (made.source.firmware_sha256 or "nothing" for made in (one, other))
        yield SourceDifference("firmware", *hashes)
        if one.image is not None and other.image is not None:
            yield from _first_byte(one.image, other.image)
    keys, others = (dict(_flat("", msgspec.to_builtins(made.scenario))) for made in (one, other))
    for key in {**keys, **others}:
        here, there = (shown(found.get(key)) for found in (keys, others))
        if here != there:
            yield SourceDifference(key, here, there)
    if one.source.plugins != other.source.plugins:
        yield SourceDifference(
            "plug-ins", *("; ".join(made.source.plugins) or "none" for made in (one, other))
        )
    if one.source.state and other.source.state and one.source.state != other.source.state:
        yield SourceDifference("form of the state", one.source.state[:12], other.source.state[:12])


def _first_byte(one: Image, other: Image) -> Iterator[SourceDifference]:
    places = [at for at, (a, b) in enumerate(zip(one.code, other.code, strict=False)) if a != b]
    if not places:
        yield SourceDifference("firmware code", "the same bytes", "the same bytes")
        return
    where = (
        f"{image.code[places[0]]:02X}h at {places[0]:#06x} in {SymbolNames(image).place(places[0])}"
        for image in (one, other)
    )
    yield SourceDifference(f"firmware code, the first of {amount(len(places), 'byte')}", *where)


def _flat(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flat(f"{path}.{key}" if path else str(key), inner)
    elif isinstance(value, list | tuple) and any(isinstance(item, dict) for item in value):
        for index, inner in enumerate(value):
            yield from _flat(f"{path}.{index}", inner)
    else:
        yield path, value


Both = tuple[Made, Made]


class ExactDifference(Record, frozen=True):
    """The result. `period`: the first control period that differs."""

    period: int | None = None
    state: StateDifference | None = None
    instruction: FirmwareDifference | None = None


def locate(
    made: Both, annotated: Sequence[AnnotatedImage], found: Sequence[Difference], notes: list[str]
) -> ExactDifference:
    """Runs both again as far as their digests allow; `notes` gets what could not be done, and why."""
    period = min(one.period for one in found)
    first = _first_period(made, period)
    worlds = None
    try:
        with plain_parameters(made[0].path):
            worlds = _repeating(made, first, notes)
    except BadInput as error:
        notes.append(f"they cannot be run again: {error}")
    if worlds is None:
        return ExactDifference(period)
    one, other, scripted = worlds
    state = first_difference(one, other, (max(first, period) + 1) * CONTROL_PERIOD_TICKS)
    if state is None:
        notes.append(
            f"run again, their states do not differ up to the end of control period {period}: what made the difference"
            " is in neither recording (another version of this program, or values that were changed)"
        )
        return ExactDifference(period)
    return ExactDifference(period, state, _firmwares(made, annotated, _seen_tick(found), scripted))


def _first_period(made: Both, period: int) -> int:
    """Where the states differ first, by the digests; else the one before what was seen when `period` began."""
    one, other = made
    if one.source.state == other.source.state:
        for here, there in zip(one.recording.periods, other.recording.periods, strict=False):
            if here.digest != there.digest:
                return here.index
    return max(0, period - 1)


def _repeating(made: Both, period: int, notes: list[str]) -> tuple[World, World, bool] | None:
    never = set(WORDS)
    for scripted in (False, True):
        one, other = (repeating(each.recording, each.path, period, scripted) for each in made)
        if one is not None and other is not None:
            return one, other, scripted
        never -= {word for word, world in zip(WORDS, (one, other), strict=True) if world is not None}
    whose = f"{never.pop()} does" if len(never) == 1 else "they do"
    notes.append(
        f"no tick within the control period: run again, {whose} not give the recorded digests up to there (another"
        " version of this program recorded, or input was put in beside a controller)"
    )
    return None


def _seen_tick(found: Sequence[Difference]) -> int:
    """When something differs that is more than a digest: dead bytes of a stack are enough for that."""
    return next((one.tick for one in found if one.channel != DIGEST), found[0].tick)


def _firmwares(
    made: Both, annotated: Sequence[AnnotatedImage], tick: int, scripted: bool
) -> FirmwareDifference | None:
    """Where the firmwares go apart, in runs that differ in nothing else."""
    alike = made[0].scenario == made[1].scenario and made[0].source.seed == made[1].source.seed
    if not alike or len(annotated) < 2 or annotated[0].image.code == annotated[1].image.code:
        return None

    def make(image: Image) -> World:
        return world_of(made[0].recording, made[0].path, image, scripted)

    return first_instruction(make, annotated[0], annotated[1], tick + LOOK_TICKS)


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
    bits = compare.kind == "bits"
    digests = bits and made[0].source.state == made[1].source.state  # they are of states of one form
    if bits and not digests:
        why = "their states have another form, by scenario or version of this program"
        notes.append(f"the digests are not compared: {why}")
    rule = msgspec.structs.replace(compare.rule, host=bits, digests=digests)
    for path, recording in ((a, one), (b, other)):
        compare.check_reaches(path, recording.periods)
    found = differences(one.periods, other.periods, rule)
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
        print_json(
            {
                "a": a,
                "b": b,
                "sources": [one.as_json() for one in origins],
                "periods": {"a": len(one.periods), "b": len(other.periods)},
                **compare.rule_as_json(),
                **differences_as_json(found, options.everything, ("a", "b")),
                **exact.as_json(),
                "notes": notes,
                "exit_code": code,
            }
        )
    return code


def _made(path: str) -> Made:
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
    warn_of_plugins(path, recording.source)
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


def _print_sources(sources: Sequence[SourceDifference]) -> None:
    if not sources:
        return
    table = plain_table("made from", *WORDS)
    for one in sources:
        table.add_row(one.key, one.a, one.b)
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
        code = exit_code("differs")
        complain(f"the recordings differ in control period {exact.period}, {found[0].said(WORDS)}")
        if exact.state is not None:
            complain(f"their states differ from {exact.state} on")
        if exact.instruction is not None:
            print_firmwares(exact.instruction, WORDS)
    shorter, longer = sorted(periods, key=len)
    if len(shorter) != len(longer) and compare.rule.to_tick is None:
        code = exit_code("differs")
        complain(f"A has {amount(len(periods[0]), 'control period')}, B has {len(periods[1])}")
    for note in notes:
        complain(note)
    if code == DONE and not compare.as_json:
        how = "" if compare.rule.kind == "bits" else f" ({compare.described()})"
        whence = "; they were not made from the same" if sources else ""
        count = amount(compare.rule.compared(shorter), "control period")
        show(f"the recordings hold the same in all {count}{how}{whence}")
    return code
