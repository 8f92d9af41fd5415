"""The page of a campaign: how metrics spread in each arm, paired differences, failures, how to make a row again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from miro_exact.bad_input import BadInput
from miro_sim.scenario.settings import EXPECT
from mirotwin.campaign.comparison import differences, judged, shown
from mirotwin.campaign.design import inline
from mirotwin.campaign.results import ResultsInfo
from mirotwin.campaign.rows import SHARES, Arm, ResultRows, label_of, paired_levels
from mirotwin.report.page.bokeh_page import require_bokeh
from mirotwin.report.page.document import check_size, place_of_page, render, write_page
from mirotwin.run.run_options import RunOptions
from mirotwin.shell.command import Argument, Options, command_of
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.options import FORCE, NAME, OUT, QUIET
from mirotwin.shell.verdicts import VERDICTS, judge


def arm_line(about: ResultsInfo, levels: Mapping[str, Any]) -> str:
    """`mirotwin run ..` with the settings of these factor levels; "" if the file does not record the command."""
    if not about.scenario:
        return ""
    scenario, firmware, settings = about.scenario, about.firmware, list(about.settings)
    for name, known in zip(about.factors, about.levels, strict=True):
        level = next((candidate for candidate in known if candidate.value == levels[name]), None)
        if level is None:
            return ""
        scenario, firmware = level.scenario or scenario, level.firmware or firmware
        settings += level.settings
    expected = [setting for setting in settings if setting.startswith(EXPECT)]
    return RunOptions(
        scenario=scenario,
        firmware=firmware or None,
        settings=tuple(setting for setting in settings if setting not in expected),
        expected=tuple(setting.removeprefix(EXPECT) for setting in expected),
    ).command_line()


MOST_ARMS = 24
"""More would be no picture: then the runs are grouped by fewer factors."""
MOST_LEVELS = 6
MOST_COMPARISONS = 12
LISTED = 300
"""Largest number of failed runs listed; the table gives the total."""


def campaign_page(path: Path) -> bytes:
    """The page of a results file. Raises BadInput for a file that is not one, and where Bokeh is not installed."""
    require_bokeh()
    rows = ResultRows(path)
    if not rows.count:
        raise BadInput(path, "", "holds no runs", "give the results of a campaign")
    metrics = [name for name in shown(rows) if name in rows.metrics()]
    by = _by(rows)
    made: dict[str, Any] = {}
    arms = _arms(rows, by, metrics, made)
    comparisons = _comparisons(rows, made)
    failed = _failed(rows)
    verdicts, seeds = rows.column("verdict"), rows.column("seed")
    counts = {name: verdicts.count(name) for name in ("passed", "not judged", *SHARES)}
    values = {
        "file": path.name,
        "about": rows.about,
        "count": rows.count,
        "seeds": " to ".join(f"{seed}" for seed in sorted({min(seeds), max(seeds)})),
        "counts": counts,
        "badge": _badge(counts),
        "by": by,
        "arms": arms,
        "metrics": metrics,
        "comparisons": comparisons,
        "failed": failed[:LISTED],
        "more_failed": max(0, len(failed) - LISTED),
    }
    return render("campaign.html", made, _data(rows), values)


def _by(rows: ResultRows) -> tuple[str, ...]:
    """The first factors whose combinations fit into the largest number of arms of a picture."""
    factors = rows.about.factors
    while factors and len(rows.groups(factors)) > MOST_ARMS:
        factors = factors[:-1]
    return factors


def _arms(rows: ResultRows, by: tuple[str, ...], metrics: Sequence[str], made: dict[str, Any]) -> list[Arm]:
    from mirotwin.campaign.plots import spread  # loads Bokeh

    arms = list(rows.arms(by, rows.groups(by), metrics))
    for name in metrics:
        if drawn := [(arm, numbers[name]) for arm, numbers in arms if arm.metrics[name] is not None]:
            made[f"plot-{name}"] = spread(name, drawn)
    return [arm for arm, _ in arms]


def _comparisons(rows: ResultRows, made: dict[str, Any]) -> list[dict[str, Any]]:
    """Each level of a factor against its first one. `figure`: id of its figure's element, "" where there is none."""
    from mirotwin.campaign.plots import apart  # loads Bokeh

    comparisons: list[dict[str, Any]] = []
    for factor in rows.about.factors:
        first, *others = rows.levels(factor)
        for second in others[: MOST_LEVELS - 1]:
            pairs = paired_levels(rows, factor, first, second)
            if not pairs or len(comparisons) == MOST_COMPARISONS:
                continue
            compared = differences(judged(rows), rows, rows, pairs)
            drawn = [
                (difference, numbers) for difference, numbers in compared if difference.metric in shown(rows)
            ]
            figure = ""
            if any(difference.first and difference.interval for difference, _ in drawn):
                figure = f"plot-pairs-{len(comparisons)}"
                made[figure] = apart(drawn)
            levels = {"factor": factor, "first": first, "second": second, "pairs": len(pairs)}
            comparisons.append(
                {**levels, "differences": [difference for difference, _ in compared], "figure": figure}
            )
    return comparisons


