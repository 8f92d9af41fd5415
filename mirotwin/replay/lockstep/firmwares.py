"""The first difference in the behaviour of two firmwares in one run: an instruction or variables, and the method used.

Code that moved between the builds is matched by symbols, and within a function instruction by instruction. A piece of
code reaches from one symbol to the next. Two pieces of one name are compared as text, in which addresses have their
names, so that a call to a function that moved is the same call. An address loaded in two halves has no name in the
text, so it counts as changed if it moved.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from difflib import SequenceMatcher
from itertools import pairwise

import msgspec

from miro_robot.image import Image
from miro_robot.mcs51.opcodes import LENGTH, disassemble
from miro_sim.world.world import World
from mirotwin.replay.lockstep.annotated_image import AnnotatedImage, same_layout
from mirotwin.replay.lockstep.fields import Record
from mirotwin.replay.lockstep.instructions import InstructionDifference, Stepper, first_reached
from mirotwin.replay.lockstep.variables import Builds, VariableDifference

_OFFSET = re.compile(r"\+(0x[0-9a-f]+|\d+|[0-9A-F]+h)")
_ADDRESS = re.compile(r"\b([0-9A-F]{4,5})h")
Instruction = tuple[int, bytes, str]
"""Address, bytes, and text without the parts that depend on the code's address."""
NAMED = 5


class Moved(msgspec.Struct, frozen=True):
    """`same`: pieces of code with equal instructions; `changed`: the others of equal names; `only`: those of one image.

    `places`: an instruction of the first image that changed, and the one in its place in the second.
    """

    same: tuple[str, ...]
    changed: tuple[str, ...]
    only: tuple[tuple[str, ...], tuple[str, ...]]
    places: dict[int, int]

    def __str__(self) -> str:
        parts = [
            f"{len(self.same)} of {len(self.same) + len(self.changed)} functions and labels hold the same"
        ]
        parts += [f"changed: {_listed(self.changed)}"] if self.changed else []
        sides = zip(("first", "second"), self.only, strict=True)
        parts += [f"only in the {side}: {_listed(names)}" for side, names in sides if names]
        return "; ".join(parts)


def moved(image: AnnotatedImage, other: AnnotatedImage) -> Moved:
    """The map of the two, empty where one of them has no symbols."""
    here, there = _pieces(image), _pieces(other)
    same: list[str] = []
    changed: list[str] = []
    places: dict[int, int] = {}
    for name in filter(there.__contains__, here):
        first, second = list(_instructions(image, *here[name])), list(_instructions(other, *there[name]))
        differing = list(_differing(first, second))
        (changed if differing else same).append(name)
        places.update(differing)
    only = (
        tuple(name for name in here if name not in there),
        tuple(name for name in there if name not in here),
    )
    return Moved(tuple(same), tuple(changed), only, places)


def _pieces(annotated: AnnotatedImage) -> dict[str, tuple[int, int]]:
    """Name -> first and last address of the code, sorted by address; empty without symbols."""
    image, pieces = annotated.image, dict[str, tuple[int, int]]()
    if image.symbols.problem is not None or not image.symbols.names:
        return pieces
    for (start, name), (following, _) in pairwise([*annotated.names.functions, (1 << 16, "")]):
        for first, end in image.used:
            if first <= start < end:
                pieces.setdefault(name, (start, min(end, following)))
    return pieces


def _instructions(annotated: AnnotatedImage, address: int, end: int) -> Iterator[Instruction]:
    code, names = annotated.image.code, annotated.names
    while address < end:
        text = " ".join(disassemble(code, address, names).split())
        text = _ADDRESS.sub(lambda match: names.place(int(match[1], 16)), text)
        length = LENGTH[code[address]]
        yield address, bytes(code[address : address + length]), _OFFSET.sub("", text)
        address += length


def _differing(instructions: list[Instruction], other: list[Instruction]) -> Iterator[tuple[int, int]]:
    """Addresses in both pieces where the instructions begin to differ; at the end of a piece the addresses of its last
    instruction.
    """
    if [len(code) for _, code, _ in instructions] == [len(code) for _, code, _ in other]:
        for (here, code, text), (there, code_there, text_there) in zip(instructions, other, strict=True):
            if code != code_there and text != text_there:
                yield here, there
        return
    texts = [text for _, _, text in instructions], [text for _, _, text in other]
    for kind, first, _, second, _ in SequenceMatcher(None, *texts, autojunk=False).get_opcodes():
        if kind != "equal":
            yield instructions[min(first, len(instructions) - 1)][0], other[min(second, len(other) - 1)][0]


