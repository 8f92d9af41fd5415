"""Results of a campaign as Parquet files: written at the end in the order of the plan, and read again.

    noise.parquet            every run: the same bytes whichever processes or machines ran it, in whatever order
    noise.wall.parquet       `run`, `wall_s`: wall time of each simulation loop, not reproducible

pyarrow is loaded when a file is written or read; it comes with the extra `campaign`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from miro_exact.bad_input import BadInput, shortened
from miro_exact.inputs import check_regular
from mirotwin.campaign.columns import BOARD_FIGURES, CHECK, FIGURES, OWN, TEXTS
from mirotwin.campaign.design import Level, kind_of
from mirotwin.campaign.journal import in_order, outcomes
from mirotwin.campaign.plan import OWN_IMAGE, Head, Plan
from mirotwin.campaign.worker import RunOutcome
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.outputs import OutputError, whole_file

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq

GIVE = "give the .parquet file of a campaign"
MOST_ROWS, MOST_COLUMNS, MOST_MIB, META_BYTES = 5_000_000, 2000, 2 << 10, 64 << 20
EACH_ROW = {"run": ("int64",), "seed": ("int64",), "verdict": ("string",)}
"""Columns that no row may lack, with their types."""
OWN_COLUMNS = frozenset((*OWN, *FIGURES, *BOARD_FIGURES))
ROWS = 10_000
"""Rows of a row group: the rows in memory while a file is written."""
META = b"mirotwin_campaign"
OPTION = "--out"


class ResultsInfo(msgspec.Struct, frozen=True):
    """The head of a results file. `factors`: columns of the design, `drawn`: columns of its random part.

    What makes a row again, by names without folders: `scenario`, `firmware`, `settings` of all runs, and the `levels`
    of each factor. Files of earlier versions do not have it.
    """

    head: Head
    campaign: str
    factors: tuple[str, ...]
    drawn: tuple[str, ...]
    checks: tuple[str, ...]
    scenario: str = ""
    firmware: str = ""
    settings: tuple[str, ...] = ()
    levels: tuple[tuple[Level, ...], ...] = ()


def require_arrow() -> None:
    """Raises BadInput where pyarrow is not installed; does not load it."""
    if find_spec("pyarrow") is None:
        raise BadInput("", "pyarrow", "is not installed", "pip install 'mirotwin[campaign]'")


def wall_path(results: Path) -> Path:
    return results.with_suffix(".wall.parquet")


def about(plan: Plan) -> ResultsInfo:
    design = plan.design
    return ResultsInfo(
        plan.head,
        Path(plan.path).stem,
        tuple(factor.name for factor in design.factors),
        tuple(draw.name for draw in design.draws),
        plan.checks,
        _name(plan.scenario),
        _name(plan.firmware),
        tuple(setting for setting, _ in plan.settings),
        tuple(tuple(map(_elsewhere, factor.levels)) for factor in design.factors),
    )


def _elsewhere(level: Level) -> Level:
    """The level without its place, and with the names of scenario and firmware instead of their paths."""
    names = {"scenario": _name(level.scenario), "firmware": _name(level.firmware)}
    return msgspec.structs.replace(level, place="", **names)


def _name(path: str) -> str:
    """The robot's own image is named by no path."""
    return "" if path == OWN_IMAGE else Path(path).name


