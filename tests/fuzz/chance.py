"""One target by chance, in a process of its own.

python -m tests.fuzz.chance TARGET ENGINE SECONDS SEED FINDINGS SEEDS
"""

import faulthandler
import sys
import traceback
from pathlib import Path

HANGS_S = 200  # the sanitizers may be there


def main():
    """0, or 1 after a finding."""
    name, engine, limit_s, seed, findings, seeds = sys.argv[1:]
    from miro_exact.engine import select

    select(engine)
    from tests.fuzz import corpus, mutation
    from tests.fuzz.catalogue import TARGETS

    target = TARGETS[name]
    inner = target.make()
    inputs = [path.read_bytes() for path in sorted(Path(seeds).glob("*"))]
    with open(Path(findings) / "last", "wb", buffering=0) as last:

        def run(data):
            last.seek(0)
            last.truncate()
            last.write(data)
            faulthandler.dump_traceback_later(HANGS_S, exit=True)
            return inner(data)

        try:
            outcomes = mutation.campaign(name, target, run, inputs, int(seed), float(limit_s), 1 << 62)
        except mutation.Broken as broken:
            faulthandler.cancel_dump_traceback_later()
            path = Path(findings) / f"crash-{corpus.file_name(broken.data)}"
            path.write_bytes(broken.data)
            traceback.print_exception(broken.__cause__)
            print(f"Test unit written to {path}")
            return 1
    faulthandler.cancel_dump_traceback_later()
    (Path(findings) / "last").unlink()
    print(f"outcomes: {len(outcomes)}, inputs: {outcomes.total()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
