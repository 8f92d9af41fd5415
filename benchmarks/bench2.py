"""Mirotwin-Bench 2: its baselines, run again, and kept with figures and digests in `leaderboard.json`.

    python -m benchmarks.bench2 --run                        # runs that build/bench2 lacks, then the file: 20 minutes
    python -m benchmarks.bench2 --check [--draw WORD]        # a run of each entry and case again; WORD draws the seeds
    python -m benchmarks.bench2 --write docs/benchmark.md    # the tables of the page, and its picture
    python -m benchmarks.bench2 --compare mine.parquet --with "body_frame, ekf"    # either may be a file of results
    python -m benchmarks.bench2 --fresh my_law.py --draw WORD    # seeds for a referee

The file holds each run of each entry: settled or not, truth error, camera error and the first digits of the digest. So
an entry is compared with a baseline without running that again, and every run can be checked alone. The runs of Bench
1 that the page tells of are in it, too.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from msgspec.structs import replace

from miro_exact.bad_input import BadInput
from miro_sim.scenario.file import load as scenario
from mirotwin.campaign import Processes, load, run
from mirotwin.campaign.design import inline
from mirotwin.campaign.drive import outcomes_of
from mirotwin.campaign.plan import Plan
from mirotwin.campaign.rows import ResultRows
from mirotwin.campaign.worker import RunOutcome, Work
from mirotwin.shell.plugin_files import PluginFiles

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "build/bench2"
BOARD = ROOT / "benchmarks/leaderboard.json"
BENCH, NOISE, BENCH_1 = "bench2", "bench2-noise", "bench1"
CLASSES = ("plain", "self-calibrated")
NONE, EKF = "none", "ekf"
ESTIMATORS = (NONE, "predict", EKF)
DIGITS = 8
"""Of a digest, in the file."""
DECIMALS = 3
"""Of an error in cm, in the file."""
LEARNING = "camera.self_calibration='lines'"


class Entry(NamedTuple):
    """A law with an estimator: its settings, and FILE.py:CLASS of a law that Mirotwin does not ship."""

    settings: tuple[str, ...]
    law: str = ""


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """All runs of an entry in a case, one for each seed from `first_seed` on. `settled`: 1 or 0 for each."""

    campaign: str
    case: str
    entry: str
    first_seed: int
    settled: str
    truth_cm: list[float | None]
    camera_cm: list[float | None]
    digests: list[str]


def paper(figure: str, **keys: float) -> dict[str, Any]:
    """The paper's law with the gains of that built-in scenario, and `keys` that differ."""
    controller = scenario(figure).scenario.networks[0].robot[0].controller
    return {**msgspec.to_builtins(controller), **keys}


FAST_M_S = 0.462
"""A limit that lets a law drive the fast path: the one of `fig6`."""
FIG_6, FIG_8, REFERENCE = "paper, Fig. 6", "paper, Fig. 8", "body_frame"
LAWS: dict[str, tuple[dict[str, Any], str]] = {
    FIG_6: (paper("fig6"), ""),
    FIG_8: (paper("fig8", max_v_m_s=FAST_M_S), ""),
    "epsilon_tracking": ({"law": "epsilon_tracking", "max_v_m_s": FAST_M_S}, ""),
    REFERENCE: ({"law": REFERENCE}, ""),
    "kanayama": ({"law": "kanayama"}, ""),
    "dynamic_feedback": ({"law": "dynamic_feedback"}, ""),
    "samson": ({"law": "samson"}, "examples/laws/samson_law.py:Parameters"),
    "pure_pursuit": ({"law": "pure_pursuit"}, "examples/laws/pursuit_law.py:Parameters"),
}
"""Name -> `controller` table, and the law's file."""


def entry(law: str, estimator: str, *more: str) -> Entry:
    table, file = LAWS[law]
    kinds = () if estimator == NONE else (f"network.robot.estimator={{kind = '{estimator}'}}",)
    return Entry((f"network.robot.controller={inline(table)}", *kinds, *more), file)