def _failed(rows: ResultRows) -> list[tuple[int, str, int, str, str]]:
    """Run, arm, seed, verdict and its message, of each run that has not passed."""
    factors = rows.about.factors
    columns = [rows.column(name) for name in ("run", "seed", "verdict", "error", "failure")]
    levels = {name: rows.column(name) for name in factors}
    return [
        (run, label_of({name: levels[name][row] for name in factors}), seed, verdict, error or failure)
        for row, (run, seed, verdict, error, failure) in enumerate(zip(*columns, strict=True))
        if verdict != "passed"
    ]


def _badge(counts: dict[str, int]) -> tuple[str, str]:
    """A word, and the numbers after it."""
    wrong = [name for name in reversed(VERDICTS) if name != "passed" and counts.get(name)]
    text = ", ".join(f"{counts[name]} {VERDICTS[name].badge}" for name in wrong)
    return judge(wrong), text or f"{counts['passed']} runs passed"


def _data(rows: ResultRows) -> bytes:
    """JSON from which the page composes the command of each row: commands of arms, and arm, seed and drawn values of
    each row.
    """
    factors, about = rows.about.factors, rows.about
    arms = rows.groups(factors)
    drawn = {name: rows.column(name) for name in about.drawn}
    seeds, numbers = rows.column("seed"), rows.column("run")
    arm_of = [0] * rows.count
    for number, members in enumerate(arms.values()):
        for row in members:
            arm_of[row] = number
    return json_bytes(
        {
            "arms": [arm_line(about, dict(zip(factors, levels, strict=True))) for levels in arms],
            "runs": numbers,
            "rows": [
                [arm_of[row], seeds[row], *([words] if (words := _drawn_words(drawn, row)) else [])]
                for row in range(rows.count)
            ],
        }
    )


def _drawn_words(drawn: dict[str, list[Any]], row: int) -> str:
    """The values drawn for a row, as words of that command."""
    settings = [f"{name}={inline(column[row])}" for name, column in drawn.items()]
    return shlex.join(word for setting in settings for word in ("--set", setting))


FEWER = "give the results of a campaign with fewer runs"


class PageOptions(Options, frozen=True, kw_only=True):
    COMMAND = "campaign page"
    results: Annotated[str, Argument("RESULTS", NAME)]
    out: Annotated[
        Path | None, OUT.saying("The page to write. Default: report.html, which replaces an earlier page.")
    ] = None
    force: Annotated[bool, FORCE] = False
    quiet: Annotated[bool, QUIET.saying("No last line.")] = False


@command_of(PageOptions)
def page(options: PageOptions) -> int:
    """Writes one HTML file that needs no network: the spread of each arm, paired differences, failures, and the command
    that repeats any run.
    """
    place = place_of_page(options.out, options.force, options.results)
    made = campaign_page(Path(options.results))
    check_size(made, options.results, FEWER)
    return write_page(place, made, options.quiet)
