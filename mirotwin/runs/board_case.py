"""A single board in the header of a stream file: the empty board, its wire, and the stream that is played to it.

# mirotwin stream 2
#: firmware_sha256 = ".."
#: verdict = "no_fault: tick 368772 (33.346 ms): firmware executed outside the loaded image at 0x03c0, .."
#: end_tick = 368772
#:
#: [bare]
#: crystal_hz = 11059200
#: bit_ticks = 576
#: begin_tick = 9840
#:
#: [expect]
#: no_fault = true
11040 > c0 03 c0 ..
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CHARACTER_BITS
from miro_protocol.actions import Put, RadioState, ScriptItem
from miro_protocol.stream import StreamFile
from miro_protocol.stream_header import Header
from miro_protocol.toml_text import TomlError, struct_of
from miro_protocol.transmission import Transmission
from miro_robot.board_spec import CRYSTAL_HZ, BoardSpec
from miro_robot.image import Image
from miro_robot.parts.values import checked_put
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import BOARD, board_of_tables
from mirotwin.runs.spec import RunSpec

AHEAD_TICKS = 240
"""The firmware counts as started up so long before the first character at the latest."""
AFTER_MS = 50
"""A stream without an end tick ends this long after its last character: the firmware may still answer, or fail."""


class BoardHeader(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The table `[bare]`. `begin_tick`: the firmware has started up, and is judged from then on."""

    crystal_hz: int = CRYSTAL_HZ
    bit_ticks: int = 0
    begin_tick: int = 0


def board_of_stream(given: StreamFile) -> BoardScenario:
    """The board and its wire. Raises BadInput."""
    place = "header: bare"
    try:
        header = struct_of(given.header.bare or {}, BoardHeader)
        board = BoardSpec(crystal_hz=header.crystal_hz, bound_stack=False)
        scenario = BoardScenario(board=board, bit_ticks=header.bit_ticks, begin_tick=header.begin_tick)
    except TomlError as error:
        raise BadInput(given.source, f"{place}.{error.place}", error.what, error.remedy) from None
    except ValueError as error:
        raise BadInput(given.source, place, str(error)) from None
    if not scenario.bit_ticks:
        raise BadInput(given.source, place, "says no bit_ticks", "give the length of a bit")
    return scenario


def end_of_board(script: Sequence[ScriptItem], scenario: BoardScenario) -> int:
    """Last tick of a stream without an end tick."""
    ends = [item.tick + _duration(item, scenario) for item in script]
    return max(ends, default=scenario.begin_tick) + after_ticks(scenario)


def after_ticks(scenario: BoardScenario) -> int:
    return scenario.clock * AFTER_MS // 1000


def is_for_board(header: Header) -> bool:
    """True if a stream is for a board, False for robots."""
    return not (header.bare is None and header.board is None) or (
        isinstance(header.scenario, dict) and BOARD in header.scenario
    )


def tables_of_stream(given: StreamFile, script: Sequence[ScriptItem]) -> dict[str, Any]:
    """The tables of the scenario of a stream for a board; without a duration in the header it has that of the stream.

    Raises BadInput.
    """
    header = given.header
    if isinstance(header.scenario, dict):
        if header.board is not None:
            raise BadInput("", "header: board", "the scenario has a board, too", "leave one out")
        return header.scenario
    if header.scenario is not None:
        reason = f"{header.scenario!r} is a scenario of robots, and the stream is for a board"
        raise BadInput("", "header: scenario", reason, "leave it out, or give a whole scenario")
    table = {BOARD: header.board, "duration_s": 1.0}
    scenario = board_of_tables(table, "", beside=given.source).scenario
    return table | {"duration_s": (header.end_tick or end_of_board(script, scenario)) / scenario.clock}


def check_crystal(scenario: BoardScenario, crystal_hz: int, path: str) -> None:
    """Raises BadInput if the board's crystal is not the one whose ticks the file counts."""
    if scenario.clock != crystal_hz:
        reason = (
            f"its ticks are of a crystal of {crystal_hz} Hz, and the board has one of {scenario.clock} Hz"
        )
        raise BadInput(path, "crystal_hz", reason, f"give crystal_hz = {scenario.clock} if they are of that")


def check_board_script(script: Sequence[ScriptItem], path: str, scenario: BoardScenario) -> None:
    """Raises BadInput for characters that overlap, and for actions on other devices."""
    free_tick = 0
    for item in script:
        if item.network or getattr(item, "slot", 0):
            raise BadInput(path, f"tick {item.tick}", "is not for the board, which is alone on network 0")
        if isinstance(item, RadioState):
            raise BadInput(
                path, f"tick {item.tick}", "a board is on a wire, which has no radio", "leave it out"
            )
        if isinstance(item, Put):
            _check_put(item, path, scenario)
        if not isinstance(item, Transmission):
            continue
        if not scenario.host_bit_ticks:
            reason = "says no bit_ticks, and the board no baud"
            raise BadInput(
                path, "header", reason, "give the length of a bit in the scenario, or [serial] baud"
            )
        if item.tick < free_tick:
            reason = f"the characters at tick {item.tick} begin before those before them end"
            raise BadInput(path, "", reason, f"leave {free_tick - item.tick} ticks between them")
        free_tick = item.tick + _duration(item, scenario)


def _check_put(put: Put, path: str, scenario: BoardScenario) -> None:
    try:
        checked_put(scenario.parts, put.path, put.value)
    except ValueError as error:
        reason, _, remedy = f"{error}".partition("; ")
        raise BadInput(path, f"tick {put.tick}", reason, remedy) from None


def board_spec(
    image: Image,
    scenario: BoardScenario,
    script: Sequence[ScriptItem],
    expect: Mapping[str, Any],
    until_tick: int,
    origin: str = "",
) -> RunSpec:
    """The board of `scenario` from power-on to `until_tick`. `expect`: checks by name, as in `[expect]`."""
    begins = [max(0, item.tick - AHEAD_TICKS) for item in script]
    scenario = msgspec.structs.replace(
        scenario,
        begin_tick=min([scenario.begin_tick, *begins]),
        duration_ticks=until_tick,
        expect=dict(expect),
    )
    return RunSpec(scenario=scenario, image=image, script=script, until_tick=until_tick, origin=origin)


def _duration(item: ScriptItem, scenario: BoardScenario) -> int:
    return CHARACTER_BITS * scenario.host_bit_ticks * len(item.data) if isinstance(item, Transmission) else 0
