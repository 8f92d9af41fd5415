"""The specification of a run. Only this module builds worlds.

Checks, steps and scenario files are loaded by the callers that have them, so `fw run` starts without them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import msgspec

from miro_exact.bad_input import BadInput
from miro_protocol.transmission import Transmission
from miro_sim.scenario.board import BoardScenario

if TYPE_CHECKING:
    from miro_protocol.actions import ScriptItem
    from miro_robot.image import Image
    from miro_sim.scenario.board_scenario import AnyText
    from miro_sim.scenario.keys import Scenario
    from miro_sim.world.world import World
    from mirotwin.verify.checks.monitors import Expected
    from mirotwin.verify.steps.keys import Step


class RunSpec(msgspec.Struct, frozen=True, kw_only=True):
    """A world, its input and its checks. `script`: transmissions and actions that replace its hosts' output.

    `computed`: the hosts compute their output, and only the actions of the script are executed. `resumed`: the saved
    world to start from. `expected`: the checks; None: those of the scenario. `steps`: executed during the run.
    `until_tick`: end, may be after the scenario's; None: the scenario's. `cut`: it may be stopped before its end.
    `origin`: the file named in messages.
    """

    scenario: Scenario | BoardScenario
    image: Image
    seed: int = 0
    script: Sequence[ScriptItem] | None = None
    computed: bool = False
    resumed: bytes = b""
    expected: Expected | None = None
    steps: Sequence[Step] = ()
    until_tick: int | None = None
    cut: bool = False
    origin: str = ""

    @classmethod
    def of(cls, text: AnyText, image: Image, seed: int = 0) -> RunSpec:
        """Of a scenario that was read."""
        return cls(scenario=text.scenario, image=image, seed=seed, origin=text.origin)

    def checks(self) -> Expected:
        """The checks of each robot. Raises ScenarioError."""
        if self.expected is not None:
            return self.expected
        from mirotwin.verify.checks.expect import expectations_of

        return expectations_of(self.scenario, self.origin or self.scenario.name)

    @property
    def robot_scenario(self) -> Scenario:
        """The scenario of robots. Raises BadInput for a board alone."""
        if isinstance(self.scenario, BoardScenario):
            reason = "is for a board alone, which has no robot to show"
            raise BadInput(self.origin, "", reason, "`mirotwin replay` says what it comes to")
        return self.scenario

    def world(self, image: Image | None = None) -> World:
        """A new one, at its first tick, with another image if one is given. Raises BadInput where the saved world is
        another one's.
        """
        from miro_sim.world.world import World  # a hot module: not before the engine was chosen

        scripted = not self.resumed and not self.computed
        script = self.script if scripted else None if self.computed else ()
        world = World(self.scenario, self.seed, image or self.image, script)
        if self.resumed:
            self._load(world)
        for item in () if scripted else self.script or ():
            if not isinstance(item, Transmission):
                world.do(item)
            elif self.resumed:
                world.inject(item.data, item.network, item.tick, item.bad_stop)
        return world

    def _load(self, world: World) -> None:
        try:
            world.load(self.resumed)
        except ValueError as error:
            reason = f"the recorded run was resumed, and what it went on from fits nothing else: {error}"
            raise BadInput("", "replay", reason, "replay it without --firmware, --set and --seed") from None


@lru_cache(64)
def silent_scenario(settings: tuple[str, ...]) -> Scenario:
    """The scenario of a test that names none, with these settings: read once for all that want the same."""
    from miro_sim.scenario.file import load

    return load("silent", settings).scenario
