"""What a file asks to be sent again: a recording with all that it was made from, or a text stream."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, ticks
from miro_exact.inputs import RECORDING_BYTES, check_no_folder, read_input
from miro_protocol import stream
from miro_protocol.actions import ScriptItem
from miro_protocol.transmission import Transmission
from miro_robot.image import Image
from miro_sim.periods import Period
from miro_sim.radio.downlink import TransmissionError
from miro_sim.scenario.file import changed
from miro_sim.scenario.file import parse as parse_scenario
from miro_sim.scenario.keys import Scenario
from miro_sim.scenario.settings import in_text
from mirotwin.recording.capture.detect import detect
from mirotwin.recording.capture.input import HEAD_BYTES
from mirotwin.recording.reader import Recording, parse
from mirotwin.recording.writer import MAGIC
from mirotwin.rerun.recorded import image_if_any, image_of
from mirotwin.rerun.script import (
    check_actions,
    check_script,
    scenario_of_stream,
    script_of,
    script_of_stream,
)
from mirotwin.shell.command import command_line, operand
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import choose_engine, plain_parameters
from mirotwin.shell.outputs import RECORDING
from mirotwin.shell.program import complain
from mirotwin.verify.cases.artifacts import image_beside
from mirotwin.verify.cases.rerun import Rerun, rerun
from mirotwin.verify.checks.expect import expectations_of

if TYPE_CHECKING:
    from miro_sim.world.world import World


class Case(msgspec.Struct, frozen=True):
    """What a case says of itself: the check's line, and where that run ended (0: with its scenario). `changed`: it is
    to run with other firmware or other settings.
    """

    verdict: str = ""
    end_tick: int = 0
    changed: bool = False


class Job(msgspec.Struct, frozen=True):
    """What is to be replayed: a recording, or a text stream (then `recorded` is empty and `image` None).

    `file` holds it; `runs_on`: the image to play it to. `image`: the one that was recorded, None where it is none.
    `state`: the form of the states whose digests were recorded, if a replay computes the same states, else empty: a
    controller's states are not computed again. `origin`: "port" where the answers that were recorded are those of real
    robots. `firmware`: the recorded file.
    """

    scenario: Scenario
    seed: int
    script: list[ScriptItem]
    recorded: Sequence[Period]
    file: str
    runs_on: Image
    image: Image | None = None
    state: str = ""
    case: Case = Case()
    resumed: bytes = b""
    origin: str = ""
    firmware: bytes = b""

    @property
    def periods(self) -> int:
        """Control periods of its scenario."""
        return max(1, -(-ticks(self.scenario.duration_s) // CONTROL_PERIOD_TICKS))

    def world_of(self, image: Image | None = None) -> World:
        """A world that is to do it again, on `image` if one is given; a resumed run begins where that one did."""
        from miro_sim.world.world import World  # a hot module: not before the engine was chosen

        run = image or self.runs_on
        if not self.resumed:
            return World(self.scenario, self.seed, run, script=self.script)
        world = World(self.scenario, self.seed, run, script=())
        try:
            world.load(self.resumed)
        except ValueError as error:
            what = f"the recorded run was resumed, and what it went on from fits nothing else: {error}"
            raise BadInput("", "replay", what, "replay it without --firmware, --set and --seed") from None
        for one in self.script:
            if isinstance(one, Transmission):
                world.inject(one.data, one.network, one.tick, one.bad_stop)
            else:
                world.do(one)
        return world


def load_job(
    file: str,
    firmware: str | None,
    engine: str | None,
    settings: Sequence[str] = (),
    seed: int | None = None,
    stack_from: int | None = None,
) -> Job:
    """Reads `file` and loads the image that was asked for, recorded, or the robot's own.

    `settings`: keys to set in the recorded scenario, or in the default one. `seed`: instead of its own.
    `stack_from`: where the stack of `firmware` begins.
    """
    check_no_folder(file, RECORDING)
    data = read_input(file, prefix=MAGIC, prefix_limit=RECORDING_BYTES)
    choose_engine(engine)
    if MAGIC.startswith(data[: len(MAGIC)]):
        recording = parse(data, file)
        if recording.broken_off:
            complain(f"{recording.broken_off}; it goes to control period {len(recording.periods) - 1}")
        if not recording.periods:
            raise BadInput(file, "", "the recording holds no control period", "nothing can be replayed")
        image = image_of(recording, file) if firmware is None else image_if_any(recording, file)
        named = firmware is not None or image is None
        runs_on = load_firmware(firmware, stack_from=stack_from) if named else image
        assert runs_on is not None
        return _job_of_recording(recording, file, settings, image, runs_on, seed)
    _refuse_other_formats(data, file)
    given = stream.decode(data, file)
    header = given.header
    image = load_firmware(firmware or image_beside(file, header.firmware_sha256), stack_from=stack_from)
    _check_firmware(header, image, file, firmware)
    reseeded = seed not in (None, header.seed or 0)
    other = header.firmware_sha256 not in (None, image.sha256) or bool(settings) or reseeded
    case = Case(header.verdict or "", header.end_tick or 0, other)
    return _job_of_stream(given, file, settings, image, seed, case)


def load_stream(file: str, engine: str | None, firmware: str | None) -> Job:
    """The job of a stream file on this firmware (None: the robot's own), whatever firmware it is for."""
    check_no_folder(file, RECORDING)
    data = read_input(file)
    choose_engine(engine)
    _refuse_other_formats(data, file)
    given = stream.decode(data, file)
    case = Case(given.header.verdict or "", given.header.end_tick or 0)
    return _job_of_stream(given, file, (), load_firmware(firmware), None, case)


def rerun_job(
    job: Job, until_tick: int | None = None, progress: Callable[[int], object] = lambda tick: None
) -> Rerun:
    """Sends it again, under what its scenario expects; None: to the end of that. Raises BadInput."""
    with plain_parameters(job.file, "replayed"):
        world = job.world_of()
    with replaying(job.file, world):
        return rerun(world, until_tick, expectations_of(job.scenario, job.file), progress)


@contextmanager
def replaying(file: str, world: World) -> Iterator[None]:
    """Within it, what cannot be sent or computed is bad input of `file`."""
    try:
        with plain_parameters(file, "replayed"):
            yield
    except TransmissionError as error:
        raise BadInput(file, "", f"cannot be replayed beyond tick {world.tick}: {error}") from None


_PAIRS = re.compile(rb"^\s*[0-9a-fA-F]{2}", re.MULTILINE)
_BINARY = re.compile(rb"[\0-\x08\x0e-\x1f]")
_WRITE_TIMES = "of bytes alone make a stream file, whose lines are `TICK > HEX BYTES` (24 000 ticks are 1 ms)"


def _refuse_other_formats(data: bytes, path: str) -> None:
    format, _ = detect(data[:HEAD_BYTES])
    if format == "pcapng":
        line = command_line("export", operand(path), "--out", "NAME.stream")
        what = "a capture, which cannot be replayed"
        raise BadInput(path, "offset 0", what, f"make a stream file of it with `{line}`")
    if format == "hex" and _PAIRS.search(data):
        raise BadInput(path, "offset 0", "hex text without times, which cannot be replayed", _WRITE_TIMES)
    if format != "stream" and _BINARY.search(data[:4096]):
        what = "neither a recording nor a stream file (UTF-8 text)"
        raise BadInput(path, "offset 0", what, f"give a run.mcap that `mirotwin run` wrote; {_WRITE_TIMES}")


def _job_of_recording(
    recording: Recording,
    path: str,
    settings: Sequence[str],
    image: Image | None,
    runs_on: Image,
    seed: int | None,
) -> Job:
    source = recording.source
    scenario = parse_scenario(source.scenario_text, f"{path}: scenario.toml", settings, expectations_of)
    script = script_of(recording.periods)
    check_script(script, path, len(scenario.networks))
    check_actions(script, path, scenario)
    as_it_was = image is not None and not settings and seed in (None, source.seed)
    silent = all(network.host == "silent" for network in scenario.networks)
    state = source.state if as_it_was and silent else ""
    own = source.seed if seed is None else seed
    return Job(
        scenario,
        own,
        script,
        recording.periods,
        path,
        runs_on,
        image,
        state,
        resumed=source.resumed,
        origin=source.origin,
        firmware=source.firmware,
    )


def _job_of_stream(
    given: stream.StreamFile, path: str, settings: Sequence[str], image: Image, seed: int | None, case: Case
) -> Job:
    sent = given.script()
    header = [*in_text(given.header.set or {}), *in_text({"expect": given.header.expect or {}})]
    scenario = changed(
        scenario_of_stream(sent, path, given.header), path, [*header, *settings], expectations_of
    )
    check_actions(sent, path, scenario)
    own = given.header.seed or 0
    script = script_of_stream(sent)
    return Job(scenario, own if seed is None else seed, script, (), path, image, case=case)


def _check_firmware(header: stream.Header, image: Image, path: str, firmware: str | None) -> None:
    """An image that was named may be another one: that is what a replay is for."""
    wanted = header.firmware_sha256
    if wanted is None or wanted == image.sha256:
        return
    what = f"the stream is for firmware {wanted[:12]}.., this is {image.sha256[:12]}.. ({image.path})"
    if firmware is None:
        raise BadInput(path, "header", what, "name the image with --firmware")
    complain(f"{path}: {what}")
