"""What afl-fuzz writes about its own progress: `fuzzer_stats` and `plot_data`.

It writes into the file itself: a reader may meet a file that has no end yet, which counts as none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput


class Statistics(msgspec.Struct, frozen=True):
    """One job, as afl-fuzz says.

    Times in seconds, `stability_percent` is the share of edges that the same input executes each time.
    """

    executions: int
    executions_per_s: float
    edges: int
    crashes: int
    corpus_count: int
    stability_percent: float
    run_time_s: float


_LAST_KEY = "command_line"


def read_statistics(path: Path) -> Statistics | None:
    """The file at `path`; None where there is none, or not all of it yet. Raises BadInput for anything else."""
    text = _text(path)
    if f"\n{_LAST_KEY} " not in text or not text.endswith("\n"):
        return None
    values: dict[str, str] = {}
    for number, line in enumerate(text.splitlines(), 1):
        key, colon, value = line.partition(":")
        if not colon:
            raise BadInput(path, number, f"{line!r} is no `key : value`", _REMEDY)
        values.setdefault(key.strip(), value.strip())

    def take(key: str, kind: Callable[[str], float]) -> float:
        try:
            return kind(values[key].removesuffix("%"))
        except KeyError:
            raise BadInput(path, key, "is missing", _REMEDY) from None
        except ValueError:
            raise BadInput(path, key, f"{values[key]!r} is no number", _REMEDY) from None

    return Statistics(
        executions=int(take("execs_done", int)),
        executions_per_s=take("execs_per_sec", float),
        edges=int(take("edges_found", int)),
        crashes=int(take("saved_crashes", int)),
        corpus_count=int(take("corpus_count", int)),
        stability_percent=take("stability", float),
        run_time_s=take("run_time", float),
    )


_REMEDY = "it is written by afl-fuzz 4.04c; tried with no other version"

_COLUMNS = ("relative_time", "corpus_count", "saved_crashes", "execs_per_sec", "total_execs", "edges_found")
"""Columns of `plot_data` that are read; its first line names all. Newer versions have more."""


def read_plot(path: Path) -> list[Statistics]:
    """The rows at `path`, oldest first; a row that is not written to its end is left out. `stability_percent` is 100.

    Raises BadInput for anything else.
    """
    lines = _text(path).split("\n")[:-1]
    if not lines:
        return []
    names = lines[0].removeprefix("# ").split(", ")
    missing = [name for name in _COLUMNS if name not in names]
    if missing:
        raise BadInput(path, 1, f"has no column {missing[0]}", _REMEDY)
    return [_row(path, number, names, line.split(", ")) for number, line in enumerate(lines[1:], 2)]


def _row(path: Path, number: int, names: Sequence[str], cells: Sequence[str]) -> Statistics:
    if len(cells) != len(names):
        raise BadInput(path, number, f"{len(cells)} columns, not {len(names)}", _REMEDY)
    values = dict(zip(names, cells, strict=True))
    try:
        return Statistics(
            executions=int(values["total_execs"]),
            executions_per_s=float(values["execs_per_sec"]),
            edges=int(values["edges_found"]),
            crashes=int(values["saved_crashes"]),
            corpus_count=int(values["corpus_count"]),
            stability_percent=100.0,
            run_time_s=float(values["relative_time"]),
        )
    except ValueError as error:
        raise BadInput(path, number, f"{error}", _REMEDY) from None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return ""
