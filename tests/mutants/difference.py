"""What two firmwares do otherwise, seen from outside: on the LM629 bus and on TXD, for the same characters on RXD.

    python -m tests.mutants.difference failsafe.c:71:13:condition:not [--seconds 20] [--seed 0]

"The same" over a long random stimulus is no proof that a mutant is equivalent, but shows where reading is worth it; a
difference in time alone says by how much. With other times positions are others too: commands that only read are left
out, and of an answer neither the positions nor its CRC are compared.
"""

import argparse
import sys
from typing import NamedTuple

import msgspec

from miro_exact.clock import TICKS_PER_SECOND
from miro_protocol.table import TELEMETRY
from miro_protocol.transmission import UP, character_ticks
from miro_robot.image import load_hex
from miro_robot.lm629.commands import BY_OPCODE
from miro_sim.scenario.file import parse
from miro_sim.world.events import Cursor
from miro_sim.world.world import World
from tests.mutants.build import build, shipped
from tests.mutants.draw import mutants_of, source_files
from tests.mutants.planted import PLANTED
from tests.mutants.stimulus import Host

NETWORKS = ((3, 1), (5, 4))
"""(robots, slot that is there)"""
_SCENARIO = """
name = "difference"
duration_s = {seconds}
stop_on_fault = false

[[network]]
radio = {{ bit_error_rate = 0.0, squelch = true }}
robots = 3
robot = [{{ slot = 1, reference = {{ kind = "line", drive_s = 2.0 }} }}]

[[network]]
radio = {{ bit_error_rate = 0.0, squelch = true }}
robots = 5
robot = [{{ slot = 4, reference = {{ kind = "line", drive_s = 2.0 }}, start_error_x_cm = 30.0 }}]
"""
SEEN = ("command", "transmitted", "fault")
_AT_PAYLOAD = TELEMETRY.wire_size - TELEMETRY.payload_size - 2
MEASURED = frozenset(
    (*range(_AT_PAYLOAD + 3, _AT_PAYLOAD + 7), *range(TELEMETRY.wire_size - 2, TELEMETRY.wire_size))
)
"""Places in an answer: both positions, and the CRC."""


class Difference(NamedTuple):
    """`first`: what differs first but for its time, "" if nothing does; `late_us`: the most by which a time differs."""

    first: str
    late_us: float

    def __str__(self):
        return self.first or (f"the same, up to {self.late_us:g} us apart" if self.late_us else "the same")


def seen_of(image, seconds, seed):
    """What each robot did, in the order of time."""
    scenario = parse(_SCENARIO.format(seconds=float(seconds)), "difference")
    end_tick = int(seconds * TICKS_PER_SECOND)
    hosts = [Host(seed, index, n, slot) for index, (n, slot) in enumerate(NETWORKS)]
    script = [sent for host in hosts for sent in host.transmissions(end_tick)]
    world = World(scenario, seed, load_hex(image), script)
    seen = [[] for _ in hosts]
    cursors = [Cursor(world.robot(index, slot).log) for index, (_, slot) in enumerate(NETWORKS)]

    def look(period):
        for found, cursor in zip(seen, cursors, strict=True):
            found += [event for _, event in cursor.read() if _counts(event)]

    world.observers.append(look)
    while not world.finished:
        world.step()
    return [_without_positions(sorted(events, key=lambda event: event.tick)) for events in seen]


def _without_positions(events):
    """In answers, which begin after a pause, the characters of positions and CRC are 0."""
    place, last_tick, found = 0, 0, []
    for event in events:
        if event.what == "transmitted":
            place = place + 1 if event.tick - last_tick < 2 * character_ticks(UP) else 0
            last_tick = event.tick
            if place in MEASURED:
                event = msgspec.structs.replace(event, value=0)
        found.append(event)
    return found


def difference(one, other):
    """Between what two images did under the same stimulus."""
    late = 0
    for mine, theirs in zip(one, other, strict=True):
        for place, event in enumerate(mine):
            if place == len(theirs):
                return Difference(f"{event}; then nothing more", late / 24)
            if _content(event) != _content(theirs[place]):
                return Difference(f"{event}; the other: {theirs[place]}", late / 24)
            late = max(late, abs(event.tick - theirs[place].tick))
        if len(theirs) > len(mine):
            return Difference(f"nothing more; the other: {theirs[len(mine)]}", late / 24)
    return Difference("", late / 24)


def _counts(event):
    command = BY_OPCODE.get(event.opcode)
    return event.what in SEEN and (command is None or not command.words_out)


def _content(event):
    """What has to be the same in an event of another firmware."""
    return event.what, event.value, event.side, event.opcode, event.data


def image_of(name):
    """Of a mutant by its id, a planted one by its name, or `shipped`. ValueError for anything else."""
    sources = source_files()
    if name == "shipped":
        return shipped().image
    if name in PLANTED:
        changed = {PLANTED[name].file: PLANTED[name].applied(sources[PLANTED[name].file])}
    else:
        found = [one for one in mutants_of(sources) if one.id == name]
        if not found:
            raise ValueError(f"there is no mutant {name!r}; an id is FILE:LINE:COLUMN:OPERATOR:FORM")
        changed = {found[0].file: found[0].change.applied(sources[found[0].file])}
    built = build(changed)
    if built.error:
        raise ValueError(f"{name} does not compile: {built.error}")
    return built.image


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mutants", nargs="+", help="ids of mutants, or names of planted ones")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    right = seen_of(shipped().image, asked.seconds, asked.seed)
    for name in asked.mutants:
        try:
            image = image_of(name)
        except ValueError as error:
            sys.exit(str(error))
        print(f"{name}: {difference(right, seen_of(image, asked.seconds, asked.seed))}", flush=True)


if __name__ == "__main__":
    main()
