"""`mirotwin campaign show RESULTS.parquet`: statistics of a campaign, alone, of two levels, or against a baseline."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Annotated, Any

import click
from rich.table import Table

from miro_exact.bad_input import BadInput, amount
from mirotwin.campaign.columns import CHECK
from mirotwin.campaign.comparison import (
    FEWEST_FOR_GATE,
    GATED,
    SHOWN,
    MetricDifference,
    differences,
    judged,
    shown,
)
from mirotwin.campaign.flips import FLIP, classes, classes_table
from mirotwin.campaign.rows import SHARES, UNSETTLED, Arm, ResultRows, paired, paired_levels
from mirotwin.campaign.statistics import Figures, Interval
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.console import plain_table
from mirotwin.shell.console import show as show_table
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.options import JSON, PATH, FiniteNumber
from mirotwin.shell.program import complain, show_line
from mirotwin.shell.verdicts import DONE, exit_code

MOST_GROUPS = 50
"""More are in --json only."""


class ShowOptions(Options, frozen=True, kw_only=True):
    COMMAND = "campaign show"
    results: Annotated[Path, Argument("RESULTS", PATH)]
    metrics: Annotated[
        tuple[str, ...],
        Option(
            "--metric",
            metavar="NAME",
            help="A figure of the results, or failed, fault, error, unsettled, check.NAME; may be repeated."
            f" Default: {', '.join(SHOWN)}; in comparisons {', '.join(GATED)}. Of boards: how long each wait took, and"
            " values of parts; in comparisons the waits, failed, error, fault.",
        ),
    ] = ()
    by: Annotated[
        tuple[str, ...],
        Option(metavar="FACTOR", help="Runs with the same levels stand together; may be repeated."),
    ] = ()
    between: Annotated[
        str | None,
        Option(metavar="FACTOR=A,B", help="Compare two levels of a factor, paired on the same seeds."),
    ] = None
    against: Annotated[
        Path | None,
        Option(
            metavar="BASELINE.parquet", type=PATH, help="Exit code 1 if worse than these.", apart="between"
        ),
    ] = None
    tolerance: Annotated[
        float,
        Option(
            type=FiniteNumber(0.0, 1000.0), help="Per cent by which a mean may be worse than the baseline's."
        ),
    ] = 0.0
    as_json: Annotated[bool, JSON] = False


@command_of(ShowOptions)
def show(options: ShowOptions) -> int:
    """Shows medians with their 95 % intervals, and the spread, of each combination of factors.

    --between and --against pair runs with the same seed and the same values of all other factors. A metric is worse
    when the whole 95 % interval of its mean difference lies on the bad side of 0; one more error or firmware fault is
    worse, too.

    Exit code 1: a metric is worse than in --against; a line for each gives the metric, the difference and its interval.
    """
    results, metrics, against, as_json = options.results, options.metrics, options.against, options.as_json
    rows = ResultRows(results)
    for name in metrics:
        rows.check_metric(name)
    if not rows.count:
        raise BadInput(results, "", "holds no runs", "give the results of a campaign")
    if options.between is not None:
        return _compare(rows, options.between, metrics or judged(rows), as_json)
    if against is not None:
        return _against(rows, against, metrics or judged(rows), options.tolerance / 100.0, as_json)
    by = [name for name in rows.about.factors if name != FLIP]
    _show(rows, metrics or shown(rows), options.by or by, as_json)
    return DONE


def _show(rows: ResultRows, metrics: Sequence[str], by: Sequence[str], as_json: bool) -> None:
    groups = rows.groups(by)
    arms = rows.arms(by, groups, metrics)
    shown = [arm for arm, _ in islice(arms, None if as_json else MOST_GROUPS)]
    if as_json:
        flips = {"flips": classes(rows)} if FLIP in rows.about.factors else {}
        _print_json({"results": str(rows.path), "runs": rows.count, "groups": shown, **flips})
        return
    show_line(f"{rows.path}: {amount(rows.count, 'run')} of {rows.about.campaign}")
    show_table(_groups_table(shown))
    if len(groups) > len(shown):
        show_line(
            f"{amount(len(groups) - len(shown), 'more group')}: --by names fewer factors, --json shows all"
        )
    if FLIP in rows.about.factors:
        show_table(classes_table(rows))


def _groups_table(groups: Sequence[Arm]) -> Table:
    figures = ("of", "median", "95 % interval", "5 %", "95 %", "worst")
    table = plain_table(*groups[0].factors, "runs", *SHARES, "metric", right=figures)
    for group in groups:
        head = [*(f"{level}" for level in group.factors.values()), f"{group.runs}"]
        head += [f"{group.verdicts[name]}" for name in SHARES]
        for name, metric_figures in group.metrics.items():
            table.add_row(*head, _labelled(group.metric_label(name)), *_cells(metric_figures))
            head = [""] * len(head)
    return table


def _labelled(metric: str) -> str:
    """The name of a metric; for one that is 0 or 1 per run, with the meaning of 1."""
    if metric.startswith(CHECK):
        return f"{metric} (1: failed)"
    return f"{metric} (1: yes)" if metric in (*SHARES, UNSETTLED) else metric


def _cells(figures: Figures | None) -> list[str]:
    if figures is None:
        return ["0"]
    spread = [_number(figures.quantiles[share]) for share in ("0.05", "0.95", "1")]
    return [f"{figures.count}", _number(figures.median), _interval(figures.median_interval), *spread]


def _compare(rows: ResultRows, text: str, metrics: Sequence[str], as_json: bool) -> int:
    name, first, second = rows.two_levels(text)
    pairs = paired_levels(rows, name, first, second)
    if not pairs:
        reason = f"no run with {first} has a twin with {second}"
        raise BadInput(rows.path, "--between", reason, "the campaign has to be complete")
    compared = [difference for difference, _ in differences(metrics, rows, rows, pairs)]
    if as_json:
        _print_json({"factor": name, "first": first, "second": second, "differences": compared})
        return DONE
    show_line(
        f"{rows.path}: {name}, {second} against {first}, {amount(len(pairs), 'pair')} with the same seed"
    )
    show_table(_differences_table(compared, f"{first}", f"{second}"))
    return DONE


def _against(rows: ResultRows, path: Path, metrics: Sequence[str], tolerance: float, as_json: bool) -> int:
    baseline = ResultRows(path)
    for name in metrics:
        baseline.check_metric(name)
    pairs = paired(baseline, rows)
    seeds = len(set(rows.samples()[[second for _, second in pairs]].tolist()))
    if seeds < FEWEST_FOR_GATE:
        reason = f"has only {amount(seeds, 'seed')} in common with {rows.path}"
        raise BadInput(path, "", reason, f"a gate needs {FEWEST_FOR_GATE}; give both campaigns more seeds")
    compared = [difference for difference, _ in differences(metrics, baseline, rows, pairs)]
    worse = [difference for difference in compared if difference.worse(tolerance)]
    ours, theirs = rows.column("digest"), baseline.column("digest")
    same = [theirs[first] == ours[second] for first, second in pairs].count(True)
    if as_json:
        names = [difference.metric for difference in worse]
        _print_json(
            {
                "against": str(path),
                "pairs": len(pairs),
                "same_digest": same,
                "differences": compared,
                "worse": names,
            }
        )
    else:
        show_line(
            f"{rows.path} against {path}: {amount(len(pairs), 'pair')} of runs, {same} with the same digest"
        )
        show_table(_differences_table(compared, "before", "now"))
    for ours_only, where, there in ((rows, rows.path, path), (baseline, path, rows.path)):
        if unpaired := ours_only.count - len(pairs):
            complain(f"{unpaired} of {ours_only.count} runs of {where} are not in {there}")
    for difference in worse:
        complain(f"worse than {path}: {_sentence(difference)}")
    return exit_code("failed" if worse else "passed")


def _differences_table(compared: Sequence[MetricDifference], first: str, second: str) -> Table:
    means = (first, second, "difference", "95 % interval", "median")
    table = plain_table("metric", right=("pairs", "left out", "seeds", *means, "higher", "lower"))
    for difference in compared:
        table.add_row(
            _labelled(difference.metric),
            f"{difference.pairs}",
            f"{difference.without}",
            f"{difference.seeds}",
            _number(difference.first),
            _number(difference.second),
            f"{difference.difference:+.4g}",
            _interval(difference.interval),
            f"{difference.median:+.4g}",
            f"{difference.higher}",
            f"{difference.lower}",
        )
    return table


def _sentence(difference: MetricDifference) -> str:
    """A sentence that names the metric that got worse, by how much, and its interval."""
    means = f"from {_number(difference.first)} to {_number(difference.second)}"
    interval = f" (95 % interval {_interval(difference.interval)})" if difference.interval is not None else ""
    of = f"{amount(difference.pairs, 'pair')} of {amount(difference.seeds, 'seed')}"
    return f"{difference.metric} by {difference.difference:+.4g}{interval} in the mean of {of}, {means}"


def _number(value: float) -> str:
    return f"{value:.4g}"


def _interval(interval: Interval | None) -> str:
    return "too few" if interval is None else f"{interval.low:.4g} to {interval.high:.4g}"


def _print_json(document: dict[str, Any]) -> None:
    click.echo(json_bytes(document, indent=2).decode())
