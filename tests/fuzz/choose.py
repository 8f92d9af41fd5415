"""Chooses the inputs that are kept, of those and all in FOLDER: `python -m tests.fuzz.choose TARGET ENGINE FOLDER ..`

Of a folder with very many, an even part of all sizes is looked at: to look at one takes ten times as long as to run it.
"""

import sys
from pathlib import Path

MOST_OF_FOLDER = 200


def main():
    name, engine, *folders = sys.argv[1:]
    from miro_exact.engine import select

    select(engine)
    from tests.fuzz import corpus
    from tests.fuzz.catalogue import TARGETS

    target = TARGETS[name]
    inputs = [data for _, data in corpus.kept(name)]
    for folder in folders:
        found = sorted((path.read_bytes() for path in Path(folder).glob("*")), key=len)
        inputs += found[:: max(1, len(found) // MOST_OF_FOLDER)]
    corpus.keep(name, corpus.chosen(target.make(), inputs, min(target.most_bytes, corpus.MOST_BYTES)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
