"""What the runs of Mirotwin-Bench 2 come to, in sentences whose numbers are counted from them."""

from __future__ import annotations

from itertools import combinations
from statistics import median
from textwrap import fill

from benchmarks.bench2 import CLASSES, EKF, ENTRIES, ESTIMATORS, FIG_6, FIG_8, LAWS, NONE, REFERENCE
from benchmarks.bench2_pairs import FIGURES, JUDGED, Rows, alike, asked, cases_of, of_seeds
from benchmarks.bench2_score import ALPHA, compared

PATH = "round"
SHOWS = """\
* **The first places cannot be told apart**: no comparison by truth decides between the first {plain_alike} entries of
  the plain class, nor between the first {learning_alike} of the self-calibrated one.
* **The filter makes most of it.** On the closed path the camera error of {names} is {plain_camera_none} cm without an
  estimator, {plain_camera_ekf} cm with `ekf`. Their truth error stays where the wrong calibration puts it
  ({plain_truth_none} and {plain_truth_ekf} cm). With self-calibration it is {learning_truth_none} and
  {learning_truth_ekf} cm.
* **The law makes less of it.** With `ekf`, the others of these laws are better than `{reference}` in {law_better} of
  {law_count} comparisons by truth and worse in {law_worse}; {law_unknown} cannot be told after correction.
* **Where wheels slip fewer runs settle with `ekf`** (why was not tested): of {slip_count} runs {slip_none} with none,
  {slip_predict} with `predict`, {slip_ekf} with `ekf`.
* **A wrong camera hides which entry is nearer.** Errors decide {plain_truth} of {pair_count} comparisons in truth and
  {plain_camera} by camera (plain), {learning_truth} and {learning_camera} self-calibrated; in opposite ways
  {plain_opposite} and {learning_opposite}.
* **The paper's law comes to the path from few of these starts**: {paper_best} of {paper_count} runs at best
  ({paper_name}). Its gains were chosen for single starts.
"""


def shows(rows: Rows) -> str:
    cases = {
        name: cases_of(rows, of_class) for name, of_class in zip(("plain", "learning"), CLASSES, strict=True)
    }
    paths = {name: next(case for case in these if case.startswith(PATH)) for name, these in cases.items()}
    seeds = len(rows[f"{REFERENCE}, {EKF}", paths["plain"]].settled)
    sound = [
        law
        for law in LAWS
        if all(_settled(rows, law, one, (path,)) == seeds for one in (NONE, EKF) for path in paths.values())
    ]
    values: dict[str, object] = {
        f"{name}_{figure}_{one}": _span(rows, sound, one, path, figure)
        for name, path in paths.items()
        for figure in FIGURES
        for one in (NONE, EKF)
    }
    for name, these in cases.items():
        values |= {f"{name}_{word}": count for word, count in _decided(rows, these).items()}
        values[f"{name}_alike"] = alike(rows, dict(zip(cases, CLASSES, strict=True))[name])
    slip = [case for these in cases.values() for case in these if case.startswith("slip")]
    values |= {f"slip_{one}": sum(_settled(rows, law, one, slip) for law in LAWS) for one in ESTIMATORS}
    papers = {
        f"{law}, {one}": _settled(rows, law, one, cases["plain"])
        for law in (FIG_6, FIG_8)
        for one in ESTIMATORS
    }
    best = max(papers, key=lambda name: papers[name])
    text = SHOWS.format(
        names=", ".join(f"`{law}`" for law in sound),
        reference=REFERENCE,
        slip_count=len(LAWS) * len(slip) * seeds,
        paper_best=papers[best],
        paper_count=len(cases["plain"]) * seeds,
        paper_name=best,
        **values,
        **_of_laws(rows, [law for law in sound if law != REFERENCE]),
        pair_count=len(list(combinations(ENTRIES, 2))) * len(cases["plain"]),
    )
    return "".join(_filled(bullet) + "\n" for bullet in text.rstrip().split("\n* "))


def _filled(bullet: str) -> str:
    text = " ".join(bullet.removeprefix("* ").split())
    return fill(f"* {text}", 120, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def _settled(rows: Rows, law: str, estimator: str, cases: list[str] | tuple[str, ...]) -> int:
    return sum(rows[f"{law}, {estimator}", case].settled.count("1") for case in cases)


def _span(rows: Rows, laws: list[str], estimator: str, case: str, figure: str) -> str:
    """The least and the largest of the laws' median errors in cm."""
    errors = [median(of_seeds([rows[f"{law}, {estimator}", case]], figure)) for law in laws]
    return f"{min(errors):.2f} to {max(errors):.2f}"


def _of_laws(rows: Rows, laws: list[str]) -> dict[str, int]:
    results = [asked(rows, f"{REFERENCE}, {EKF}", f"{law}, {EKF}") for law in laws]
    verdicts = [one.verdict("truth") for result in results for one in result.values()]
    counts = {"better": verdicts.count(1), "worse": verdicts.count(-1), "unknown": verdicts.count(0)}
    return {"law_count": len(verdicts)} | {f"law_{name}": count for name, count in counts.items()}


def _decided(rows: Rows, cases: list[str]) -> dict[str, int]:
    """Of all pairs of entries: how many errors decide, by each figure, and how many in opposite ways."""
    pairs = [(first, second, case) for first, second in combinations(ENTRIES, 2) for case in cases]
    alpha = ALPHA / (len(pairs) * JUDGED)
    results = [compared(rows[first, case], rows[second, case], alpha) for first, second, case in pairs]
    verdicts = [[one.verdict(figure) for figure in FIGURES] for one in results if not one.settles]
    return {figure: sum(one[at] != 0 for one in verdicts) for at, figure in enumerate(FIGURES)} | {
        "opposite": sum(truth * camera < 0 for truth, camera in verdicts)
    }
