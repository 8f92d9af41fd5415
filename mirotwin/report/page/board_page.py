"""The page of a board's run: its sections, and the data that its JavaScript moves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from operator import attrgetter
from typing import Any, NamedTuple

import tomli_w

from miro_exact.clock import CHARACTER_BITS
from miro_protocol.actions import Put
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import tables_of_board
from mirotwin.report.page.axes import ROBOT_COLOURS
from mirotwin.report.page.board_watch import Changed
from mirotwin.report.page.document import render
from mirotwin.report.page.link import LinkMark
from mirotwin.report.page.run_page import Material, shared
from mirotwin.shell.json_text import json_bytes

MOST_LANES = 32
"""Largest number of nets drawn: those with most edges, in the order of the board; ties with the last one are drawn,
too.
"""
MOST_ROWS = 400
"""Largest number of lines of serial text that are listed."""
LONGEST_ROW = 80
TOGETHER_MS, MARK_MS, STEP_MS = 20, 1, 1
"""Characters further apart are two lines; the width of a mark without a duration; a step of the slider."""
MOST_STEPS = 20_000


class SerialRow(NamedTuple):
    """Characters one way."""

    tick: int
    direction: str
    data: bytes

    @property
    def text(self) -> str:
        """With escapes."""
        return repr(self.data.decode("latin-1"))[1:-1]


def board_page(material: Material, first_tick: int, end_tick: int) -> bytes:
    """The page of these ticks. Raises BadInput where Bokeh is not installed."""
    from mirotwin.report.page.board_plots import Window, board_figures  # loads Bokeh

    scenario, again = material.job.spec.scenario, material.again
    assert isinstance(scenario, BoardScenario)
    assert again.watch is not None
    window = Window(first_tick, end_tick, scenario.clock)
    waves, values = again.watch.waves(first_tick, end_tick), again.watch.values(first_tick, end_tick)
    least = min(sorted(len(wave.ticks) for wave in waves)[-MOST_LANES:], default=0)
    pins = [wave for wave in waves if len(wave.ticks) >= least]
    displays = [
        changed for changed in values if changed.path.endswith(".text") and isinstance(changed.values[0], str)
    ]
    rows_of = tuple(f"{changed.path.removesuffix('text')}row" for changed in displays)
    beside = [
        changed for changed in values if changed not in displays and not changed.path.startswith(rows_of)
    ]
    moved = [changed for changed in values if changed.changes and (changed in beside or changed in displays)]
    curves = _together([changed for changed in moved if not _is_state(changed)], scenario)
    wire = [sent for period in material.periods for sent in period.wire if first_tick <= sent.tick < end_tick]
    by_path = {changed.path: changed for changed in values}
    cars: dict[str, Any] = {name: keys for name, keys in scenario.parts.items() if _is_car(keys)}
    marks = _marks(material, wire, scenario)
    marks = [mark for mark in marks if first_tick <= mark.end_tick and mark.start_tick < end_tick]
    ticks = [
        *(failure.tick for failure in again.result.failures),
        *(fault.tick for _, _, fault in again.faults),
    ]
    ticks = sorted({tick for tick in ticks if first_tick <= tick <= end_tick})
    figures = board_figures(
        window,
        marks,
        pins,
        curves,
        [mark for changed in moved if _is_state(changed) for mark in _state_marks(changed, end_tick)],
        ticks,
    )
    marks.sort(key=attrgetter("start_tick"))  # not before: lanes stand in the order of `_marks`
    rows = _rows(wire, scenario.clock, _character_ticks(scenario))
    step = max(scenario.clock * STEP_MS // 1000, window.span // MOST_STEPS)
    data = {
        "ticks_per_s": scenario.clock,
        "first": first_tick,
        "end": end_tick,
        "step": step,
        "failures": ticks,
        "marks": [(mark.start_tick, mark.lane, mark.kind, mark.text) for mark in marks],
        "values": {
            changed.path: (changed.ticks, [_plain(value) for value in changed.values]) for changed in values
        },
        "ways": {name: [f"{name}.{key}" for key in keys.PATH] for name, keys in cars.items()},
    }
    sections = {
        **shared(material, scenario.clock),
        "scenario_text": tomli_w.dumps(tables_of_board(scenario)),
        "last_index": -(-window.span // step),
        "span_s": f"{window.span / scenario.clock:.3f}",
        "sent_to_it": sum(len(row.data) for row in rows if row.direction == DOWN),
        "it_sent": sum(len(row.data) for row in rows if row.direction != DOWN),
        "rows": rows,
        "most_rows": MOST_ROWS,
        "waves": waves,
        "pins": [wave.name for wave in pins],
        "close": [wave.name for wave in pins if len(wave.drawn(window.span)[1])],
        "thinned": [changed.path for changed in values if len(changed.ticks) <= changed.changes],
        "curves": curves,
        "displays": displays,
        "beside": beside,
        "by_path": by_path,
        "cars": cars,
    }
    return render("board.html", figures, json_bytes(data), sections)


def _is_car(keys: Any) -> bool:
    """True if a part with these keys moves on a plane."""
    return all(hasattr(keys, key) for key in ("PATH", "walls", "lines", "picture", "cell_cm", "radius_cm"))


def _is_state(changed: Changed) -> bool:
    """True if it is drawn as bars: it is a text, if only at times, or on and off."""
    return any(isinstance(value, str) for value in changed.values) or all(
        type(value) is not float and value in (0, 1) for value in changed.values
    )


def _together(numbers: Sequence[Changed], scenario: BoardScenario) -> list[list[Changed]]:
    """Values of one key of parts of one kind in one figure, as long as there are colours."""
    groups: dict[tuple[str, str], list[Changed]] = {}
    for changed in numbers:
        kind = scenario.parts[changed.path.partition(".")[0]].name
        groups.setdefault((kind, changed.path.rpartition(".")[2]), []).append(changed)
    most = len(ROBOT_COLOURS)
    return [some[at : at + most] for some in groups.values() for at in range(0, len(some), most)]


def _rows(wire: Sequence[Transmission], clock: int, character_ticks: int) -> list[SerialRow]:
    """The characters of each direction, broken into lines at line ends, pauses, and characters of the other
    direction.
    """
    rows: list[SerialRow] = []
    end_tick = 0
    for sent in sorted(wire, key=lambda transmission: transmission.tick):
        for number in range(len(sent.data)):
            tick, character = sent.tick + number * character_ticks, sent.data[number : number + 1]
            near = tick - end_tick < clock * TOGETHER_MS // 1000
            end_tick = tick
            if near and rows and rows[-1].direction == sent.direction and _goes_on(rows[-1].data, character):
                rows[-1] = rows[-1]._replace(data=rows[-1].data + character)
            else:
                rows.append(SerialRow(tick, sent.direction, character))
    return rows


def _goes_on(line: bytes, character: bytes) -> bool:
    """True if a character belongs to the line before it."""
    ended = line.endswith(b"\n") or (line.endswith(b"\r") and character != b"\n")
    return not ended and len(line) < LONGEST_ROW


def _marks(material: Material, wire: Sequence[Transmission], scenario: BoardScenario) -> list[LinkMark]:
    """Steps, actions, characters and faults, each on its lane."""
    short = scenario.clock * MARK_MS // 1000
    marks = [
        LinkMark("steps", "damaged" if failed else ("fresh", "repeated")[number % 2], begin, end, text)
        for number, (begin, end, text, failed) in enumerate(material.again.steps)
    ]
    for action in (action for period in material.periods for action in period.actions):
        lane, text = ("put", action.text) if isinstance(action, Put) else ("done to it", f"{action}")
        marks.append(LinkMark(lane, "action", action.tick, action.tick + short, text))
    for sent in wire:
        lane, kind = ("sent to it", "sent") if sent.direction == DOWN else ("it sends", "answer")
        end, text = sent.tick + _character_ticks(scenario) * len(sent.data), SerialRow(0, "", sent.data).text
        marks.append(LinkMark(lane, kind, sent.tick, end, text))
    for _, _, fault in material.again.faults:
        marks.append(LinkMark("faults", "damaged", fault.tick, fault.tick + short, f"{fault}"))
    return marks


def _character_ticks(scenario: BoardScenario) -> int:
    return CHARACTER_BITS * (scenario.host_bit_ticks or scenario.clock // 9600)


def _state_marks(changed: Changed, end_tick: int) -> list[LinkMark]:
    """A bar for each text, equal ones of one colour, and for each time that something is on."""
    seen = list(dict.fromkeys(changed.values))
    return [
        LinkMark(
            changed.path, ROBOT_COLOURS[seen.index(value) % len(ROBOT_COLOURS)], begin, end, _short(value)
        )
        for (begin, end), value in zip(pairwise([*changed.ticks, end_tick]), changed.values, strict=True)
        if value
    ]


def _short(value: Any) -> str:
    """A text of several rows in one; a number among texts."""
    if not isinstance(value, str):
        return "on" if value == 1 else f"{value:g}"
    return " / ".join(row.strip() for row in value.split("\n") if row.strip())


def _plain(value: Any) -> Any:
    """A number that JSON does not have, as text."""
    return value if not isinstance(value, float) or math.isfinite(value) else f"{value}"
