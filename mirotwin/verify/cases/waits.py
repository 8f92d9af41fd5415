"""What a wait that failed comes to as a check, so that its case can be judged again."""

from __future__ import annotations

from typing import Any

from miro_sim.world import conditions
from miro_sim.world.events import PC
from miro_sim.world.waits import WaitExpired

_WHAT: dict[type[conditions.Condition], str] = {
    conditions.Sent: "sent",
    conditions.Heard: "heard",
    conditions.Answer: "answer",
    conditions.Frame: "frame",
    conditions.Command: "command",
    conditions.Fault: "fault",
}


def expect_of_wait(expired: WaitExpired, after_tick: int) -> dict[str, Any] | None:
    """The check that fails as this wait did, which began after `after_tick`.

    None where no check can judge it: several conditions, pins, places in the program, predicates.
    """
    if len(expired.conditions) != 1:
        return None
    table = table_of(expired.conditions[0])
    if table is None:
        return None
    return {"happens": {**table, "after_tick": after_tick, "until_tick": expired.tick}}


def expect_of_silence(
    condition: conditions.Condition, after_tick: int, until_tick: int
) -> dict[str, Any] | None:
    """The check that fails where `condition` came true though it must not; None as above."""
    table = table_of(condition)
    if table is None:
        return None
    return {"never_happens": {**table, "after_tick": after_tick, "until_tick": until_tick}}


def table_of(condition: conditions.Condition) -> dict[str, Any] | None:
    """The keys of `happens` that say the same as `condition`."""
    what = _WHAT.get(type(condition))
    if isinstance(condition, conditions.Byte):
        what = "transmitted" if condition.sent else "received"
    if what is None:
        return None
    table: dict[str, Any] = {"what": what, "network": condition.network}
    if isinstance(condition, conditions.Answer):
        found: dict[str, Any] = {"slot": condition.robot}
    else:
        found = {"slot": None if condition.slot == PC else condition.slot}
    if isinstance(condition, conditions.Command):
        found.update({"command": condition.name, "side": condition.side})
    elif isinstance(condition, conditions.Heard | conditions.Byte):
        found.update({"value": condition.value})
    return {**table, **{key: value for key, value in found.items() if value is not None}}
