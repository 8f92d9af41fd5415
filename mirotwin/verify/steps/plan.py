"""Whether a run can get to a step and do it, as far as the file and the image say."""

from __future__ import annotations

import re
from collections.abc import Sequence

from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, ticks
from miro_protocol.table import DOWNLINK
from miro_robot.image import Image
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.keys import Network, Scenario
from miro_sim.world.conditions import Condition, Reached
from mirotwin.verify.steps.keys import (
    CheckStep,
    HoldStep,
    NeverStep,
    PowerStep,
    ResetStep,
    SaveStep,
    SendStep,
    Step,
    StreamStep,
    WaitStep,
    end_ms,
)
from mirotwin.verify.steps.sends import SendFrame

FILE = re.compile(r"[A-Za-z0-9_-]{1,64}\.world")


def end_tick(scenario: Scenario) -> int:
    """Where a run ends by itself: with the control period in which its duration does."""
    return max(1, -(-ticks(scenario.duration_s) // CONTROL_PERIOD_TICKS)) * CONTROL_PERIOD_TICKS


def problem(step: Step, scenario: Scenario) -> str:
    """Why this step cannot be done in this scenario, as `key: what; remedy`, or the empty string."""
    networks = scenario.networks
    if step.network >= len(networks):
        there = "there is one" if len(networks) == 1 else f"there are {len(networks)}, from 0 on"
        return f"network: there is no network {step.network}; {there}"
    network = networks[step.network]
    if isinstance(step, SendStep):
        return _of_send(step, network)
    if isinstance(step, StreamStep):
        if step.stream == "off":
            return ""
        if network.host != "silent":
            return 'stream: this network\'s host sends by itself; write host = "silent" for the network'
        shortest_ticks = DOWNLINK[network.robots].wire_size * HOST_CHARACTER_TICKS
        if step.every_ticks < shortest_ticks:
            return f"every_ms: {step.every_ms:g} is too short; a frame takes {end_ms(shortest_ticks)}"
        return _beyond(step.slot, network)
    condition = condition_of(step)
    if condition is not None:
        slot = getattr(condition, "slot", None)
        return "" if slot is None else _absent(slot, network)
    if isinstance(step, CheckStep):
        if not step.check:
            return "check: there is no check; give it keys as [expect] has them"
        return "" if step.slot is None else _absent(step.slot, network)
    if isinstance(step, ResetStep | PowerStep) and step.slot is not None:
        return _absent(step.slot, network)
    if isinstance(step, SaveStep) and not FILE.fullmatch(step.save):
        return f"save: {step.save!r} is no name of a file here; write letters, digits, - and _, and .world behind"
    return ""


def condition_of(step: Step) -> Condition | None:
    """What a step waits for, if it does."""
    return step.condition if isinstance(step, WaitStep | NeverStep | HoldStep) else None


def _of_send(step: SendStep, network: Network) -> str:
    what = step.what
    if isinstance(what, SendFrame) and what.seq is None and network.host != "silent":
        return 'seq: this network\'s host counts its frames itself; give seq, or write host = "silent"'
    return what.problem(network.robots)


def _absent(slot: int, network: Network) -> str:
    slots = sorted(robot.slot for robot in network.robot)
    if slot in slots:
        return ""
    return f"slot: there is no robot in slot {slot}; there is {', '.join(map(str, slots))}"


def _beyond(slot: int | None, network: Network) -> str:
    if slot is None or slot < network.robots:
        return ""
    return (
        f"slot: {slot} does not exist on a network of {network.robots} robots; use 0 to {network.robots - 1}"
    )


def check_order(steps: Sequence[Step], scenario: Scenario, origin: str) -> None:
    """Raises ScenarioError for what the steps together make impossible.

    That is the first step for which the run is too short, if all waits took no time at all, and a file that is saved
    twice.
    """
    end, begins = end_tick(scenario), 0
    saved: dict[str, int] = {}
    for step in steps:
        place = f"step {step.number}"
        last = begins + step.needs_ticks()
        if begins >= end or last > end:
            goes = f" and goes on to {end_ms(last)}" if last > begins else ""
            what = f"begins after {end_ms(begins)} or later{goes}, but the run ends after {end_ms(end)}"
            raise ScenarioError(origin, place, what, "give a longer duration_s, or shorter times")
        begins += step.lasts_ticks()
        if isinstance(step, SaveStep):
            if step.save in saved:
                what = f"step {saved[step.save]} saves {step.save}, too"
                raise ScenarioError(origin, f"{place}.save", what, "give each its own name")
            saved[step.save] = step.number


def check_symbols(steps: Sequence[Step], image: Image, origin: str) -> None:
    """Raises ScenarioError for a step that waits for a symbol which the image does not have."""
    for step in steps:
        condition = condition_of(step)
        if not isinstance(condition, Reached) or condition.symbol is None:
            continue
        place = f"step {step.number}.symbol"
        symbol = image.symbols.find(condition.symbol)
        if symbol is None or symbol.space != "code":
            what = "is no symbol of" if symbol is None else "is not in code memory:"
            remedy = "C names are those of functions that are not static; `mirotwin fw disasm` shows them"
            raise ScenarioError(origin, place, f"{condition.symbol!r} {what} {image.path}", remedy)
