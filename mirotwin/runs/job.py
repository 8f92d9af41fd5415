"""Loads a file whose content is sent again: a recording with its sources, or a text stream."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec.structs import replace

from miro_exact.bad_input import BadInput, one_line, shortened
from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND, seconds
from miro_exact.inputs import RECORDING_BYTES, check_no_folder, read_input
from miro_exact.installed import differences as plugin_differences
from miro_protocol import stream
from miro_protocol.actions import Fault, Power, Put, Reset, ScriptItem
from miro_protocol.stream_header import Header
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.image import FLASH_BYTES, SPACE_BYTES, Image, Symbol, Symbols, parse_hex
from miro_sim.periods import Period
from miro_sim.radio.params import Radio
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import AnyText, any_of_text, board_of_tables
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import builtin_names, changed, load, of_table
from miro_sim.scenario.keys import MAX_NETWORKS, NetworkSpec, Scenario
from miro_sim.scenario.plugins import REGISTRIES
from miro_sim.scenario.settings import EXPECT, blamed, in_text, make
from miro_sim.world.machine import no_network
from mirotwin.recording.capture.detect import detect
from mirotwin.recording.capture.heads import frame_counts
from mirotwin.recording.capture.input import HEAD_BYTES, Input
from mirotwin.recording.capture.options import AS_IT_SAYS, CaptureOptions
from mirotwin.recording.capture.source import form_of, timed_capture
from mirotwin.recording.reader import Recording, parse
from mirotwin.recording.recorder import SCENARIO_ATTACHMENT, RunSource
from mirotwin.recording.writer import MAGIC
from mirotwin.runs.board_case import (
    board_of_stream,
    board_spec,
    check_board_script,
    check_crystal,
    end_of_board,
    is_for_board,
    tables_of_stream,
)
from mirotwin.runs.result import Result, expectation_lines, result_of_case
from mirotwin.runs.run import Run, replaying
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.command import shell_line
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import plain_parameters
from mirotwin.shell.outputs import RECORDING
from mirotwin.shell.verdicts import judge
from mirotwin.verify.cases.artifacts import image_beside
from mirotwin.verify.checks.expect import expectations_in, expectations_of

if TYPE_CHECKING:
    from miro_sim.world.world import World  # a hot module: not before the engine was chosen

DEFAULT_SCENARIO = "fig6"
OF_STREAM = "What was sent, over an ideal link to robots that stand"
AFTERMATH_TICKS = TICKS_PER_SECOND
LONGEST_TICKS = 86_400 * TICKS_PER_SECOND


def script_of(periods: Iterable[Period]) -> list[ScriptItem]:
    """Everything that the hosts of a recording sent, and the actions on robots and radios."""
    items: list[ScriptItem] = []
    for period in periods:
        items += [*period.wire, *period.actions]
    return script_of_stream(sorted(items, key=lambda item: item.tick))


def script_of_stream(lines: Iterable[ScriptItem]) -> list[ScriptItem]:
    """Everything that is sent or done to robots."""
    return [item for item in lines if not isinstance(item, Transmission) or item.direction == DOWN]


def sent_in(script: Iterable[ScriptItem]) -> list[Transmission]:
    """The hosts' transmissions only."""
    return [item for item in script if isinstance(item, Transmission) and item.direction == DOWN]


