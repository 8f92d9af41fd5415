"""What failed on the bench as a case: the robot of a world hears the same characters, and a check fails there.

The bench compares counters, a world has checks; so those are tried that say what counters mean. Where none fails there
is no case: the state changed by saving, a count of rejected frames.
"""

from __future__ import annotations

from typing import Any

from miro_protocol.actions import Reset, ScriptItem
from miro_protocol.transmission import Transmission
from mirotwin.testing.bench import LOOKING_TICKS, Bench
from mirotwin.verify.cases.rerun import rerun_robot

_RESET_TICKS = 48
"""How long the pin is held: two machine cycles are enough (AT89C52 data sheet), these are four."""


def case_of_bench(bench: Bench) -> str | None:
    """The case of what the robot has heard on `bench` since power-on; None where no check fails by it."""
    heard = [entry.what for entry in bench.heard_stream()]
    script: list[ScriptItem] = [sent for sent in heard if isinstance(sent, Transmission)]
    for tick in bench.resets:
        script += [Reset(tick, 0, bench.slot, 1), Reset(tick + _RESET_TICKS, 0, bench.slot, 0)]
    until_tick = bench.now + LOOKING_TICKS
    again = rerun_robot(bench.image, bench.n, bench.slot, script, _expected(bench), until_tick)
    return again.case() if again.failures else None


def _expected(bench: Bench) -> dict[str, Any]:
    expect: dict[str, Any] = {"accepts_only_sent": True, "moves_only_when_fresh": True}
    if bench.freshness.accepted:
        expect["frames_accepted_min"] = bench.freshness.accepted
    return expect
