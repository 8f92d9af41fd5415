"""Compares runs of the compiled board and of the net list: `python -m tests.sim.netlist.runs` prints the table.

Both worlds are the same but for the boards of their robots. At the end of each control period they must agree in the
view (`net_board.py`): every field that enters a digest, of world, radio, host, robots, CPU, both LM629 and plant; the
records of the period; and what the logs of the boards got, with ticks.
"""

import argparse
import hashlib
import json
import sys
import time
from contextlib import contextmanager
from typing import NamedTuple

from msgspec.structs import replace

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.state import Flat
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world import robot as robots
from miro_sim.world.world import World
from tests.sim.digests import GOLDEN, parse
from tests.sim.netlist.net_board import NetBoard, settle


class Compared(NamedTuple):
    """`settled`: periods at whose end one board was some ticks ahead. `difference`: "" if there is none.

    `faster`: than real time, of the net list, and of the compiled board.
    """

    name: str
    periods: int
    settled: int
    events: int
    difference: str
    is_golden: bool
    faster: float
    compiled_faster: float


@contextmanager
def boards_are(make):
    """Robots of worlds that are made in here get these boards."""
    before = robots.make_board
    robots.make_board = make
    try:
        yield
    finally:
        robots.make_board = before


def pair(scenario, seed, script=None):
    """A world with compiled boards, and one with net lists."""
    image = load_hex(image_path())
    compiled = World(scenario, seed, image, script)
    with boards_are(NetBoard):
        return compiled, World(scenario, seed, image, script)


def log_since(board, serials, key):
    """What the log of a board got since the last call, in the order of noting."""
    begin, serials[key] = serials.get(key, 0), board.log.end
    return [board.log.event(serial) for serial in range(begin, board.log.end)]


def view(world, flat):
    """All that enters a digest, but for the digest of the periods before."""
    return flat.hashed().replace(world.chain, b"", 1)


def difference(worlds):
    """Where the views of two worlds differ, in words; "" if they do not."""
    flats = [Flat(world) for world in worlds]
    ours, theirs = (flat.decode(flat.save()) for flat in flats)
    parts = [f"{name} {ours[name]!r} {theirs[name]!r}" for name in ours if ours[name] != theirs[name]]
    return "; ".join(parts[:8])


class Comparison:
    """Two worlds, period by period."""

    def __init__(self, worlds):
        self.worlds = worlds
        self.flats = [Flat(world) for world in worlds]
        self.chain = hashlib.sha256()
        self.settled = 0  # periods at whose end one board was ahead of the other by some ticks
        self.serials = [{}, {}]
        self.seconds = [0.0, 0.0]
        self.events = 0

    def step(self):
        """A control period of both. Returns how they differ then, "" if they do not."""
        for number, world in enumerate(self.worlds):
            begin = time.perf_counter()
            world.step()
            self.seconds[number] += time.perf_counter() - begin
        return self.look()

    def views(self):
        return [view(world, flat) for world, flat in zip(self.worlds, self.flats, strict=True)]

    def look(self):
        """How they differ now."""
        compiled, twin = self.worlds
        views = self.views()
        if views[0] != views[1]:
            # Only then: with a drive ahead of it a camera sees the last bits of a pose otherwise.
            self.settled += 1
            for world in self.worlds:
                for device in world.devices:
                    settle(device.board)
            views = self.views()
        if views[0] != views[1]:
            return difference(self.worlds) or "the digest of a period before"
        self.chain.update(views[1])
        if replace(compiled.last, digest="") != replace(twin.last, digest=""):
            return "the records of the period"
        if compiled.finished != twin.finished:
            return "one has ended"
        logs = [
            [log_since(device.board, serials, place) for place, device in enumerate(world.devices)]
            for world, serials in zip(self.worlds, self.serials, strict=True)
        ]
        self.events += sum(len(log) for log in logs[0])
        if logs[0] != logs[1]:
            return f"the logs: {logs}"
        faults = [[device.board.faults for device in world.devices] for world in self.worlds]
        return "" if faults[0] == faults[1] else f"the faults: {faults}"


def compared(name, duration_s=None):
    """Compares a run of `digests.json`, perhaps a shorter one."""
    entry = parse(name)
    duration_s = entry.duration_s if duration_s is None else min(duration_s, entry.duration_s)
    scenario = load(entry.scenario, (*entry.settings, f"duration_s={duration_s}")).scenario
    comparison = Comparison(pair(scenario, entry.seed))
    compiled, twin = comparison.worlds
    differs = ""
    while not differs and not compiled.finished:
        differs = comparison.step()
    golden = json.loads(GOLDEN.read_text())[name]
    virtual_s = compiled.index * CONTROL_PERIOD_TICKS / 24e6
    faster = [virtual_s / seconds for seconds in comparison.seconds]
    counts = (compiled.index, comparison.settled, comparison.events)
    return Compared(name, *counts, differs, twin.digest == golden, faster[1], faster[0])


def main():
    """Exit code 1 if a run differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="*", help="of digests.json; all, if none is given")
    parser.add_argument("--duration", type=float, help="s, at most")
    options = parser.parse_args()
    differing = 0
    for name in options.name or json.loads(GOLDEN.read_text()):
        one = compared(name, options.duration)
        differing += bool(one.difference)
        golden = ", the digest of digests.json" if one.is_golden else ""
        ahead = f" ({one.settled} settled)" if one.settled else ""
        print(f"{name}: {one.periods} periods{ahead}, {one.events} events: {one.difference or 'equal'}{golden}; "
              f"{one.faster:.0f} x real time (compiled {one.compiled_faster:.0f} x)", flush=True)  # fmt: skip
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
