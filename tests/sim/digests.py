"""The runs whose bits are frozen: `python -m tests.sim.digests` says which differ, `--write` puts the new digests down.

With names of runs it prints their digests: `python -m tests.sim.digests "fig6 0.5 s seed 7"`.

Every built-in scenario, every kind of camera and picture noise, every profile of the radio, both variants, every
disturbance, and two teams: at full length with seed 7, beside a short run for engines and machines that are slow.

Functions import what has to wait until the engine is chosen.
"""

import argparse
import json
import re
import sys
from functools import partial
from importlib import resources
from pathlib import Path
from typing import NamedTuple

from miro_exact import engine
from tests import children

REFUSED = 3
"""Exit code where this Python or its engine is refused; the reason stands in one line on stderr."""
ROOT = Path(__file__).parents[2]
GOLDEN = ROOT / "tests" / "vectors" / "digests.json"
SHORT = "fig6 0.5 s seed 7"
TWO_TEAMS = "examples/two_teams.toml"
CAMERAS = (
    'camera={kind="gaussian"}',
    'camera={kind="geometric",calibration="1997"}',
    'camera={kind="geometric",calibration="none"}',
    'camera={kind="pixels",calibration="none"}',
)


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
    from miro_robot.firmware import image_path
    from miro_robot.image import load_hex
    from miro_sim.scenario.file import load
    from miro_sim.world.world import World

    entry = parse(name)
    scenario = load(entry.scenario, (*entry.settings, f"duration_s={entry.duration_s}")).scenario
    world = World(scenario, entry.seed, load_hex(image_path()))
    while not world.finished:
        world.step()
    return world.digest


def names():
    """Of all runs, the short one first."""
    from benchmarks.disturbances import CASES
    from miro_sim.scenario.profiles import tables_of

    yield SHORT
    builtin = resources.files("miro_sim.scenario") / "builtin"
    for name in sorted(
        one.name.removesuffix(".toml") for one in builtin.iterdir() if one.name.endswith(".toml")
    ):
        yield _name(name)
    yield _name(TWO_TEAMS)
    for camera in CAMERAS:
        yield _name("fig6", camera)
    for profile in tables_of("profile"):
        yield _name("fig6", f'network.radio={{profile="{profile}"}}')
    for variant in ("ideal", "realistic"):
        yield _name("fig8", f"variant={variant}")
    for case in CASES[1:]:
        yield _name("fig6", "variant=ideal", *case.settings)


def _name(scenario, *settings):
    from miro_sim.scenario.file import load

    duration_s = load(str(ROOT / scenario) if "/" in scenario else scenario).scenario.duration_s
    return f"{scenario} {duration_s:g} s seed 7" + "".join(
        f" --set {one.replace(' ', '')}" for one in settings
    )


def main():
    """Exit code 1 if runs of the table differ, 3 if the engine is refused."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="*", help="print this run's digest")
    parser.add_argument("--write", action="store_true", help="for a change of bits that is meant")
    parser.add_argument(
        "--engine", choices=engine.ENGINES, default="compiled", help="python: uncompiled, for minutes"
    )
    options = parser.parse_args()
    golden = json.loads(GOLDEN.read_text())
    try:
        engine.select(options.engine)
        for name in options.name:
            print(digest(name), flush=True)
        if options.name:
            return 0
        wanted = list(names())
        with children.pool() as pool:
            digests = pool.map(partial(_digest, options.engine), wanted)
            found = dict(zip(wanted, digests, strict=True))
    except engine.EngineError as error:
        print(error, file=sys.stderr)
        return REFUSED
    differing = [name for name in {**golden, **found} if golden.get(name) != found.get(name)]
    for name in differing:
        print(name)
    if options.write:
        GOLDEN.write_text(json.dumps(found, indent=1) + "\n")
    return 1 if differing and not options.write else 0


def _digest(engine_name, name):
    """In a process of the pool."""
    engine.select(engine_name)
    return digest(name)


if __name__ == "__main__":
    raise SystemExit(main())
