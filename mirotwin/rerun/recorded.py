"""A recording as a world: what it was made from, run again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.image import Image, Symbol, Symbols, parse_hex
from miro_sim.periods import Period
from miro_sim.scenario.file import parse as parse_scenario
from mirotwin.recording.reader import Recording
from mirotwin.rerun.script import script_of

if TYPE_CHECKING:
    from miro_sim.world.world import World


def image_of(recording: Recording, path: str | Path) -> Image:
    """The image in the recording, with the symbols it had when it was recorded. Raises BadInput for what is not one."""
    source = recording.source
    image = parse_hex(source.firmware, Path(path) / "firmware.ihx")
    symbols = Symbols({name: Symbol(address, space) for name, (address, space) in source.symbols.items()})
    return msgspec.structs.replace(image, symbols=symbols)


def image_if_any(recording: Recording, path: str | Path) -> Image | None:
    """The same, or None for what is no image."""
    try:
        return image_of(recording, path)
    except BadInput:
        return None


def world_of(recording: Recording, path: str, image: Image | None = None, scripted: bool = False) -> World:
    """A world at tick 0 with the recorded scenario and seed, and the recorded image unless another is given.

    `scripted`: its hosts send what was recorded; else they compute it again. What was done to robots and radios is
    done again. Raises ValueError for what no caller can have done.
    """
    from miro_sim.world.world import World

    source = recording.source
    scenario = parse_scenario(source.scenario_text, f"{path}: scenario.toml")
    script = script_of(recording.periods) if scripted else None
    world = World(scenario, source.seed, image or image_of(recording, path), script=script)
    if not scripted:
        for action in (action for period in recording.periods for action in period.actions):
            world.do(action)
    return world


def repeating(recording: Recording, path: str, period: int, scripted: bool) -> World | None:
    """A world that repeats the recording, at the start of control period `period`; see `world_of`.

    None: a run that was resumed, or it does not give the recorded digests up to there. Another version of this program
    made the recording, input was put in beside a controller, or it was edited.
    """
    if recording.source.resumed:
        return None
    try:
        world = world_of(recording, path, scripted=scripted)
    except ValueError:
        return None
    world.run_to(period * CONTROL_PERIOD_TICKS)
    return world if world.index == period and _repeats(world, recording.periods[:period]) else None


def _repeats(world: World, periods: Sequence[Period]) -> bool:
    return not periods or world.digest == periods[len(periods) - 1].digest