def check_script(script: Sequence[ScriptItem], scenario: Scenario | None = None) -> None:
    """Raises BadInput for overlapping transmissions in a network, and for a network or robot that does not exist.
    Without a scenario all possible robots and networks are allowed.
    """
    networks = MAX_NETWORKS if scenario is None else len(scenario.networks)
    before: dict[int, Transmission] = {}
    for item in script:
        if item.network >= networks:
            raise BadInput("", f"tick {item.tick}", no_network(item.network, networks))
        if isinstance(item, Transmission):
            last = before.get(item.network)
            if last is not None and item.tick < last.end_tick:
                reason = (
                    f"starts before the transmission of tick {last.tick} has ended (tick {last.end_tick})"
                )
                raise BadInput("", f"tick {item.tick}", reason, "move it back")
            before[item.network] = item
        elif isinstance(item, Put):
            reason = f"{item.path} is of a part or a pin of a board, and robots have none"
            raise BadInput("", f"tick {item.tick}", reason, "leave it out")
        elif isinstance(item, Reset | Power | Fault) and scenario is not None:
            slots = [robot.slot for robot in scenario.networks[item.network].robot]
            if item.slot not in slots:
                there = f"there is {', '.join(map(str, slots))}"
                raise BadInput("", f"tick {item.tick}", f"no robot in slot {item.slot}; {there}")


def robots_of_stream(sent: Iterable[ScriptItem]) -> int:
    """3 or 5: the layout in which more of the frames from hosts can be read."""
    counts = frame_counts(sent_in(sent))
    return 5 if counts[5] > counts[3] else 3


def scenario_of_stream(sent: Sequence[ScriptItem], header: Header | None = None) -> Scenario:
    """The scenario that the header names or contains; without one the default scenario with an ideal link.

    Raises BadInput for a stream without transmissions, for overlapping ones, for more than a day, and for ones outside
    of the header's scenario; ScenarioError for an error in that scenario.
    """
    script = script_of_stream(sent)
    if header is None or header.scenario is None:
        if not script:
            raise BadInput("", "", "no line from host to robot", "nothing can be replayed")
        check_script(script)
        return _default_scenario(script)
    scenario = _scenario_of_header(header.scenario)
    check_script(script, scenario)
    end_tick = scenario.end_tick
    for item in script:
        # What was recorded may still be on the air when its run ends.
        last_tick = item.end_tick if isinstance(item, Transmission) and header.end_tick is None else item.tick
        if last_tick > end_tick:
            reason = f"ends at tick {last_tick}, but the scenario ends at tick {end_tick}"
            raise BadInput("", f"tick {item.tick}", reason, "raise its duration_s")
    return scenario


def _scenario_of_header(scenario: str | dict[str, object]) -> Scenario:
    place = "header: scenario"
    if not isinstance(scenario, str):
        return of_table(scenario, place)
    if scenario not in builtin_names():
        remedy = f"give one of {', '.join(builtin_names())}, or a whole scenario as a table"
        raise ScenarioError(place, "", f"{scenario[:40]!r} is no built-in scenario", remedy)
    return load(scenario, ["expect={}"]).scenario  # which its own controller is to fulfil


