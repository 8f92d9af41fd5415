"""How long fuzzing takes to find each planted mistake: AFL++ beside Hypothesis alone.

    python -m benchmarks.fuzz_time [--limit 60] [--seeds 3] [--engines afl hypothesis] [--only NAME ..]
    python -m benchmarks.fuzz_time --planted [--limit 20]     # the other table: mistakes of tests.mutants.planted
    python -m benchmarks.fuzz_time --write                    # fuzz_time*.csv and docs/background/fuzzing.md

Trials run one after the other, one process of the engine each. Their results stand in `build/mutants/fuzz_time.json`;
what stands there for the same image, and was found or not within that limit, is not measured again without `--again`.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator, Mapping

import msgspec

from benchmarks.fuzz_time_tables import EASY, HARD, PAGE, hard_table, planted_table, render, replaced, rows_of
from benchmarks.fuzz_time_trial import ENGINES, Trial, Wanted, measured
from tests.mutants.build import CACHE, build
from tests.mutants.draw import source_files
from tests.mutants.for_fuzzing import FOR_FUZZING
from tests.mutants.planted import PLANTED

RESULTS = CACHE / "fuzz_time.json"
LIMIT_S, PLANTED_LIMIT_S = 60.0, 20.0


class Results(msgspec.Struct):
    """`trials` by what was tried, and the load of the machine when the last one began."""

    trials: dict[str, Trial] = {}
    load: float = 0.0


def results() -> Results:
    """Those that are kept."""
    return msgspec.json.decode(RESULTS.read_bytes(), type=Results) if RESULTS.exists() else Results()


def wanted(
    names: Mapping[str, tuple[str, dict[str, str]]],
    engines: list[str],
    seeds: int,
    limit_s: float,
    table: str,
) -> Iterator[Wanted]:
    """The trials of a table: all mistakes by all engines with one seed, then with the next one."""
    for seed in range(1, seeds + 1):
        for engine in engines:
            for name, (check, changed) in names.items():
                yield Wanted(table, name, check, engine, seed, limit_s, build(changed).folder.name)


def _for_fuzzing() -> dict[str, tuple[str, dict[str, str]]]:
    sources = source_files()
    return {name: (one.check, one.applied(sources)) for name, one in FOR_FUZZING.items()}


def _planted() -> dict[str, tuple[str, dict[str, str]]]:
    """No check is named: any that fails will do."""
    sources = source_files()
    return {name: ("", {one.file: one.applied(sources[one.file])}) for name, one in PLANTED.items()}


def _keep(found: Results) -> None:
    part = RESULTS.with_suffix(".part")
    part.write_bytes(msgspec.json.encode(found))
    part.rename(RESULTS)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--limit", type=float, help="seconds of processor time a trial may take")
    parser.add_argument("--seeds", type=int)
    parser.add_argument("--engines", nargs="+", choices=ENGINES)
    parser.add_argument("--only", nargs="+", metavar="NAME", default=[])
    parser.add_argument("--planted", action="store_true")
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    if not asked.write:
        _measure(asked)
    trials = results().trials.values()
    hard, planted = hard_table(trials), planted_table(trials)
    print(hard, planted, sep="\n")
    if asked.write:
        HARD.write_text(hard, "utf-8")
        EASY.write_text(planted, "utf-8")
        part = render(rows_of(HARD), rows_of(EASY))
        PAGE.write_text(replaced(PAGE.read_text("utf-8"), part), "utf-8")


def _measure(asked: argparse.Namespace) -> None:
    table = "planted" if asked.planted else "for fuzzing"
    names = _planted() if asked.planted else _for_fuzzing()
    if unknown := sorted(set(asked.only) - set(names)):
        raise SystemExit(f"there is no mistake {unknown[0]!r}; use one of: {'; '.join(names)}")
    chosen = {name: one for name, one in names.items() if not asked.only or name in asked.only}
    engines = asked.engines or list(ENGINES)
    limit_s = asked.limit or (PLANTED_LIMIT_S if asked.planted else LIMIT_S)
    for one in wanted(chosen, engines, asked.seeds or 3, limit_s, table):
        found = results()
        known = found.trials.get(one.key)
        if known and not asked.again and known.answers(one):
            continue
        found.load = os.getloadavg()[0]
        trial = measured(one)
        found.trials[one.key] = trial
        _keep(found)
        print(trial, flush=True)


if __name__ == "__main__":
    main()
