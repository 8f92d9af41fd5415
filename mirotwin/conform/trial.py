"""A rule's trial: its world, the frames sent, and the expectations.

Robots are placed far apart; the radio has no errors; the camera sees nothing, because no host steers. A trial depends
on its rule only: the seed changes the noise on RXD between keyed frames, and nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from operator import attrgetter

from msgspec import to_builtins

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_protocol.actions import ScriptItem
from miro_protocol.transmission import Transmission
from miro_robot.image import Image
from miro_sim.scenario.file import of_table
from miro_sim.scenario.keys import Scenario
from miro_sim.world.world import World
from mirotwin.conform.rule import Rule, Topology
from mirotwin.conform.trial_script import TrialExpectation, TrialScript
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.verify.checks.interface import Check, Subject

MOST_FAULTS = 1000
LOOK_TICKS = 24_000  # a millisecond
"""In the first control period faults are counted so often: a fault in each instruction makes 2000 a millisecond."""
_BLIND = {
    "kind": "gaussian",
    "position_error_cm": 0.0,
    "heading_error_deg": 0.0,
    "pixel_cm": 0.0,
    "delay_frames": 0,
}
# far apart: robots of a trial turn on the spot, or drive some centimetres, and never touch
_PLACES = [(x_cm, y_cm) for y_cm in (15.0, 55.0, 35.0) for x_cm in (10.0, 40.0, 70.0, 100.0)]


@dataclass(frozen=True)
class Trial:
    """A trial: scripts and expectations by network."""

    scenario: Scenario
    script: tuple[ScriptItem, ...]
    expected: tuple[tuple[TrialExpectation, ...], ...]

    def transmissions_of(self, network: int) -> list[Transmission]:
        """The transmissions of a network's host."""
        return [item for item in self.script if isinstance(item, Transmission) and item.network == network]

    def expected_of(self, subject: Subject) -> list[TrialExpectation]:
        """The expectations of a robot."""
        return [expected for expected in self.expected[subject.network] if subject.slot in expected.slots]


@lru_cache(maxsize=128)
def trial_of(rule: Rule) -> Trial:
    """The trial of a rule, made once."""
    scripts = [TrialScript(topology, index) for index, topology in enumerate(rule.topologies)]
    for script in scripts:
        rule.write(script)
    items: list[ScriptItem] = [item for script in scripts for item in (*script.sent, *script.done)]
    end_tick = max(reaction.tick for script in scripts for reaction in script.expected)
    # everything before the end is reported, so the last expectation needs a tick more
    periods = end_tick // CONTROL_PERIOD_TICKS + 1
    places = iter(_PLACES)
    scenario = {
        "name": f"conform-{rule.id.lower()}",
        "title": f"conformance, rule {rule.id}",
        "duration_s": seconds(periods * CONTROL_PERIOD_TICKS),
        "stop_on_fault": False,
        "camera": _BLIND,
        "expect": {"conforms_to": rule.id},
        "lm629": to_builtins(rule.lm629),
        "network": [_network(topology, places) for topology in rule.topologies],
    }
    items.sort(key=attrgetter("tick"))
    expected = tuple(tuple(script.expected) for script in scripts)
    return Trial(of_table(scenario, rule.id), tuple(items), expected)


def _network(topology: Topology, places: Iterator[tuple[float, float]]) -> dict[str, object]:
    robots = [
        {
            "slot": slot,
            "strap": topology.strap,
            "wheel_radius_mismatch": 0.0,
            "reference": {"kind": "line", "drive_s": 0.0, "start_x_cm": x_cm, "start_y_cm": y_cm},
        }
        for slot, (x_cm, y_cm) in zip(topology.slots, places, strict=False)
    ]
    radio = {
        "bit_error_rate": 0.0,
        "carrier": "keyed" if topology.keyed else "on",
        "squelch": not topology.keyed,
        "baud_offset_ppm": topology.baud_offset_ppm,
    }
    return {"robots": topology.robots, "host": "silent", "radio": radio, "robot": robots}


def run_trial(trial: Trial, check: Check, image: Image, seed: int) -> Run:
    """Runs the trial with one check for each robot, to its end or to a thousand firmware faults."""
    places = [
        (index, robot.slot)
        for index, network in enumerate(trial.scenario.networks)
        for robot in network.robot
    ]
    spec = RunSpec(
        scenario=trial.scenario,
        image=image,
        seed=seed,
        script=trial.script,
        expected={place: [check] for place in places},
    )
    run = Run.traced(spec)
    world = run.world
    while not world.finished and fault_count(world) < MOST_FAULTS:
        world.run_to(world.tick + (LOOK_TICKS if world.tick < CONTROL_PERIOD_TICKS else CONTROL_PERIOD_TICKS))
    run.finish()
    return run


def fault_count(world: World) -> int:
    return sum(robot.board.fault_count for robot in world.robots)
