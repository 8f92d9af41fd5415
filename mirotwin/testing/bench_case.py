"""What failed on the bench as a case: the robot of a world hears the same characters, and a check fails there.

The bench compares counters, a world has checks; so those are tried that say what counters mean. Where none fails there
is no case: the state changed by saving, a count of rejected frames.
"""

from __future__ import annotations

from typing import Any

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_protocol.actions import Reset, ScriptItem
from miro_protocol.transmission import Transmission
from miro_sim.world.world import World
from mirotwin.testing.bench import LOOKING_TICKS, Bench
from mirotwin.verify.cases.case import case_of_checks
from mirotwin.verify.cases.trace import Trace
from mirotwin.verify.checks.watching import Checks
from mirotwin.verify.wanted import silent_scenario

_RESET_TICKS = 48
"""How long the pin is held: two machine cycles are enough (AT89C52 data sheet), these are four."""


def case_of_bench(bench: Bench) -> str | None:
    """The case of what the robot has heard on `bench` since power-on; None where no check fails by it."""
    end_tick = bench.now + LOOKING_TICKS
    periods = -(-end_tick // CONTROL_PERIOD_TICKS)
    settings = (
        *(f"network.robots={bench.n}", f"network.robot.slot={bench.slot}", 'network.radio.carrier="on"'),
        f"duration_s={seconds(periods * CONTROL_PERIOD_TICKS) + 1.0}",
    )
    scenario = msgspec.structs.replace(silent_scenario(settings), expect=_expected(bench))
    heard = [entry.what for entry in bench.heard_stream()]
    script: list[ScriptItem] = [sent for sent in heard if isinstance(sent, Transmission)]
    for tick in bench.resets:
        script += [Reset(tick, 0, bench.slot, 1), Reset(tick + _RESET_TICKS, 0, bench.slot, 0)]
    world = World(scenario, 0, bench.image, sorted(script, key=lambda one: one.tick))
    trace, checks = Trace(world), Checks(world)
    world.run_to(periods * CONTROL_PERIOD_TICKS)
    checks.finish()
    return case_of_checks(world, trace, checks) if checks.failures else None


def _expected(bench: Bench) -> dict[str, Any]:
    expect: dict[str, Any] = {"accepts_only_sent": True, "moves_only_when_fresh": True}
    if bench.freshness.accepted:
        expect["frames_accepted_min"] = bench.freshness.accepted
    return expect