def _listed(names: tuple[str, ...]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


Make = Callable[[Image], World]
"""Gives a new world at tick 0 that runs an image."""


class FirmwareDifference(Record, frozen=True):
    """The differences of two firmwares. `changed`, `effect`: for images of the same layout; `mapped` (the first changed
    instruction, matched by symbols) and `variables`: for other images. `notes`: methods used, and missing data.
    """

    changed: InstructionDifference | None = None
    effect: InstructionDifference | None = None
    mapped: InstructionDifference | None = None
    variables: tuple[VariableDifference, ...] = ()
    notes: tuple[str, ...] = ()


def first_instruction(
    make: Make, image: AnnotatedImage, other: AnnotatedImage, until_tick: int
) -> FirmwareDifference:
    """Runs both firmwares from tick 0 to at most `until_tick` and finds where they go apart."""
    annotated = image, other
    notes = list(_missing(annotated))

    def worlds() -> tuple[World, World]:
        made = make(image.image), make(other.image)
        image.clock = other.clock = made[0].clock
        return made

    if same_layout(image.image, other.image):
        changed = Stepper(*worlds(), annotated).changed(until_tick)
        effect = Stepper(*worlds(), annotated).effect(until_tick)
        if changed is None and effect is not None:
            notes.insert(0, "no changed instruction is executed: what differs is data in code memory")
        if effect is None:
            notes.insert(0, "the states are the same each millisecond: no instruction has a lasting effect")
        return FirmwareDifference(changed, effect, notes=tuple(notes))
    mapping = moved(image, other)
    mapped = _first_mapped(worlds(), annotated, mapping, until_tick)
    builds = Builds(*worlds(), annotated)
    variables = builds.variables(until_tick)
    notes.insert(0, _compared(builds))
    if mapping.same or mapping.changed:
        notes.insert(0, f"the code lies at other addresses and was mapped by symbols: {mapping}")
    if variables and not builds.since:
        notes.append("when the runs differ no variable does any more; these did for a while before")
    return FirmwareDifference(mapped=mapped, variables=tuple(variables), notes=tuple(notes))


def _first_mapped(
    worlds: tuple[World, World],
    annotated: tuple[AnnotatedImage, AnnotatedImage],
    mapping: Moved,
    until_tick: int,
) -> InstructionDifference | None:
    """The first changed instruction that the first firmware executes, and the one in its place in the second."""
    world, other = worlds
    event = first_reached(world, mapping.places, until_tick)
    if event is None:
        return None
    there = mapping.places[event.address]
    twin = first_reached(other, [there], until_tick, [other.device(event.network, event.slot)])
    places = (
        annotated[0].place(event.address, event.tick),
        annotated[1].place(there, event.tick if twin is None else twin.tick),
    )
    return InstructionDifference(event.network, event.slot, *places, ())


def _compared(builds: Builds) -> str:
    head = "the code of the two images lies at other addresses"
    if not builds.places:
        return f"{head}: variables are not compared: the images have no symbols of internal RAM in common"
    if not builds.looks:
        return f"{head}: variables are not compared: the processors never sleep both at once"
    return f"{head}: compared were {len(builds.places)} variables by name, whenever both processors slept"


def _missing(annotated: tuple[AnnotatedImage, AnnotatedImage]) -> Iterator[str]:
    """Debug files that are missing or wrong, a line each."""
    for firmware in annotated:
        image = firmware.image
        beside = "put its .map, .cdb and .rst beside it"
        if not image.path.is_file():
            beside = "a recording holds no debug files; --lines-from names the file that they lie beside"
        if firmware.problem is not None:
            yield f"C lines are missing: {firmware.problem}"
        elif not image.symbols.names:
            yield f"no symbols of {image.path}: {beside}"
        elif not firmware.debug.lines:
            yield f"no C lines of {image.path}: {beside}"
