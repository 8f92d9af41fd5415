"""One target in a process of its own, whose engine is chosen before anything of ours is imported.

    python -m tests.fuzz.process TARGET ENGINE chance SECONDS SEED FINDINGS SEEDS   changes by chance
    python -m tests.fuzz.process TARGET ENGINE guided [libFuzzer's words]           under Atheris
    python -m tests.fuzz.process TARGET ENGINE choose FOLDER ..                     the inputs that are kept
    python -m tests.fuzz.process TARGET ENGINE once FILE                            one input, and what comes of it

Under Atheris, Python code of ours, and what it reads with, is instrumented when it is imported. With `compiled`
the hot modules are what the build made of them: without the sanitizers' build coverage does not see into them.
"""

import faulthandler
import sys
import traceback
from pathlib import Path

HANGS_S = 200  # the sanitizers may be there
MOST_OF_FOLDER = 200
"""Of a folder with more an even part of all sizes is looked at: that takes ten times as long as running an input."""
SEEN = ["miro_exact", "miro_protocol", "miro_robot", "miro_host", "miro_sim", "mirotwin"]
SEEN += ["serial.rfc2217", "mcap", "PIL.PngImagePlugin", "PIL.PpmImagePlugin", "PIL.ImageFile", "tomllib"]


def chance(name, limit_s, seed, findings, seeds):
    """0, or 1 after a finding."""
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


def guided(name, *words):
    """Never returns: libFuzzer ends the process."""
    import atheris

    with atheris.instrument_imports(include=SEEN, enable_loader_override=False):
        from tests.fuzz.catalogue import TARGETS

        run = TARGETS[name].make()
        run(b"")  # what is imported late

    def one(data):
        run(data)

    atheris.Setup([sys.argv[0], *words], one)
    atheris.Fuzz()


def choose(name, *folders):
    from tests.fuzz import corpus
    from tests.fuzz.catalogue import TARGETS

    target = TARGETS[name]
    inputs = corpus.kept(name)
    for folder in folders:
        found = sorted((path.read_bytes() for path in Path(folder).glob("*")), key=len)
        inputs += found[:: max(1, len(found) // MOST_OF_FOLDER)]
    corpus.keep(name, corpus.chosen(target.make(), inputs, min(target.most_bytes, corpus.MOST_BYTES)))
    return 0


def once(name, path):
    from tests.fuzz.catalogue import TARGETS

    print(TARGETS[name].make()(Path(path).read_bytes()))
    return 0


if __name__ == "__main__":
    from miro_exact.engine import select

    target_name, engine, task, *rest = sys.argv[1:]
    select(engine)
    tasks = {"chance": chance, "guided": guided, "choose": choose, "once": once}
    sys.exit(tasks[task](target_name, *rest))