ENTRIES = {f"{law}, {estimator}": entry(law, estimator) for law in LAWS for estimator in ESTIMATORS}
CURVES = (*(f"{law}, {EKF}" for law in LAWS), f"{FIG_6}, {NONE}", f"{FIG_8}, {NONE}")
"""Entries that are run over levels of noise."""
OLD = {
    "paper": Entry(()),
    "Fig. 6 alone": entry(FIG_6, NONE),
    "Fig. 8 alone": Entry((f"network.robot.controller={inline(paper('fig8'))}",)),
    "improved": entry(REFERENCE, EKF),
    **{
        f"{law}, ekf, self-calibrated": entry(law, EKF, LEARNING)
        for law in (REFERENCE, "kanayama", "dynamic_feedback")
    },
}
"""What the page says of Bench 1."""


def everything() -> Iterator[tuple[str, str, Entry]]:
    """Campaign, name and entry of all that is in the file."""
    for name, one in ENTRIES.items():
        yield BENCH, name, one
    for name in CURVES:
        yield NOISE, name, ENTRIES[name]
    for name, one in OLD.items():
        yield BENCH_1, name, one


def plan_of(campaign: str, one: Entry) -> Plan:
    """The runs of an entry. Its law's file, or none, is the one that this process has until the next call."""
    plugins = PluginFiles(laws=(f"{ROOT / one.law}",) if one.law else ())
    plugins.bring()
    return replace(_plan(campaign, one.settings), plugins=plugins)


@cache
def _plan(campaign: str, settings: tuple[str, ...]) -> Plan:
    return load(campaign, settings)


def rows_of(results: ResultRows, campaign: str, name: str) -> Iterator[Row]:
    """The rows of a file of results, one for each combination of what it varies, in the order of the plan."""
    factors = results.about.factors
    first_seed = min(results.column("seed"))
    columns = ("settled", "rms_position_cm", "seen_position_cm", "digest")
    values = list(zip(*(results.column(one) for one in (*factors, *columns)), strict=True))
    for levels, group in groupby(values, lambda one: one[: len(factors)]):
        settled, truth_cm, camera_cm, digests = zip(*(one[len(factors) :] for one in group), strict=True)
        yield Row(
            campaign=campaign,
            case=case_of(levels),
            entry=name,
            first_seed=first_seed,
            settled="".join("1" if one else "0" for one in settled),
            truth_cm=[_rounded(one) for one in truth_cm],
            camera_cm=[_rounded(one) for one in camera_cm],
            digests=[(digest or "")[:DIGITS] for digest in digests],
        )


def case_of(levels: Iterable[object]) -> str:
    """The levels of a run's factors; of a scenario the name of its file."""
    return ", ".join(Path(f"{level}").stem if "/" in f"{level}" else f"{level}" for level in levels)


def _rounded(error_cm: float | None) -> float | None:
    return None if error_cm is None else round(error_cm, DECIMALS)


def measured(folder: Path) -> list[Row]:
    """The rows of all entries; runs that `folder` lacks are made."""
    rows: list[Row] = []
    for campaign, name, one in everything():
        results = folder / campaign / f"{name}.parquet"
        run(plan_of(campaign, one), results)
        rows += rows_of(ResultRows(results), campaign, name)
        print(f"{campaign}: {name}", file=sys.stderr)
    return rows


def stored(path: Path = BOARD) -> list[Row]:
    return msgspec.json.decode(path.read_bytes(), type=list[Row])


