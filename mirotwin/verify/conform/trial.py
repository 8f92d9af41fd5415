"""A rule's trial: the world in which it is tried, what is said in it, and what is expected.

Robots stand far apart; the radio has no errors; the camera sees nothing, because nobody steers. A trial depends on its
rule alone: the seed changes the noise on RXD between keyed frames, and nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_protocol.actions import ScriptItem
from miro_protocol.transmission import Transmission
from miro_sim.scenario.file import parse
from miro_sim.scenario.keys import Scenario
from miro_sim.world.world import World
from mirotwin.verify.conform.rule import Rule, Topology
from mirotwin.verify.conform.trial_script import Expectation, TrialScript

MOST_FAULTS = 1000
LOOK_TICKS = 24_000
"""In the first control period faults are counted so often: a fault in each instruction makes 2000 a millisecond."""
_HEAD = """
name = "{name}"
title = "conformance, rule {id}"
duration_s = {duration_s!r}
stop_on_fault = false
camera = {{ kind = "gaussian", position_error_cm = 0.0, heading_error_deg = 0.0, pixel_cm = 0.0, delay_frames = 0 }}

[expect]
conforms_to = "{id}"

[lm629]
busy_clocks = {lm629.busy_clocks}
reset_clocks = {lm629.reset_clocks}
reset_disarms_breakpoint = {disarms}
"""
_NETWORK = """
[[network]]
robots = {robots}
host = "silent"
radio = {{ bit_error_rate = 0.0, carrier = "{carrier}", squelch = {squelch}, baud_offset_ppm = {offset} }}
"""
_ROBOT = """
[[network.robot]]
slot = {slot}{strap}
wheel_radius_mismatch = 0.0
reference = {{ kind = "line", drive_s = 0.0, start_x_cm = {x_cm}, start_y_cm = {y_cm} }}
"""
_PLACES = [(x_cm, y_cm) for y_cm in (15.0, 55.0, 35.0) for x_cm in (10.0, 40.0, 70.0, 100.0)]


@dataclass(frozen=True)
class Trial:
    """What happens and what is expected of it, by network."""

    rule: Rule
    scenario: Scenario
    script: tuple[ScriptItem, ...]
    expected: tuple[tuple[Expectation, ...], ...]

    @property
    def transmissions(self) -> list[Transmission]:
        return [one for one in self.script if isinstance(one, Transmission)]


@lru_cache(maxsize=128)
def trial_of(rule: Rule) -> Trial:
    """The trial of a rule, made once."""
    return make_trial(rule)


def make_trial(rule: Rule) -> Trial:
    scripts = [TrialScript(topology, index) for index, topology in enumerate(rule.topologies)]
    for script in scripts:
        rule.write(script)
    end_tick = max(one.tick for script in scripts for one in script.expected)
    items: list[ScriptItem] = []
    for script in scripts:
        items += [*script.said, *script.done]
    items.sort(key=lambda one: one.tick)
    # everything before the end is told, so the last expectation needs a tick more
    periods = end_tick // CONTROL_PERIOD_TICKS + 1
    scenario = parse(_text(rule, seconds(periods * CONTROL_PERIOD_TICKS)), rule.id, ())
    return Trial(rule, scenario, tuple(items), tuple(tuple(script.expected) for script in scripts))


def _text(rule: Rule, duration_s: float) -> str:
    places = iter(_PLACES)
    text = _HEAD.format(
        name=f"conform-{rule.id.lower()}",
        id=rule.id,
        duration_s=duration_s,
        lm629=rule.lm629,
        disarms="true" if rule.lm629.reset_disarms_breakpoint else "false",
    )
    return text + "".join(_network(topology, places) for topology in rule.topologies)


def _network(topology: Topology, places: Iterator[tuple[float, float]]) -> str:
    carrier, squelch = ("keyed", "false") if topology.keyed else ("on", "true")
    text = _NETWORK.format(
        robots=topology.robots, carrier=carrier, squelch=squelch, offset=topology.baud_offset_ppm
    )
    for slot in topology.slots:
        x_cm, y_cm = next(places)
        strap = "" if topology.strap is None else f"\nstrap = {topology.strap}"
        text += _ROBOT.format(slot=slot, strap=strap, x_cm=x_cm, y_cm=y_cm)
    return text


def run_trial(world: World) -> None:
    """To its end, or after a thousand firmware faults."""
    while not world.finished and fault_count(world) < MOST_FAULTS:
        world.run_to(world.tick + (LOOK_TICKS if world.tick < CONTROL_PERIOD_TICKS else CONTROL_PERIOD_TICKS))


def fault_count(world: World) -> int:
    return sum(robot.board.fault_count for robot in world.robots)