def _default_scenario(script: Sequence[ScriptItem]) -> Scenario:
    """The default one with ideal links, and its robot in every slot of each network's layout, all at one start.

    Runs for a second longer than the stream, so that the failsafe shows.
    """
    ends = [item.end_tick if isinstance(item, Transmission) else item.tick for item in script]
    end_tick = max(ends) + AFTERMATH_TICKS
    if end_tick > LONGEST_TICKS:
        last = max(item.tick for item in script)
        remedy = (
            "cut the capture, or let the stream start near tick 0 (`mirotwin export` makes one of a capture)"
        )
        raise BadInput("", f"tick {last}", "more than a day", remedy)
    count = 1 + max(item.network for item in script)
    settings = ["camera={kind = 'gaussian'}", "expect={}"]  # nothing steers by it or is expected
    base = load(DEFAULT_SCENARIO, settings).scenario
    model = base.networks[0].robot[0]
    assert isinstance(model.reference, msgspec.Struct)  # parameters of a line
    standing = replace(model.reference, drive_s=0.0)  # nothing steers by it
    model = replace(model, wheel_radius_mismatch=0.0, reference=standing)
    networks = []
    for index in range(count):
        robots = robots_of_stream(item for item in script if item.network == index)
        network = NetworkSpec(
            robots=5 if robots == 5 else 3,
            host="silent",
            radio=Radio(bit_error_rate=0.0, carrier="on", squelch=True),
            robot=tuple(replace(model, slot=slot) for slot in range(robots)),
        )
        networks.append(network)
    periods = -(-end_tick // CONTROL_PERIOD_TICKS)
    duration_s = seconds(periods * CONTROL_PERIOD_TICKS)
    return replace(base, name="stream", title=OF_STREAM, duration_s=duration_s, networks=tuple(networks))


def image_of(recording: Recording, path: str | Path) -> Image:
    """The image in the recording, with the symbols saved with it. Raises BadInput for an invalid image."""
    source = recording.source
    image = parse_hex(source.firmware, Path(path) / "firmware.ihx")
    symbols = Symbols({name: Symbol(address, space) for name, (address, space) in source.symbols.items()})
    return replace(image, symbols=symbols)


class Case(msgspec.Struct, frozen=True):
    """The verdict in a case: the check's line, and the tick at which its run ended (0: the end of its scenario).

    `changed`: it will run with other firmware or settings.
    """

    verdict: str = ""
    end_tick: int = 0
    changed: bool = False


class Job(msgspec.Struct, frozen=True, kw_only=True):
    """A file to replay: a recording, or a text stream (then `recorded` is empty and `image` None).

    `spec`: the run, with the image to use. `image`: the recorded one, None if it is no valid image. `state`: the form
    of the states whose digests were recorded, if a replay computes the same states, else empty: a controller's states
    are not computed again. `source`: the sources of the recording. `notes`: remarks on the file, a line each.
    `captured_as`: the form of a capture by another tool, else empty. `as_recorded`: a recording's run without other
    settings, seed or firmware.
    """

    spec: RunSpec
    recorded: Sequence[Period] = ()
    image: Image | None = None
    state: str = ""
    case: Case = Case()
    source: RunSource | None = None
    notes: Sequence[str] = ()
    captured_as: str = ""
    as_recorded: RunSpec | None = None

    @property
    def origin(self) -> str:
        """ "port" where the answers that were recorded are those of real robots."""
        return self.source.origin if self.source is not None else ""

    @property
    def end_tick(self) -> int:
        """End of the replay: of the recording, of the case's failure, or of the scenario."""
        scenario = self.spec.scenario
        if not self.recorded:
            return self.case.end_tick or scenario.end_tick
        return min(self.recorded[-1].index + 1, scenario.periods) * scenario.period_ticks

    @property
    def alone(self) -> bool:
        """True if it is of a board alone."""
        return isinstance(self.spec.scenario, BoardScenario)

    def check_case(self) -> None:
        """Raises BadInput where the scenario does not expect the check that the case is about."""
        name = self.case.verdict.partition(":")[0]
        if not any(check.name == name for checks in (self.spec.expected or {}).values() for check in checks):
            reason = f"the verdict is of the check {name!r}, which nothing expects"
            raise BadInput(
                self.spec.origin, "header", reason, "put it into [expect], or take the verdict away"
            )

    def result_of_case(self, run: Run) -> Result:
        """The verdict of the case's checks in this run; of all checks if the case has no verdict."""
        checks, result = run.checks, run.result()
        named = [each.verdict for each in checks.verdicts() if each.name in checks.named]
        verdict = judge(named) if self.case.verdict else checks.verdict()
        why = [line for verdict, line in expectation_lines(checks) if verdict != "failed"]
        outcome = result_of_case(self.case.verdict, checks.failures, self.case.changed, verdict, why)
        return replace(
            result, verdict=outcome.verdict, verdict_lines=outcome.verdict_lines, failures=outcome.failures
        )

    def judge_case(self, progress: Callable[[int], object] = lambda tick: None) -> Result:
        """Runs a case, or a stream without expectations, to its verdict. Raises BadInput."""
        if self.case.verdict:
            self.check_case()
        return self.result_of_case(self.run(self.case.end_tick or None, progress))

    def run(
        self,
        until_tick: int | None = None,
        progress: Callable[[int], object] = lambda tick: None,
        cut: bool = False,
        watch: Callable[[World], object] = lambda world: None,
    ) -> Run:
        """Replays up to `until_tick` (None: the end). `cut`: as in RunSpec. `watch` gets the world before it runs.
        Raises BadInput.
        """
        spec = replace(self.spec, until_tick=until_tick, cut=cut)
        with plain_parameters(spec.origin, "replayed"):
            run = Run.traced(spec)
        watch(run.world)
        with replaying(spec.origin, run.world):
            return run.play(progress)


def load_job(
    file: str,
    firmware: str | None = None,
    settings: Sequence[str] = (),
    seed: int | None = None,
    stack_from: int | None = None,
    capture: CaptureOptions = AS_IT_SAYS,
) -> Job:
    """Reads `file` and loads the requested image, the recorded one, or the robot's own.

    `settings`: keys to set in the recorded scenario, or in the default one. `seed`: replaces the recorded one.
    `stack_from`: first address of the stack of `firmware`. `capture`: options for a capture of another tool.
    """
    check_no_folder(file, RECORDING)
    data = read_input(file, prefix=MAGIC, prefix_limit=RECORDING_BYTES)
    if MAGIC.startswith(data[: len(MAGIC)]):
        recording = parse(data, file)
        if not recording.periods:
            raise BadInput(file, "", "the recording holds no control period", "nothing can be replayed")
        limit = SPACE_BYTES if recording.source.board else FLASH_BYTES
        runs_on = None if firmware is None else load_firmware(firmware, limit, stack_from=stack_from)
        return _job_of_recording(recording, file, settings, runs_on, seed)
    given, notes, captured_as = _stream(data, file, capture)
    header = given.header
    image = _image_for(given, firmware or image_beside(file, header.firmware_sha256), stack_from)
    wanted = header.firmware_sha256
    if wanted not in (None, image.sha256):
        reason = f"the stream is for firmware {wanted[:12]}.., this is {image.sha256[:12]}.. ({image.path})"
        if firmware is None:
            raise BadInput(file, "header", reason, "name the image with --firmware")
        notes.append(f"{file}: {reason}")  # to run another one is what a replay is for
    job = _job_of_stream(given, file, settings, image, seed)
    return replace(job, notes=notes, captured_as=captured_as)


def _image_for(given: stream.StreamFile, firmware: str | Path | None, stack_from: int | None = None) -> Image:
    """The image that a stream runs on: `firmware`, or the robot's own. Raises BadInput for a board that has none."""
    if not is_for_board(given.header):
        return load_firmware(firmware, stack_from=stack_from)
    if firmware is None:
        kind = "bare processor" if given.header.bare is not None else "board"
        reason = f"is for a {kind}, which has no firmware of its own"
        raise BadInput(given.source, "", reason, "give --firmware IMAGE.ihx")
    return load_firmware(firmware, SPACE_BYTES, stack_from=stack_from)


def recorded_spec(recording: Recording, path: str, image: Image | None = None) -> RunSpec:
    """The run that sends the recorded hosts' transmissions again, on `image` (None: the recorded one).

    Raises BadInput.
    """
    source = recording.source
    _check_brought(source.plugins, path)
    with BadInput.at(f"{path}: {SCENARIO_ATTACHMENT}"):
        scenario = _with_bits(any_of_text(source.scenario_text, "").scenario, source)
    return RunSpec(
        scenario=scenario,
        image=image or image_of(recording, path),
        seed=source.seed,
        script=script_of(recording.periods),
        resumed=source.resumed,
        origin=path,
    )


_BROUGHT = re.compile(r"(\w+) (.+?): (.+\.py:\w+), sources \w+", re.DOTALL)
"""A plug-in that the command line brought in a file, as a recording names it."""


def _check_brought(recorded: Iterable[str], path: str) -> None:
    """Raises BadInput for a plug-in that the command line brought to the run, and not to this one."""
    registries = {registry.word: registry for registry in REGISTRIES.values()}
    for kind, name, file in (match.groups() for text in recorded if (match := _BROUGHT.fullmatch(text))):
        if kind in registries and name not in registries[kind].names():
            reason = f"its run used the {kind} {name!r} of a file, which is not here by itself"
            raise BadInput(path, "", reason, f"give --{kind} {shell_line(file)}, the same file")


def _with_bits(scenario: Scenario | BoardScenario, source: RunSource) -> Scenario | BoardScenario:
    """The scenario of a board with the bit length of its host, which is known after the host's first character.

    A saved world contains its own, and continues in the scenario that it was saved in.
    """
    if isinstance(scenario, BoardScenario) and source.bit_ticks and not source.resumed:
        return replace(scenario, bit_ticks=source.bit_ticks)
    return scenario


def recording_notes(recording: Recording, path: str) -> list[str]:
    """Notes on an interrupted recording, and on plug-ins of its run that differ from the installed ones, a
    line each.
    """
    notes = [
        f"{path}: {one_line(shortened(text))}: run again, it may do something else"
        for text in plugin_differences(recording.source.plugins)
    ]
    if recording.broken_off:
        notes.insert(0, f"{recording.broken_off}; it goes to control period {len(recording.periods) - 1}")
    return notes


def load_stream(file: str, firmware: str | None) -> Job:
    """The job of a stream file on this firmware (None: the robot's own), whatever firmware it is for."""
    check_no_folder(file, RECORDING)
    given, _, _ = _stream(read_input(file), file, AS_IT_SAYS)
    return _job_of_stream(given, file, (), _image_for(given, firmware), None)


def _stream(data: bytes, path: str, capture: CaptureOptions) -> tuple[stream.StreamFile, list[str], str]:
    """The stream file with this content, or made from a capture's characters; notes, and the form of the capture ("": a
    stream file). Raises BadInput.
    """
    if path.endswith(".toml") and detect(data[:HEAD_BYTES]).form != "stream":
        reason = "is no run, but what one is made from"
        raise BadInput(path, "", reason, "run it with `mirotwin run`, and give the run.mcap that it writes")
    if not data:
        raise BadInput(path, "offset 0", "empty file", "give a run.mcap, a stream file or a capture")
    notes: list[str] = []
    given = Input.of(data, path)
    form = form_of(given, capture, notes.append)
    if form.name == "stream":
        return stream.decode(data, path), notes, ""
    source = timed_capture(given, notes.append, capture, form)
    sent = sorted(source.sent, key=lambda transmission: transmission.tick)
    return stream.StreamFile(tuple(map(stream.Entry, sent)), source=path), notes, form.title


def _job_of_recording(
    recording: Recording, path: str, settings: Sequence[str], runs_on: Image | None, seed: int | None
) -> Job:
    """`runs_on` None: the recorded image."""
    source = recording.source
    image: Image | None = None
    try:
        image = image_of(recording, path)
    except BadInput:
        if runs_on is None:
            raise
    as_recorded = recorded_spec(recording, path, image or runs_on)
    with BadInput.at(f"{path}: {SCENARIO_ATTACHMENT}"):
        text = any_of_text(source.scenario_text, "", settings)
        scenario, expected = _with_bits(text.scenario, source), expectations_in(text)
    if isinstance(scenario, BoardScenario):
        check_crystal(scenario, source.crystal_hz, path)
        check_board_script(as_recorded.script or (), path, scenario)
        silent = True
    else:
        with BadInput.at(path):
            check_script(as_recorded.script or (), scenario)
        silent = all(network.host == "silent" for network in scenario.networks)
    as_it_was = image is not None and not settings and seed in (None, source.seed)
    spec = replace(
        as_recorded,
        scenario=scenario,
        image=runs_on or as_recorded.image,
        seed=source.seed if seed is None else seed,
        expected=expected,
    )
    return Job(
        spec=spec,
        recorded=recording.periods,
        image=image,
        state=source.state if as_it_was and silent else "",
        source=source,
        notes=recording_notes(recording, path),
        as_recorded=as_recorded,
    )


def _job_of_stream(
    given: stream.StreamFile, path: str, settings: Sequence[str], image: Image, seed: int | None
) -> Job:
    if given.header.bare is not None:
        return _job_of_bare(given, path, settings, image, seed)
    if is_for_board(given.header):
        return _job_of_board(given, path, settings, image, seed)
    header, sent = given.header, given.script()
    keys = [*in_text(header.set or {}), *in_text({"expect": header.expect or {}})]
    script = script_of_stream(sent)
    with BadInput.at(path):
        written = scenario_of_stream(sent, header)
        if header.scenario is None:
            written = replace(written, name=name_of(path))
        text = changed(written, "", [*keys, *settings])
        scenario, expected = text.scenario, expectations_in(text)
        check_script(script, scenario)
        as_written = text
        if settings:
            as_written = changed(written, "", keys)
            expectations_in(as_written)
    spec = RunSpec(scenario=scenario, image=image, script=script, expected=expected, origin=path)
    return _job_of_spec(spec, header, seed, as_written)


def name_of(path: str) -> str:
    """The name of a scenario that is made for this file."""
    return re.sub(r"[^a-z0-9_-]+", "-", Path(path).stem.lower()).strip("_-")[:64] or "stream"


def _job_of_spec(spec: RunSpec, header: Header, seed: int | None, as_written: AnyText) -> Job:
    """The job with the seed; `changed` is set if it is not run as the file says."""
    own = header.seed or 0
    other = header.firmware_sha256 not in (None, spec.image.sha256) or seed not in (None, own)
    other = other or spec.scenario != as_written.scenario
    spec = replace(spec, seed=own if seed is None else seed)
    return Job(spec=spec, case=Case(header.verdict or "", header.end_tick or 0, other))


def _job_of_board(
    given: stream.StreamFile, path: str, settings: Sequence[str], image: Image, seed: int | None
) -> Job:
    """Of a board that the header names, or holds in its scenario."""
    header, script = given.header, script_of_stream(given.script())
    keys = [*in_text(header.set or {}), *in_text({"expect": header.expect or {}})]
    with BadInput.at(path):
        tables = tables_of_stream(given, script)
        text, as_written = (board_of_tables(tables, "", more, path) for more in ((*keys, *settings), keys))
        expected = expectations_in(text)
    scenario = text.scenario
    check_crystal(scenario, header.crystal_hz or TICKS_PER_SECOND, path)
    check_board_script(script, path, scenario)
    spec = RunSpec(scenario=scenario, image=image, script=script, expected=expected, origin=path)
    return _job_of_spec(spec, header, seed, as_written)


def _job_of_bare(
    given: stream.StreamFile, path: str, settings: Sequence[str], image: Image, seed: int | None
) -> Job:
    header, script = given.header, script_of_stream(given.script())
    own: dict[str, Any] = {"expect": dict(header.expect or {})}
    tables = copy.deepcopy(own)
    made = make(tables, settings, path)
    for setting in made:
        if not setting.text.startswith(EXPECT):
            raise BadInput(path, setting.place, "is not for a case of a bare processor", "leave it out")
    if seed is not None:
        raise BadInput(path, "--seed", "is not for a case of a bare processor", "leave it out")
    scenario = board_of_stream(given)
    check_board_script(script, path, scenario)
    end_tick = header.end_tick or end_of_board(script, scenario)
    spec = board_spec(image, scenario, script, tables["expect"], end_tick, path)
    try:
        spec = replace(spec, expected=expectations_of(spec.scenario, path))
    except ScenarioError as error:
        raise blamed(error, made, tables) from None
    other = header.firmware_sha256 not in (None, image.sha256) or tables != own
    return Job(spec=spec, case=Case(header.verdict or "", end_tick, other))
