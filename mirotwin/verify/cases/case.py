"""A failure as one text file: the input of the world, the world itself, and the failed check.

# mirotwin stream 2
#: version = "0.1.0"
#: seed = 7
#: firmware_sha256 = ".."
#: verdict = "failsafe_stop_ms: net0/robot0: tick 4665120 (..): wanted .., found .."
#: end_tick = 6000000
#:
#: [expect]
#: failsafe_stop_ms = true
#:
#: [scenario]
#: ..
1440120 > 55 55 ..
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import tomli_w
from msgspec.structs import replace

from miro_exact.bad_input import encodable, one_line
from miro_exact.inputs import replace_file
from miro_protocol import stream, stream_header
from miro_protocol.actions import ScriptItem
from miro_protocol.transmission import DOWN
from miro_robot.board_spec import BoardSpec
from miro_robot.image import Image
from miro_sim.periods import Period
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import tables_of_board
from miro_sim.scenario.keys import Scenario, without_expectations
from miro_sim.world.world import World
from mirotwin.verify.checks.interface import Failure
from mirotwin.verify.checks.monitors import Checks


class Trace:
    """Records a world from tick 0 on. Raises ValueError for a world that has moved."""

    def __init__(self, world: World) -> None:
        if world.tick:
            raise ValueError(f"the world is at tick {world.tick}: what happened before is not known")
        self.world = world
        self._happened: list[ScriptItem] = []
        world.observers.append(self._look)

    def _look(self, period: Period) -> None:
        self._happened += [sent for sent in period.wire if sent.direction == DOWN]
        self._happened += period.actions

    def script(self) -> tuple[ScriptItem, ...]:
        """Transmissions of hosts that have been put on the air, and actions that were done, in the order of time."""
        items = list(self._happened)
        if self.world.in_period:
            for line in self.world.lines:
                items += [*line.sent, *line.actions.done]
        return tuple(sorted(items, key=lambda item: item.tick))

    def __repr__(self) -> str:
        return f"Trace({len(self._happened)} actions and transmissions up to tick {self.world.tick})"


SUFFIX = ".stream"
_WITH_HEADER = (b"# mirotwin stream 2", b"# mirotwin stream 3")


def case_text(
    world: World, trace: Trace, expect: Mapping[str, Any], verdict: str, end_tick: int | None = None
) -> str:
    """The case of `world` up to `end_tick`; default: the world's present tick.

    `expect`: the check that failed, as in `[expect]`; `verdict`: its message.
    """
    scenario = world.scenario
    end_tick = world.tick if end_tick is None else end_tick
    if isinstance(scenario, BoardScenario) and not _is_bare(scenario):
        said = {"end_tick": end_tick, **({"expect": dict(expect)} if expect else {})}
        board = replace(scenario, bit_ticks=world.bit_ticks)
        if board.duration_ticks is None:
            board = replace(board, duration_ticks=end_tick)
        said |= {"crystal_hz": scenario.clock, "scenario": tables_of_board(board)}
        return stream_text(trace.script(), world.image, {"seed": world.seed}, verdict, said)
    if isinstance(scenario, BoardScenario):
        expected = {"expect": dict(expect)} if expect else {}
        bare = {
            "crystal_hz": scenario.board.crystal_hz,
            "bit_ticks": scenario.bit_ticks,
            "begin_tick": scenario.begin_tick,
        }
        more = {"end_tick": end_tick, **expected, "bare": bare}
        return stream_text(trace.script(), world.image, {}, verdict, more)
    more = {"end_tick": end_tick, "expect": dict(expect), "scenario": tables_of(scenario)}
    return stream_text(trace.script(), world.image, {"seed": world.seed}, verdict, more)


def _is_bare(scenario: BoardScenario) -> bool:
    """True for a processor with external RAM and no parts."""
    board = scenario.board
    bare = BoardSpec(
        name=board.name,
        crystal_hz=board.crystal_hz,
        code_in_xram=board.code_in_xram,
        start=board.start,
        bound_stack=board.bound_stack,
    )
    return board == bare


def stream_text(
    script: Sequence[ScriptItem],
    image: Image,
    first: Mapping[str, Any],
    verdict: str,
    more: Mapping[str, Any],
) -> str:
    """A stream file with these keys in its header: `first`, facts about the image, the verdict, and `more`."""
    from importlib.metadata import version  # slow to import

    header: dict[str, Any] = {"version": version("mirotwin"), **first}
    if image.sha256:  # else it comes from no file
        header["firmware_sha256"] = image.sha256
    if verdict:
        header["verdict"] = one_line(verdict)
    text = tomli_w.dumps({**header, **more}).rstrip("\n")
    return stream.format_stream([stream.Entry(item) for item in script], stream_header.of_text(text))


def tables_of(scenario: Scenario) -> dict[str, Any]:
    """A scenario as TOML tables, without its expectations."""
    tables = _without_none(msgspec.to_builtins(without_expectations(scenario)))
    assert isinstance(tables, dict)
    return tables


def _without_none(value: Any) -> Any:
    """The value without None entries: TOML has no null, and a missing key means the same."""
    if isinstance(value, dict):
        return {
            key: _without_none(inner) for key, inner in value.items() if inner is not None and inner != {}
        }
    if isinstance(value, list | tuple):
        return [_without_none(inner) for inner in value]
    return value


def expect_of_failure(checks: Checks, failure: Failure) -> dict[str, Any]:
    """The check that failed as a table `[expect]`."""
    for monitor in checks.monitors:
        place = (monitor.subject.network, monitor.subject.slot)
        if monitor.check.name == failure.check and place == (failure.network, failure.slot):
            given = msgspec.to_builtins(monitor.check)
            given.pop("check")
            return {failure.check: _without_none(given) or True}
    raise ValueError(f"no check {failure.check!r} judges net{failure.network}/robot{failure.slot}")


def case_of_checks(world: World, trace: Trace, checks: Checks, end_tick: int | None = None) -> str:
    """The case of the first failure of `checks`; `end_tick` defaults to the world's present tick.

    Raises ValueError if nothing failed.
    """
    if not checks.failures:
        raise ValueError("no check has failed")
    first = checks.failures[0]
    return case_text(world, trace, expect_of_failure(checks, first), str(first), end_tick)


def write_case(path: str | os.PathLike[str], text: str) -> None:
    """Writes it whole or not at all."""
    replace_file(Path(path), encodable(text).encode())


def is_case(path: str | Path) -> bool:
    """True if a stream file contains an expectation. True also for an unreadable one: running it reports the error."""
    if not has_header(path):
        return False
    try:
        return stream.read(path).header.expect is not None
    except ValueError:
        return True


def has_header(path: str | Path) -> bool:
    """True if a file is a stream with a header, as a case has."""
    if not Path(path).is_file():
        return False
    with open(path, "rb") as file:
        return file.read(32).lstrip(b"\xef\xbb\xbf").startswith(_WITH_HEADER)
