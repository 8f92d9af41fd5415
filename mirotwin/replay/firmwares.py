"""What two firmwares do otherwise in one run: the first instruction, or the first variables, and how that was found."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import msgspec

from miro_robot.image import Image
from miro_sim.world.conditions import Reached
from miro_sim.world.waits import WaitExpired
from miro_sim.world.world import World
from mirotwin.recording.difference import Difference
from mirotwin.replay.annotated_image import AnnotatedImage, same_layout
from mirotwin.replay.builds import Builds, VariableDifference
from mirotwin.replay.instructions import InstructionDifference, Stepper
from mirotwin.replay.lockstep import LOOK_TICKS
from mirotwin.replay.moved import Moved, moved
from mirotwin.rerun.job import Job
from mirotwin.shell.debug_files import debugged_image
from mirotwin.shell.options import plain_parameters

Make = Callable[[Image], World]
"""Gives a new world at tick 0 that runs an image."""


class FirmwareDifference(msgspec.Struct, frozen=True):
    """What two firmwares do otherwise. `changed`, `effect`: of images of the same layout; `mapped`, the first changed
    instruction by symbols, and `variables`: of others.

    `notes`: what was compared, and what is missing.
    """

    changed: InstructionDifference | None
    effect: InstructionDifference | None
    variables: tuple[VariableDifference, ...]
    notes: tuple[str, ...]
    mapped: InstructionDifference | None = None

    def as_json(self) -> dict[str, Any]:
        return {
            "changed": None if self.changed is None else self.changed.as_json(),
            "effect": None if self.effect is None else self.effect.as_json(),
            "mapped": None if self.mapped is None else self.mapped.as_json(),
            "variables": [one.as_json() for one in self.variables],
            "notes": list(self.notes),
        }


def first_instruction(
    make: Make, one: AnnotatedImage, other: AnnotatedImage, until_tick: int
) -> FirmwareDifference:
    """Runs both firmwares from tick 0 to at most `until_tick` and finds where they go apart."""
    annotated = one, other
    notes = list(_missing(annotated))

    def worlds() -> tuple[World, World]:
        return make(one.image), make(other.image)

    if same_layout(one.image, other.image):
        changed = Stepper(*worlds(), annotated).changed(until_tick)
        effect = Stepper(*worlds(), annotated).effect(until_tick)
        if changed is None and effect is not None:
            notes.insert(0, "no changed instruction is executed: what differs is data in code memory")
        if effect is None:
            notes.insert(0, "the states are the same each millisecond: no instruction has a lasting effect")
        return FirmwareDifference(changed, effect, (), tuple(notes))
    mapping = moved(one, other)
    mapped = _first_mapped(worlds(), annotated, mapping, until_tick)
    builds = Builds(*worlds(), annotated)
    variables = builds.variables(until_tick)
    notes.insert(0, _compared(builds))
    if mapping.same or mapping.changed:
        notes.insert(0, f"the code lies at other addresses and was mapped by symbols: {mapping}")
    if variables and not builds.since:
        notes.append("when the runs differ no variable does any more; these did for a while before")
    return FirmwareDifference(None, None, tuple(variables), tuple(notes), mapped)


def _first_mapped(
    worlds: tuple[World, World],
    annotated: tuple[AnnotatedImage, AnnotatedImage],
    mapping: Moved,
    until_tick: int,
) -> InstructionDifference | None:
    """The first changed instruction that the first firmware executes, and the one in its place in the second."""
    one, other = worlds
    reached = [
        Reached(address=at, network=robot.network, slot=robot.slot)
        for robot in one.robots
        for at in mapping.places
    ]
    try:
        event = one.run_until(reached, until_tick - one.tick) if reached else None
    except WaitExpired:
        event = None
    if event is None:
        return None
    there = mapping.places[event.address]
    place = annotated[0].place(event.address, event.tick)
    try:
        twin = Reached(address=there, network=event.network, slot=event.slot)
        tick = other.run_until([twin], until_tick - other.tick).tick
    except WaitExpired:
        tick = event.tick
    return InstructionDifference(event.network, event.slot, place, annotated[1].place(there, tick), ())


def _compared(builds: Builds) -> str:
    head = "the code of the two images lies at other addresses"
    if not builds.places:
        return f"{head}: variables are not compared: the images have no symbols of internal RAM in common"
    if not builds.looks:
        return f"{head}: variables are not compared: the processors never sleep both at once"
    return f"{head}: compared were {len(builds.places)} variables by name, whenever both processors slept"


def _missing(annotated: tuple[AnnotatedImage, AnnotatedImage]) -> Iterator[str]:
    """What the debug files do not tell."""
    for one in annotated:
        image = one.image
        beside = "put its .map, .cdb and .rst beside it"
        if not image.path.is_file():
            beside = "a recording holds no debug files; --lines-from names the file that they lie beside"
        if one.problem is not None:
            yield f"C lines are missing: {one.problem}"
        elif not image.symbols.names:
            yield f"no symbols of {image.path}: {beside}"
        elif not one.has_lines:
            yield f"no C lines of {image.path}: {beside}"


def annotated_of(image: Image, images: Sequence[Image], sources: Sequence[str]) -> AnnotatedImage:
    """The image with its debug files: those beside one of `images`, or the robot's own; C files also in `sources`."""
    return AnnotatedImage(*debugged_image(image, images, sources))


def firmwares_apart(
    job: Job, annotated: tuple[AnnotatedImage, AnnotatedImage], found: Sequence[Difference]
) -> FirmwareDifference | None:
    """Where the recorded image and the one that ran go apart, up to the first difference."""
    with plain_parameters(job.file, "replayed"):
        return first_instruction(job.world_of, *annotated, found[0].tick + LOOK_TICKS)
