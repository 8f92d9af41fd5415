"""The path of a reference in a CSV file that its scenario names: `reference = { file = "lap.csv" }`.

    t,x,y           seconds and centimetres: a path with a timetable, kind `timed`
    0.0,0,0
    0.5,5,0.2

    x,y,speed       centimetres, and m/s up to the next point: waypoints, kind `waypoints`; `speed` and `heading`
    0,0,0.2         (degrees) may be left out, or be empty in a row
    30,10,0.4

Separators are commas, semicolons or tabs; lines that begin with # are comments. The points stand in the scenario from
then on, so the file's content belongs to the run and to its recording.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from typing import Any

import msgspec

from miro_exact.bad_input import did_you_mean
from miro_exact.inputs import decode, path_beside, read_input
from miro_host.registries import REFERENCES
from miro_sim.scenario.errors import ScenarioError, value_error
from miro_sim.scenario.plugins import table_of
from miro_sim.scenario.variants import tables_in

Table = dict[str, Any]
FILE, POINTS, TIMED, WAYPOINTS = "file", "points", "timed", "waypoints"
FILE_BYTES = 1 << 20
COLUMNS = {
    "t_s": ("t", "time"),
    "x_cm": ("x",),
    "y_cm": ("y",),
    "heading_deg": ("heading",),
    "speed_m_s": ("speed",),
}
"""Key of a point to the shorter names that its column may have."""
_NAMES = {name: key for key, others in COLUMNS.items() for name in (key, *others)}
_HEADS = "write t,x,y (s, cm), or x,y with speed (m/s) and heading (degrees) or without"
_POINT = re.compile(r"points\[(\d+)\](\.?)")


def put_paths(raw: Table, origin: str, in_file: bool = True) -> bool:
    """Puts the points of files into the tables of a scenario; whether there were any.

    Tables that stand in no file may name none (`in_file`, and `origin` ""). Raises ScenarioError.
    """
    changed = False
    for index, network in enumerate(tables_in(raw, "network")):
        for place, robot in enumerate(tables_in(network, "robot")):
            reference = table_of(robot.get("reference"))
            if FILE in reference and reference.get("kind") in (None, *REFERENCES.own):
                key = f"network[{index}].robot[{place}].reference.{FILE}"
                if not (in_file and origin):
                    problem = "is read with a scenario's file only"
                    raise ScenarioError(origin, key, problem, f"write reference = {{ {FILE} = .. }} into one")
                robot["reference"] = _with_points(reference, origin, key)
                changed = True
    return changed


def _with_points(reference: Table, origin: str, key: str) -> Table:
    name = reference[FILE]
    if not isinstance(name, str) or not name:
        raise ScenarioError(origin, key, f"expected a path, got {name!r}", f'write {FILE} = "NAME.csv"')
    with ScenarioError.at(origin, key):
        path = path_beside(origin, name)
    try:
        data = read_input(path, FILE_BYTES)
    except FileNotFoundError:
        raise ScenarioError(
            origin, key, f"{path}: no such file", "give its path from the scenario's"
        ) from None
    except OSError as error:
        raise ScenarioError(origin, key, f"{path} cannot be read: {error.strerror}") from None
    kind, points, lines = _read(decode(data), path)
    table = {name: value for name, value in reference.items() if name not in (FILE, POINTS)}
    if reference.get("kind") not in (None, kind):  # a path instead of the line, arc, .. that was there
        table = {}
    table |= {"kind": kind, POINTS: points}
    _check(table, path, lines)
    return table


def _read(text: str, path: str) -> tuple[str, list[Any], list[int]]:
    """The kind of reference, its points, and the line of each. Raises ScenarioError."""
    numbered = enumerate(text.splitlines(), 1)
    lines = [(number, line) for number, line in numbered if line.strip() and line.lstrip()[0] != "#"]
    if not lines:
        raise ScenarioError(path, "", "holds no path", _HEADS)
    separator = next((mark for mark in ";\t" if mark in lines[0][1]), ",")
    rows = [
        [cell.strip() for cell in row] for row in csv.reader((line for _, line in lines), delimiter=separator)
    ]
    if len(rows) != len(lines):
        raise ScenarioError(
            path, f"line {lines[0][0]}", "a quotation mark is not closed", "write numbers without"
        )
    keys = _keys(rows[0], path, lines[0][0])
    points: list[Any] = []
    for (number, _), row in zip(lines[1:], rows[1:], strict=True):
        if len(row) != len(keys):
            problem = f"has {len(row)} values under {len(keys)} columns"
            raise ScenarioError(path, f"line {number}", problem, "one value for each column")
        point = {
            key: _value(cell, key, path, number)
            for key, cell in zip(keys, row, strict=True)
            if _given(key, cell)
        }
        points.append([point["t_s"], point["x_cm"], point["y_cm"]] if "t_s" in keys else point)
    return TIMED if "t_s" in keys else WAYPOINTS, points, [number for number, _ in lines[1:]]


def _keys(head: Sequence[str], path: str, number: int) -> list[str]:
    """The keys of the columns. Raises ScenarioError."""
    keys = []
    for name in head:
        if name.lower() not in _NAMES:
            raise ScenarioError(
                path, f"line {number}", f"{name!r} is no column", did_you_mean(name, _NAMES, _HEADS)
            )
        keys.append(_NAMES[name.lower()])
    timed = "t_s" in keys
    if len(set(keys)) < len(keys) or not {"x_cm", "y_cm"} <= set(keys) or (timed and len(keys) > 3):
        raise ScenarioError(path, f"line {number}", f"{', '.join(head)} are no columns of a path", _HEADS)
    return keys


def _given(key: str, cell: str) -> bool:
    return bool(cell) or key not in ("heading_deg", "speed_m_s")


def _value(cell: str, key: str, path: str, number: int) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ScenarioError(path, f"line {number}", f"{key}: {cell!r} is no number", "write it as 12.5")
    return value


def _check(table: Table, path: str, lines: Sequence[int]) -> None:
    """Raises ScenarioError for points that are no path, at their line; other mistakes are found with the scenario."""
    struct: Any = REFERENCES.find(table["kind"])
    try:
        msgspec.convert(table, struct)
    except msgspec.ValidationError as error:
        wrong = value_error(path, table, str(error))
        place, problem = (
            _POINT.sub(lambda match: f"line {lines[int(match[1])]}{': ' * bool(match[2])}", text)
            for text in (f"{wrong.place}", wrong.what)
        )
        if f"{wrong.place}".startswith(POINTS):
            raise ScenarioError(path, place, problem, wrong.remedy) from None
