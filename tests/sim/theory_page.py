"""Writes numbers into docs/background/theory.md and the radio's README: `python -m tests.sim.theory_page --write`.

The prose is the pages' own. Each of `QUOTES` is a sentence of a page, with `{}` where a number stands, and what
measures these numbers. Each of `TABLES` is a CSV file; some columns of one of them stand between marks on the page.
Without --write: the lines whose numbers are not those of the runs, and exit code 1 if there are some. About a minute.
"""

import argparse
import csv
import io
import re
import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import NamedTuple

from benchmarks import improved
from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from mirotwin.campaign.drive import outcomes_of
from mirotwin.campaign.workers import Processes
from tests.host.theory import claims, ideal
from tests.sim import theory_in_the_loop as loop

ROOT = Path(__file__).parents[2]
THEORY = ROOT / "docs/background/theory.md"
RADIO = ROOT / "sim/miro_sim/radio/README.md"
SEEDS = 20
STARTS = 120
"""Random starts of each path in the table of laws and filters."""
NUMBER = r"(-?[0-9]+(?:\.[0-9]+)?)"


class Quote(NamedTuple):
    """A sentence of a page, its words in any lines, with `{}` for each number; what measures them, as texts."""

    page: Path
    sentence: str
    measured: Callable[[], list[str]]

    @property
    def pattern(self) -> re.Pattern[str]:
        parts = re.split(r"(\{\}|\s+)", self.sentence)
        return re.compile(
            "".join(
                NUMBER if part == "{}" else r"\s+" if part.isspace() else re.escape(part) for part in parts
            )
        )

    def written(self, text: str) -> str:
        """The page's text with the numbers that are measured. Raises ValueError unless the sentence is there once."""
        found = list(self.pattern.finditer(text))
        if len(found) != 1:
            raise ValueError(f"{self.page.name}: {len(found)} times instead of once: {self.sentence}")
        (match,) = found
        for group, number in reversed(list(enumerate(self.measured(), 1))):
            text = text[: match.start(group)] + number + text[match.end(group) :]
        return text


def fixed(numbers, digits):
    """As texts with so many digits behind the point."""
    return [f"{number:.{digits}f}" for number in numbers]


def remark_1():
    """u1, torques and work from three angles."""
    rows = [claims.remark_1_of(alpha) for alpha in (0.3, 0.1, 0.03)]
    columns = zip(*rows, strict=True)
    return [
        text for column, digits in zip(columns, (1, 0, 0), strict=False) for text in fixed(column, digits)
    ]


def random_ends():
    """Of the paper's law within 3 cm, parallel, mirrored; with a sign within 3 cm."""
    return fixed([*claims.random_ends("literal", 100), claims.random_ends("body", 100)[0]], 0)


def shares(name):
    """Of the frames of fig6, fig7 and fig8, in per cent."""
    return fixed([100 * getattr(loop.medians(run, SEEDS), name) for run in ("fig6", "fig7", "fig8")], 0)


def covered():
    """P1 and P2 of fig6 with the bounds b of noise that they cover, in mm/s and mrad/s: 2 b / T = P."""
    gains, half_s = claims.gains_of_scenario("fig6"), 0.5 * seconds(CONTROL_PERIOD_TICKS)
    pairs = ((gains.p1_m_s2, 1), (gains.p2_rad_s2, 0))
    return [text for p, digits in pairs for text in (f"{p:g}", *fixed([1000 * half_s * p], digits))]


def chattering():
    return fixed([loop.medians(run, SEEDS).chattering_m_s2 for run in ("fig6, sign functions", "fig6")], 3)


QUOTES = (
    Quote(
        THEORY, "at most {}, {} and {} m/s2, {}, {} and {} mNm at a wheel, {}, {} and {} mJ of work", remark_1
    ),
    Quote(THEORY, "chattering index in the whole loop {} and {} m/s2", chattering),
    Quote(
        THEORY,
        "ends all three at {}, {} and {} cm without delay",
        lambda: fixed([100 * ideal.figure("literal", name)[0] for name in ideal.STARTS], 1),
    ),
    Quote(
        THEORY, "{} s backward in the whole loop", lambda: fixed([loop.medians("fig7", SEEDS).backward_s], 1)
    ),
    Quote(
        THEORY,
        "the robot is {} cm beside it after 6 s",
        lambda: fixed([100 * ideal.run_parallel_to_the_line()[-1].posture.y_m], 4),
    ),
    Quote(
        THEORY,
        "slope of the final against the initial lateral error: {} ({} with",
        lambda: fixed(map(ideal.lateral_slope, ideal.LAWS), 3),
    ),
    Quote(
        THEORY,
        "Of 100 random starts {} end within 3 cm, {} parallel to the line, {} on its mirror image"
        " (with a sign: {} within",
        random_ends,
    ),
    Quote(
        THEORY,
        "in one run from {} to {}.",
        lambda: fixed(max(claims.jumps(), key=lambda jump: jump[1] - jump[0])[:2], 3),
    ),
    Quote(
        THEORY,
        "V rises there, with f = 0, in {} % of random states near the line with the library's gains, in {} % with"
        " those of `fig6` and in {} % with those of `fig8`; with it, in {} %",
        lambda: fixed(claims.rising_shares(), 0),
    ),
    Quote(THEORY, "|f1| is above P1 in {}, {} and {} % of the frames", lambda: shares("f1_above_p1")),
    Quote(
        THEORY,
        "above P1 |sat(s1)|, which is what is left, in {}, {} and {} %",
        lambda: shares("f1_above_authority"),
    ),
    Quote(THEORY, "For |f2| these shares are {}, {} and {} %", lambda: shares("f2_above_authority")),
    Quote(
        RADIO,
        "So fig6's P1 = {} m/s2 covers noise on v up to b = {} mm/s, and P2 = {} rad/s2 covers noise on w up to"
        " {} mrad/s.",
        covered,
    ),
)
LAWS = {
    "the paper's law": "yang_kim",
    "body_frame": "body_frame",
    "Kanayama": "kanayama",
    "dynamic feedback": "dynamic_feedback",
}
FILTERS = ("none", "ekf")
PATHS = ("line", "arc")


