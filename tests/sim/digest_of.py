"""A run's digest, in this process's engine: `python -m tests.sim.digest_of --engine compiled "fig6 0.5 s seed 7"`."""

import argparse
import re
import sys
from typing import NamedTuple

from miro_exact import engine

REFUSED = 3
"""Exit code where this Python or its engine is refused; the reason stands in one line on stderr."""

_NAME = re.compile(
    r"(?P<scenario>\S+) (?P<duration_s>[0-9.]+) s seed (?P<seed>[0-9]+)(?P<settings>( --set \S+)*)"
)


class Entry(NamedTuple):
    """A run: a scenario, with settings, cut to a duration, with a seed."""

    scenario: str
    duration_s: float
    seed: int
    settings: tuple[str, ...]


def parse(name):
    """The entry of a name like `fig6 0.5 s seed 7 --set camera.kind=gaussian`. Raises ValueError if it is none."""
    match = _NAME.fullmatch(name)
    if match is None:
        raise ValueError(f"{name!r} names no run: write it like 'fig6 0.5 s seed 7'")
    settings = tuple(match["settings"].split(" --set ")[1:])
    return Entry(match["scenario"], float(match["duration_s"]), int(match["seed"]), settings)


def digest(name):
    """Runs it from begin to end."""
    import msgspec

    from miro_robot.firmware import image_path
    from miro_robot.image import load_hex
    from miro_sim.scenario import file as scenario_file
    from miro_sim.world.world import World

    entry = parse(name)
    loaded = scenario_file.load(entry.scenario, entry.settings)
    scenario = msgspec.structs.replace(loaded.scenario, duration_s=entry.duration_s)
    world = World(scenario, entry.seed, load_hex(image_path()))
    while not world.finished:
        world.step()
    return world.digest


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="+")
    parser.add_argument("--engine", choices=engine.ENGINES, default="compiled")
    options = parser.parse_args()
    try:
        engine.select(options.engine)
    except engine.EngineError as error:
        print(error, file=sys.stderr)
        sys.exit(REFUSED)
    for name in options.name:
        print(digest(name), flush=True)


if __name__ == "__main__":
    main()
