"""A run of a board for other programs: as a stream file that plays it again, and its changes as rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from io import BytesIO
from typing import Any

from msgspec.structs import replace

from miro_exact.bad_input import BadInput
from miro_protocol import stream
from miro_protocol.actions import ScriptItem
from miro_protocol.stream import StreamError
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import tables_of_board
from mirotwin.recording.capture.recorded import transmissions_of
from mirotwin.recording.container import RecordingError
from mirotwin.recording.messages import Messages
from mirotwin.report.tables import Named, timed
from mirotwin.runs.board_case import is_for_board
from mirotwin.runs.job import Job
from mirotwin.runs.run import Run, replaying
from mirotwin.shell.options import plain_parameters
from mirotwin.verify.cases.case import stream_text

HEAD_BYTES = 1 << 20
"""Bytes at the beginning of a file that show whether it is of a board."""


def is_of_board(head: bytes, format: str) -> bool:
    """True if a recording or a stream file with this beginning is of a board."""
    messages = Messages(BytesIO(head).read, "", ())
    reader = stream.Reader(head.decode("utf-8", "replace").split("\n"))
    with suppress(RecordingError, StreamError):
        next(iter(messages if format == "recording" else reader), None)
    return "board" in (messages.metadata or {}) or is_for_board(reader.header)


def board_stream(job: Job) -> str:
    """A stream with everything sent and put, the board's output, and the whole scenario: `mirotwin replay` repeats it.

    Raises BadInput for a run that continued a saved one.
    """
    spec, scenario = job.spec, job.spec.scenario
    assert isinstance(scenario, BoardScenario)
    if spec.resumed:
        reason = "went on from a saved world, which a stream file does not hold"
        raise BadInput(spec.origin, "", reason, "replay the recording")
    ends = replace(scenario, duration_ticks=scenario.duration_ticks or job.end_tick)
    more: dict[str, Any] = {"end_tick": job.end_tick, "crystal_hz": scenario.clock}
    if scenario.expect:
        more["expect"] = scenario.expect
    more["scenario"] = tables_of_board(ends)
    return stream_text(_script(job), spec.image, {"seed": spec.seed}, job.case.verdict, more)


def _script(job: Job) -> Sequence[ScriptItem]:
    """Characters of both directions and actions, in the order of time; for a stream file, its content."""
    done = (action for period in job.recorded for action in period.actions)
    return (
        sorted((*transmissions_of(job.recorded), *done), key=lambda item: item.tick) or job.spec.script or ()
    )


def board_rows(job: Job, progress: Callable[[int], object]) -> Iterator[Named]:
    """The first level or value of each net and part, then each change, in the order of time.

    The run is made for this.
    """
    from mirotwin.report.page.board_watch import BoardWatch  # a hot module: not before the engine was chosen

    spec = replace(job.spec, until_tick=job.end_tick)
    with plain_parameters(spec.origin, "replayed"):
        world = spec.world()
    watch = BoardWatch(world)
    with replaying(spec.origin, world):
        Run(spec, world).play(progress)
    for tick, *change in watch.changes(job.end_tick):
        yield "changes", timed(tick, world.clock) | dict(zip(("kind", "name", "value"), change, strict=True))
