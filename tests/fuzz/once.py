"""One input of one target: `python -m tests.fuzz.once TARGET ENGINE FILE`; what came of it, or the traceback."""

import sys
from pathlib import Path


def main():
    name, engine, path = sys.argv[1:]
    from miro_exact.engine import select

    select(engine)
    from tests.fuzz.catalogue import TARGETS

    print(TARGETS[name].make()(Path(path).read_bytes()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
