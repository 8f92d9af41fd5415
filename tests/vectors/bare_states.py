"""Ten runs of `fw run` and ten cases of `fuzz --bare` whose end is frozen: `python -m tests.vectors.bare_states` names
those that differ, `--write` puts the new ones down. With names it prints these.

An end is why and at which cycle a run was over, its verdict, and a hash: the CPU by its own table of state, external
RAM, characters sent with their ticks, and faults. The edges of the serial lines are left out: which ones are kept, and
which are known ahead, is the wiring's affair.
"""

import argparse
import hashlib
import json
import sys
import tempfile
from pathlib import Path

from miro_exact import engine
from tests.children import ROOT

GOLDEN = ROOT / "tests" / "vectors" / "bare_states.json"
SHORT = ("fw run: code in XRAM, from a start address", "case: no_fault, asleep")
"""Those that uncompiled code runs through in a second."""


def end(name):
    """How the run of this name ends."""
    from tests.vectors import bare_adapter, bare_runs

    kind, _, of = name.partition(": ")
    with tempfile.TemporaryDirectory() as folder:
        if kind == "case":
            ended = bare_adapter.run_case(bare_runs.CASES_OF_TARGETS[of], Path(folder))
        else:
            ended = bare_adapter.run_image(bare_runs.RUNS[of], Path(folder))
    cpu = sorted(
        (path, value)
        for path, value in ended.cpu.items()
        if not _is_line(path) and not _is_no_short(path, value)
    )
    seen = repr((cpu, ended.xram.hex(), ended.sent, ended.faults))
    return {
        "ended": f"{ended.why} at cycle {ended.cycles}",
        "verdict": ended.verdict,
        "sent": len(ended.sent),
        "sha256": hashlib.sha256(seen.encode()).hexdigest(),
    }


def _is_line(path):
    return any(f".{line}." in path for line in ("rxd", "txd"))


def _is_no_short(path, value):
    """True for the field of a pin's hardware fault, which no run here has; one that is set stays."""
    return path.endswith((".short1", ".short3")) and value == 0


def names():
    """Of all of them."""
    from tests.vectors.bare_runs import CASES_OF_TARGETS, RUNS

    return [*(f"fw run: {name}" for name in RUNS), *(f"case: {name}" for name in CASES_OF_TARGETS)]


def main():
    """Exit code 1 if some differ."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="*", help="print how this one ends")
    parser.add_argument("--write", action="store_true", help="for a change that is meant")
    parser.add_argument("--engine", choices=engine.ENGINES, default="compiled")
    options = parser.parse_args()
    engine.select(options.engine)
    found = {name: end(name) for name in options.name or names()}
    if options.name:
        json.dump(found, sys.stdout, indent=1)
        print()
        return 0
    golden = json.loads(GOLDEN.read_text()) if GOLDEN.exists() else {}
    differing = [name for name in {**golden, **found} if golden.get(name) != found.get(name)]
    print("\n".join(differing), end="\n" if differing else "")
    if options.write:
        GOLDEN.write_text(json.dumps(found, indent=1) + "\n")
    return 1 if differing and not options.write else 0


if __name__ == "__main__":
    raise SystemExit(main())
