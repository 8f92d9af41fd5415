"""A scenario for a live session: its hosts send nothing, because a program at a port does; it lasts a day at most."""

from __future__ import annotations

from collections.abc import Sequence

from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import Also, ScenarioText, builtin_names, load, nothing_else
from miro_sim.scenario.keys import Scenario

LONGEST_S = 86_400.0
"""The longest duration that a scenario may have: a day."""


def live_scenario(source: str, settings: Sequence[str] = (), also: Also = nothing_else) -> ScenarioText:
    """The scenario that `source` names, with `settings` and then those of a live session made in it.

    References that would leave the pitch stop where the scenario's own duration ends. Nothing steers by them; they are
    the robots' starts, and what the summary compares with. Raises ScenarioError as `scenario.file.load` does, also for
    a reference of one's own that leaves the pitch within a day, and for a scenario with steps.
    """
    if source in builtin_names():
        settings = ("expect={}", *settings)  # which its own controller is to fulfil, and nothing steers here
    own = load(source, settings, also)
    if own.scenario.step:
        what = "a live session does no steps"
        raise ScenarioError(source, "step", what, "run them by `mirotwin test`, or remove them")
    return load(source, (*settings, *live_settings(own.scenario)), also)


def live_settings(scenario: Scenario) -> list[str]:
    """The settings that make a scenario last a day, with hosts that send nothing."""
    found = [f"duration_s={LONGEST_S!r}"]
    for index, network in enumerate(scenario.networks):
        found.append(f'network.{index}.host="silent"')
        for place, robot in enumerate(network.robot):
            if getattr(robot.reference, "drive_s", 0.0) is None:  # it would move all the time
                found.append(f"network.{index}.robot.{place}.reference.drive_s={scenario.duration_s!r}")
    return found
