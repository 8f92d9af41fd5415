"""What two firmwares do otherwise in one run: the first instruction, or the first variables, and how that was found.

What belongs here: which way of looking fits two images, and what is said of it. What does not: the looking
(`instructions.py`, `builds.py`) and reading images.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import msgspec

from miro_robot.image import Image
from mirotwin.replay.builds import Builds, VariableDifference
from mirotwin.replay.instructions import InstructionDifference, Stepper
from mirotwin.replay.program import Program, same_layout

if TYPE_CHECKING:
    from miro_sim.world.world import World

Make = Callable[[Image], "World"]
"""Gives a new world at tick 0 that runs an image."""


class FirmwareDifference(msgspec.Struct, frozen=True):
    """What two firmwares do otherwise. `changed`, `effect`: of images of the same layout; `variables`: of others.

    `notes`: what was compared, and what is missing.
    """

    changed: InstructionDifference | None
    effect: InstructionDifference | None
    variables: tuple[VariableDifference, ...]
    notes: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        return {
            "changed": None if self.changed is None else self.changed.as_json(),
            "effect": None if self.effect is None else self.effect.as_json(),
            "variables": [one.as_json() for one in self.variables],
            "notes": list(self.notes),
        }


def first_instruction(make: Make, one: Program, other: Program, until_tick: int) -> FirmwareDifference:
    """Runs both firmwares from tick 0 to at most `until_tick` and finds where they go apart."""
    programs = one, other
    notes = list(_missing(programs))

    def worlds() -> tuple[World, World]:
        return make(one.image), make(other.image)

    if same_layout(one.image, other.image):
        changed = Stepper(*worlds(), programs).changed(until_tick)
        effect = Stepper(*worlds(), programs).effect(until_tick)
        if changed is None and effect is not None:
            notes.insert(0, "no changed instruction is executed: what differs is data in code memory")
        if effect is None:
            notes.insert(0, "the states are the same each millisecond: no instruction has a lasting effect")
        return FirmwareDifference(changed, effect, (), tuple(notes))
    builds = Builds(*worlds(), programs)
    variables = builds.variables(until_tick)
    notes.insert(0, _compared(builds))
    if variables and not builds.since:
        notes.insert(1, "when the runs differ no variable does any more; these did for a while before")
    return FirmwareDifference(None, None, tuple(variables), tuple(notes))


def _compared(builds: Builds) -> str:
    head = "the code of the two images lies at other addresses, so instructions are not compared one by one"
    if not builds.places:
        return f"{head}; nor are variables: the images have no symbols of internal RAM in common"
    if not builds.looks:
        return f"{head}; nor are variables: the processors never sleep both at once"
    return f"{head}; compared were {len(builds.places)} variables by name, whenever both processors slept"


def _missing(programs: tuple[Program, Program]) -> Iterator[str]:
    """What the debug files do not tell."""
    for program in programs:
        image = program.image
        beside = "put its .map, .cdb and .rst beside it"
        if not image.path.is_file():
            beside = "a recording holds no debug files; --lines-from names the file that they lie beside"
        if program.problem is not None:
            yield f"C lines are missing: {program.problem}"
        elif not image.symbols.names:
            yield f"no symbols of {image.path}: {beside}"
        elif not program.has_lines:
            yield f"no C lines of {image.path}: {beside}"
