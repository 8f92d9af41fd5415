"""One target under Atheris, in a process of its own: `python -m tests.fuzz.guided TARGET ENGINE [libFuzzer's words]`.

Python code of ours, and what it reads with, is instrumented when the target imports it. With `compiled` the hot modules
are what the build made of them: without the sanitizers' build coverage does not see into them.
"""

import sys

SEEN = ["miro_exact", "miro_protocol", "miro_robot", "miro_host", "miro_sim", "mirotwin"]
SEEN += ["serial.rfc2217", "mcap", "PIL.PngImagePlugin", "PIL.PpmImagePlugin", "PIL.ImageFile", "tomllib"]


def main():
    """Never returns: libFuzzer ends the process."""
    name, engine, *words = sys.argv[1:]
    import atheris

    from miro_exact.engine import select

    select(engine)
    with atheris.instrument_imports(include=SEEN, enable_loader_override=False):
        from tests.fuzz.catalogue import TARGETS

        run = TARGETS[name].make()
        run(b"")  # what is imported late

    def one(data):
        run(data)

    atheris.Setup([sys.argv[0], *words], one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