def in_the_loop():
    """The table of whole runs."""
    return [list(loop.COLUMNS), *(list(loop.row(name, SEEDS)) for name in loop.RUNS)]


def lifted():
    """Law and filter from random starts under white noise: who settles, when, how near, who crosses the limit."""
    head = ["law", "estimator"]
    for path in PATHS:
        head += [f"{path}: settle", "settling, s", "error, cm"]
    rows = [[name, kind, *from_random_starts(law, kind)] for name, law in LAWS.items() for kind in FILTERS]
    return [[*head, "cross the limit"], *rows]


def from_random_starts(law, kind):
    """The cells of a row."""
    cells, crossing, runs = [], 0, 0
    for path in PATHS:
        (case,) = [case for case in improved.cases() if case.name == f"starts within 60 cm, {path}"]
        jobs = improved.works(case, range(STARTS), law, kind)
        figures = [outcome.figures for outcome in outcomes_of(jobs, Processes())]
        settled = [one for one in figures if one["settled"]]
        cells.append(f"{len(settled)} of {len(figures)}")
        cells += [f"{median(one[name] for one in settled):.2f}" for name in ("settling_s", "rms_position_cm")]
        crossing += len([one for one in figures if one["assumption_3_crossings"]])
        runs += len(figures)
    return [*cells, f"{crossing} of {runs}"]


class Table(NamedTuple):
    """A CSV file, what measures its rows, and those columns that its page shows between marks; none: no marks."""

    path: Path
    rows: Callable[[], list[list[str]]]
    shown: tuple[int, ...] = ()

    def stored(self):
        """The rows of the file."""
        with self.path.open(newline="", encoding="utf-8") as stream:
            return list(csv.reader(stream))

    def on_page(self, rows):
        """The rows as the page has them."""
        return in_columns([[row[column] for column in self.shown] for row in rows])


TABLES = {
    "in the loop": Table(ROOT / "tests/sim/theory_loop.csv", in_the_loop),
    "law and filter": Table(ROOT / "tests/sim/theory_starts.csv", lifted, (0, 1, 2, 4)),
}
"""By the words of their marks."""


def marked(name):
    """What stands between a table's marks."""
    begin = re.escape(f"<!-- {name}: generated by python -m tests.sim.theory_page -->\n")
    return re.compile(f"({begin}).*?(<!-- end of the table -->)", re.S)


def in_columns(rows):
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]
    return "\n".join(["```text", *lines, "```"]) + "\n"


def csv_text(rows):
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


def written(texts, quotes=QUOTES, tables=TABLES):
    """Files by their paths, with what is measured now. Raises ValueError for a sentence or a mark that is not there."""
    texts = dict(texts)
    for quote in quotes:
        texts[quote.page] = quote.written(texts[quote.page])
    for name, table in tables.items():
        rows = table.rows()
        texts[table.path] = csv_text(rows)
        if not table.shown:
            continue
        new = table.on_page(rows)
        texts[THEORY], count = marked(name).subn(
            lambda marks, new=new: marks[1] + new + marks[2], texts[THEORY]
        )
        if count != 1:
            raise ValueError(f"theory.md: {count} times instead of once: the marks of the table {name}")
    return texts


def pages():
    paths = (THEORY, RADIO, *(table.path for table in TABLES.values()))
    return {path: path.read_text(encoding="utf-8") for path in paths}


def main():
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("--write", action="store_true", help="write them; left out: say which differ")
    write = arguments.parse_args().write
    before = pages()
    after = written(before)
    for path, text in after.items():
        for old, new in zip(before[path].splitlines(), text.splitlines(), strict=False):
            if old != new:
                print(f"{path.relative_to(ROOT)}: {new}")
        if write:
            path.write_text(text, encoding="utf-8")
    return 0 if write or after == before else 1


if __name__ == "__main__":
    sys.exit(main())