def write(plan: Plan, journal: Path, results: Path) -> None:
    """Writes both files of a campaign whose runs all have an outcome in `journal`. Raises OutputError."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = _schema(plan).with_metadata({META: json_bytes(about(plan))})
    wall = pa.schema([("run", pa.int64()), ("wall_s", pa.float64())])
    with (
        whole_file(wall_path(results), OPTION) as staged_wall,
        whole_file(results, OPTION) as staged,
        staged_wall.open("wb") as wall_file,  # pyarrow takes no path that is not UTF-8
        staged.open("wb") as file,
        pq.ParquetWriter(file, schema, compression="zstd") as rows,
        pq.ParquetWriter(wall_file, wall, compression="zstd") as walls,
    ):
        count = 0
        ordered = in_order(outcome for outcome, _ in outcomes(journal))
        while group := list(islice(ordered, ROWS)):
            count += len(group)
            rows.write_table(_table([_row(plan, outcome) for outcome in group], schema))
            walls.write_table(
                _table([{"run": outcome.run, "wall_s": outcome.wall_s} for outcome in group], wall)
            )
        if count != plan.runs:
            reason = f"has the outcome of {count} of {plan.runs} runs: it was changed while the campaign went"
            raise OutputError(
                journal, reason, "give the same command again, which makes the runs that are missing"
            )


def read(path: str | Path) -> tuple[pa.Table, ResultsInfo]:
    """The rows of a results file, and its head. Raises BadInput for any other file."""
    with _opened(path) as (file, about):
        table = file.read()
    _check_columns(path, table, about)
    return table, about


def read_about(path: str | Path) -> ResultsInfo:
    """Only the head of the file. Raises BadInput for any other file."""
    with _opened(path, "choose another file with --out") as (_, about):
        return about


@contextmanager
def _opened(path: str | Path, remedy: str = GIVE) -> Iterator[tuple[pq.ParquetFile, ResultsInfo]]:
    """Opens a Parquet file. Raises BadInput if it cannot be opened or read within the block."""
    require_arrow()
    import pyarrow as pa
    import pyarrow.parquet as pq

    check_regular(path)
    try:
        with open(path, "rb") as raw, pq.ParquetFile(raw, thrift_string_size_limit=META_BYTES) as file:
            _check_size(path, file.metadata)
            yield file, msgspec.json.decode((file.schema_arrow.metadata or {})[META], type=ResultsInfo)
    except FileNotFoundError:
        raise BadInput(path, "", "there is no such file", remedy) from None
    except (KeyError, msgspec.DecodeError, UnicodeDecodeError):
        raise BadInput(path, "", "is no campaign's results", remedy) from None
    except (pa.ArrowException, OSError) as error:
        reason = f"{error}".partition("\n")[0].rstrip(".")
        raise BadInput(path, "", f"is no Parquet file: {reason}", remedy) from None


def _check_size(path: str | Path, metadata: Any) -> None:
    """Before anything is read: a small file may hold many rows, which are many equal ones."""
    groups = map(metadata.row_group, range(metadata.num_row_groups))
    mib = sum(group.total_byte_size for group in groups) >> 20
    limits = (
        (metadata.num_rows, MOST_ROWS, "runs"),
        (metadata.num_columns, MOST_COLUMNS, "columns"),
        (mib, MOST_MIB, "MiB"),
    )
    for held, most, unit in limits:
        if held > most:
            raise BadInput(path, "", f"holds {held} {unit}, more than {most}", GIVE)


def _check_columns(path: str | Path, table: pa.Table, about: ResultsInfo) -> None:
    """Checks that each row has a seed, and that each factor is there once, with values that can be compared."""
    named = (*about.factors, *about.drawn)
    if len(set(named)) < len(named) or set(named) & OWN_COLUMNS:
        raise BadInput(path, "", "names a factor twice, or one that does not exist", GIVE)
    for name in (*named, *EACH_ROW):
        places = table.schema.get_all_field_indices(name)
        kind = f"{table.schema.field(places[0]).type}" if len(places) == 1 else "nothing"
        if kind not in EACH_ROW.get(name, ("int64", "double", "bool", "string")):
            reason = "there is no such column" if kind == "nothing" else f"holds {kind}"
        elif table[name].null_count:
            reason = "lacks a value in some row"
        else:
            continue
        raise BadInput(path, f"column {shortened(name)}", reason, GIVE)


def counted(path: Path, listed: int) -> dict[str, tuple[int, list[tuple[int, str]]]]:
    """Verdict -> how many runs have it, and the first ones: number, and the row's text."""
    counts: dict[str, tuple[int, list[tuple[int, str]]]] = {}
    with _opened(path) as (file, _):
        for batch in file.iter_batches(columns=["run", "verdict", "error", "failure"]):
            for run, verdict, error, failure in zip(
                *(column.to_pylist() for column in batch.columns), strict=True
            ):
                count, first = counts.get(verdict, (0, []))
                if len(first) < listed:
                    first.append((run, error or failure))
                counts[verdict] = (count + 1, first)
    return counts


def _schema(plan: Plan) -> pa.Schema:
    import pyarrow as pa

    design = plan.design
    kinds: dict[str, type] = {"run": int}
    kinds |= {factor.name: type(factor.levels[0].value) for factor in design.factors}
    kinds |= {draw.name: kind_of(draw.ends()) for draw in design.draws}
    kinds |= {"draw": int} if design.draws else {}
    kinds |= {"seed": int, **dict.fromkeys(TEXTS, str), **plan.figures}
    kinds |= {CHECK + name: str for name in plan.checks}
    types = {float: pa.float64(), int: pa.int64(), bool: pa.bool_(), str: pa.string()}
    return pa.schema([(name, types[kind]) for name, kind in kinds.items()])


def _row(plan: Plan, outcome: RunOutcome) -> dict[str, Any]:
    row: dict[str, Any] = {"run": outcome.run, **plan.varied(outcome.run)}
    row |= {name: getattr(outcome, name) for name in TEXTS}
    row |= {name: outcome.figures.get(name) for name in plan.figures}
    return row | {CHECK + name: outcome.checks.get(name) for name in plan.checks}


def _table(rows: list[dict[str, Any]], schema: pa.Schema) -> pa.Table:
    import pyarrow as pa

    columns = []
    for field in schema:
        try:
            columns.append(pa.array([row[field.name] for row in rows], field.type))
        except (pa.ArrowException, TypeError, OverflowError):
            reason = f"runs {rows[0]['run']} to {rows[-1]['run']} have a value that is no {field.type}"
            raise BadInput("", field.name, reason, "start again with --force") from None
    return pa.Table.from_arrays(columns, schema=schema)
