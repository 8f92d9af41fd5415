"""The runs whose bits are frozen: `python -m tests.sim.digests` says which differ, `--write` puts the new digests down.

With names of runs it prints their digests: `python -m tests.sim.digests "fig6 0.5 s seed 7"`.

Every built-in scenario, every kind of camera and picture noise, every profile of the radio, both variants, every
disturbance, and two teams: at full length with seed 7, beside a short run for engines and machines that are slow.
`board_digests.json`: every scenario file of the boards among the examples as `mirotwin test` runs it; a car with noise
and an encoder, one that drives over a line; a robot whose board is a net list; and parts alone. First the short ones.

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
BOARDS = ROOT / "tests" / "vectors" / "board_digests.json"
SHORT = "fig6 0.5 s seed 7"
NOISY = (
    "examples/boards/car/emergency.scenario.toml {} s seed 7 --set board.parts.eyes.noise_cm=0.5"
    ' --set board.parts.wheel={{part="encoder",pins={{shaft="left.shaft",a="P3.4",b="P3.5"}},lines=200}}'
)
ON_A_PLANE = (
    "examples/boards/car/drives.scenario.toml {} s seed 7 --set board.parts.car.lines=[[[49,90],[49,110]]]"
    ' --set board.parts.line={{part="line_sensors",pins={{body="car.body",s1="P1.4",s2="P1.5",s3="P1.6"}}}}'
)
SHORTEST_BOARDS = (
    "examples/boards/modbus/coils.scenario.toml 0.2 s seed 0",
    NOISY.format("0.2"),
    ON_A_PLANE.format("0.25"),
    "net list: fig6 0.06 s seed 7",
    "parts: 200 steps seed 1",
)
"""Those that uncompiled code runs through in a second or two."""
SHORT_BOARDS = (
    *SHORTEST_BOARDS,
    "examples/boards/car/emergency.scenario.toml 0.4 s seed 0",
    "examples/boards/rover/turns.scenario.toml 0.4 s seed 0",
    "examples/boards/follower/turns.scenario.toml 0.5 s seed 0",
)
"""Those that an emulated processor runs through in seconds."""
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
    kind, _, rest = name.rpartition(": ")
    return _OF_KIND[kind](rest)


def _of_scenario(name):
    if parse(name).scenario.endswith(".scenario.toml"):
        from tests.sim import board_runs

        return board_runs.digest(parse(name))
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


def _of_net_list(name):
    """Of a run whose robots have net lists in place of the compiled board."""
    from tests.sim.netlist.net_board import NetBoard
    from tests.sim.netlist.runs import boards_are

    with boards_are(NetBoard):
        return _of_scenario(name)


def _of_parts(name):
    """Of parts on nets without a processor, `N steps seed N`: motors, encoders, a servo, and what belongs to them."""
    from tests.sim.plant import part_session

    steps, _, _, seed = name.split()
    return part_session.digest(int(seed), int(steps)).split()[0]


_OF_KIND = {"": _of_scenario, "net list": _of_net_list, "parts": _of_parts}


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


def board_names():
    """Of all runs of boards, the short ones first."""
    from miro_sim.scenario.board_scenario import load_any

    yield from SHORT_BOARDS
    for path in sorted(ROOT.glob("examples/boards/*/*.scenario.toml")):
        scenario = load_any(str(path)).scenario
        yield f"{path.relative_to(ROOT).as_posix()} {scenario.duration_ticks / scenario.clock:g} s seed 0"
    yield NOISY.format("1.5")
    yield f"net list: {SHORT}"
    yield "parts: 1000 steps seed 2"


def _name(scenario, *settings):
    from miro_sim.scenario.file import load

    duration_s = load(str(ROOT / scenario) if "/" in scenario else scenario).scenario.duration_s
    return f"{scenario} {duration_s:g} s seed 7" + "".join(
        f" --set {one.replace(' ', '')}" for one in settings
    )


def table_in(path):
    """Name of a run -> its digest."""
    return json.loads(path.read_text()) if path.exists() else {}


def main():
    """Exit code 1 if runs of the table differ, 3 if the engine is refused."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="*", help="print this run's digest")
    parser.add_argument("--write", action="store_true", help="for a change of bits that is meant")
    parser.add_argument(
        "--engine", choices=engine.ENGINES, default="compiled", help="python: uncompiled, for minutes"
    )
    options = parser.parse_args()
    try:
        engine.select(options.engine)
        for name in options.name:
            print(digest(name), flush=True)
        if options.name:
            return 0
        tables = {GOLDEN: list(names()), BOARDS: list(board_names())}
        wanted = [name for table in tables.values() for name in table]
        with children.pool() as pool:
            digests = pool.map(partial(_digest, options.engine), wanted)
            found = dict(zip(wanted, digests, strict=True))
    except engine.EngineError as error:
        print(error, file=sys.stderr)
        return REFUSED
    golden = {name: digest for path in tables for name, digest in table_in(path).items()}
    differing = [name for name in {**golden, **found} if golden.get(name) != found.get(name)]
    for name in differing:
        print(name)
    if options.write:
        for path, table in tables.items():
            path.write_text(json.dumps({name: found[name] for name in table}, indent=1) + "\n")
    return 1 if differing and not options.write else 0


def _digest(engine_name, name):
    """In a process of the pool."""
    engine.select(engine_name)
    return digest(name)


if __name__ == "__main__":
    raise SystemExit(main())