def store(rows: Iterable[Row], path: Path = BOARD) -> None:
    """A line for each row, so that a change shows which."""
    lines = ",\n".join(msgspec.json.encode(row).decode() for row in rows)
    path.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def drawn(rows: Iterable[Row], word: str) -> Iterator[tuple[Row, int, Work]]:
    """A run of each row, which the word draws: the row, the place of the seed in it, and the job."""
    entries = {(campaign, name): one for campaign, name, one in everything()}
    ordered = sorted(rows, key=lambda row: (row.campaign, row.entry))
    for (campaign, name), group in groupby(ordered, lambda row: (row.campaign, row.entry)):
        plan = plan_of(campaign, entries[campaign, name])
        count, factors = plan.design.seed_count, [factor.name for factor in plan.design.factors]
        varied = [(first, plan.varied(first)) for first in range(0, plan.runs, count)]
        firsts = {case_of(levels[name] for name in factors): first for first, levels in varied}
        for row in group:
            at = hashed(f"{word} {campaign} {name} {row.case}") % count
            yield row, at, plan.work(firsts[row.case] + at)


def hashed(text: str) -> int:
    return int(hashlib.sha256(text.encode()).hexdigest()[:8], 16)


def sample(rows: Iterable[Row], word: str) -> list[Row]:
    """One row of each entry, which the word draws."""
    ordered = sorted(rows, key=lambda row: (row.campaign, row.entry, hashed(f"{word} {row.case}")))
    return [next(group) for _, group in groupby(ordered, lambda row: (row.campaign, row.entry))]


def differences(rows: Sequence[Row], word: str) -> Iterator[str]:
    """Makes one run of each row again; a line for each that is not as the file has it."""
    jobs = list(drawn(rows, word))
    works = [replace(work, run=number) for number, (_, _, work) in enumerate(jobs)]
    for outcome in outcomes_of(works, Processes()):
        row, place, work = jobs[outcome.run]
        was = (row.settled[place], row.truth_cm[place], row.camera_cm[place], row.digests[place])
        if was != (now := shown(outcome)):
            yield f"{row.campaign}, {row.entry}, {row.case}, seed {work.seed}: {now} instead of {was}"


def shown(outcome: RunOutcome) -> tuple[str, float | None, float | None, str]:
    """What the file has of a run."""
    figures = outcome.figures
    errors = (_rounded(figures.get(name)) for name in ("rms_position_cm", "seen_position_cm"))
    return ("1" if figures.get("settled") else "0", *errors, outcome.digest[:DIGITS])  # type: ignore[return-value]


def entered(text: str) -> list[Row]:
    """The rows of an entry of the file, or of a file of results. Raises BadInput."""
    if text.endswith(".parquet"):
        return list(rows_of(ResultRows(text), BENCH, Path(text).stem))
    if text not in ENTRIES:
        raise BadInput(BOARD, text, "there is no such entry", f"give one of: {'; '.join(ENTRIES)}")
    return [row for row in stored() if row.entry == text and row.campaign == BENCH]


def fresh(source: bytes, word: str) -> range:
    """Seeds for a referee, from the hash of an entry's source and a word chosen after the source was handed in."""
    first = 10_000 + int(hashlib.sha256(source + word.encode()).hexdigest()[:8], 16)
    return range(first, first + plan_of(BENCH, ENTRIES[f"{REFERENCE}, {NONE}"]).design.seed_count)


def main() -> None:
    from benchmarks import bench2_page

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--run", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--draw", default="", metavar="WORD")
    parser.add_argument("--write", type=Path, metavar="PAGE")
    parser.add_argument("--compare", metavar="ENTRY", help="an entry of the file, or a file of results")
    parser.add_argument("--with", dest="baseline", default=f"{REFERENCE}, {EKF}", metavar="ENTRY")
    parser.add_argument("--fresh", type=Path, metavar="FILE.py")
    given = parser.parse_args()
    if given.run:
        store(measured(RESULTS))
    if given.check and (wrong := list(differences(stored(), given.draw))):
        sys.exit("\n".join(wrong))
    if given.write:
        bench2_page.write(given.write, stored())
    try:
        if given.compare:
            print(bench2_page.comparison(entered(given.baseline), entered(given.compare)), end="")
    except BadInput as error:
        parser.error(f"{error}")
    if given.fresh:
        seeds = fresh(given.fresh.read_bytes(), given.draw)
        print(f"--seeds {seeds[0]}-{seeds[-1]}")


if __name__ == "__main__":
    main()
