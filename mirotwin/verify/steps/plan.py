"""Whether a run can get to a step and do it, as far as the file and the image say."""

from __future__ import annotations

from collections.abc import Sequence

from miro_exact.clock import CONTROL_PERIOD_TICKS, ticks
from miro_robot.image import Image
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.keys import Scenario
from miro_sim.world.conditions import Reached
from mirotwin.verify.checks.interface import in_ms
from mirotwin.verify.steps.keys import SaveStep, Step


def end_tick(scenario: Scenario) -> int:
    """Where a run ends by itself: with the control period in which its duration does."""
    return max(1, -(-ticks(scenario.duration_s) // CONTROL_PERIOD_TICKS)) * CONTROL_PERIOD_TICKS


def problem(step: Step, scenario: Scenario) -> str:
    """Why this step cannot be done in this scenario, as `key: what; remedy`, or the empty string."""
    networks = scenario.networks
    if step.network >= len(networks):
        there = "there is one" if len(networks) == 1 else f"there are {len(networks)}, from 0 on"
        return f"network: there is no network {step.network}; {there}"
    return step.problem(networks[step.network])


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
            goes = f" and goes on to {in_ms(last)}" if last > begins else ""
            what = f"begins after {in_ms(begins)} or later{goes}, but the run ends after {in_ms(end)}"
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
        condition = getattr(step, "condition", None)
        if not isinstance(condition, Reached) or condition.symbol is None:
            continue
        place = f"step {step.number}.symbol"
        symbol = image.symbols.find(condition.symbol)
        if symbol is None or symbol.space != "code":
            what = "is no symbol of" if symbol is None else "is not in code memory:"
            remedy = "C names are those of functions that are not static; `mirotwin fw disasm` shows them"
            raise ScenarioError(origin, place, f"{condition.symbol!r} {what} {image.path}", remedy)
