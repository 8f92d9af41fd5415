"""Two recordings that differ, run again: the exact tick and fields, and the instruction where firmwares differ."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.image import Image
from miro_robot.inspect.symbol_names import SymbolNames
from miro_sim.scenario.keys import Scenario
from miro_sim.world.world import World
from mirotwin.recording.difference import DIGEST, Difference
from mirotwin.recording.reader import Recording
from mirotwin.recording.recorder import RunSource
from mirotwin.replay.annotated_image import AnnotatedImage
from mirotwin.replay.firmwares import FirmwareDifference, first_instruction
from mirotwin.replay.lockstep import LOOK_TICKS, StateDifference, first_difference
from mirotwin.rerun.job import repeating, world_of
from mirotwin.shell.options import plain_parameters


class SourceDifference(msgspec.Struct, frozen=True):
    """`key`: `seed`, `firmware`, or a key of the scenario as for `--set`. Values as text, "nothing" for none."""

    key: str
    one: str
    other: str

    def as_json(self) -> dict[str, str]:
        return {"key": self.key, "a": self.one, "b": self.other}


class Made(msgspec.Struct, frozen=True):
    """A recording, and what it was made from. `image` None: what it holds is none."""

    path: str
    recording: Recording
    scenario: Scenario
    image: Image | None

    @property
    def source(self) -> RunSource:
        return self.recording.source

    def repeating(self, period: int, scripted: bool) -> World | None:
        """See `rerun.job.repeating`."""
        return repeating(self.recording, self.path, period, scripted)


def source_differences(one: Made, other: Made) -> Iterator[SourceDifference]:
    """Seed, firmware, and the keys of the scenario that differ, those that a scenario leaves out included."""
    if one.source.seed != other.source.seed:
        yield SourceDifference("seed", str(one.source.seed), str(other.source.seed))
    if one.source.firmware_sha256 != other.source.firmware_sha256:
        hashes = (made.source.firmware_sha256 or "nothing" for made in (one, other))
        yield SourceDifference("firmware", *hashes)
        if one.image is not None and other.image is not None:
            yield from _first_byte(one.image, other.image)
    keys, others = (dict(_flat("", msgspec.to_builtins(made.scenario))) for made in (one, other))
    for key in {**keys, **others}:
        here, there = (_shown(found.get(key)) for found in (keys, others))
        if here != there:
            yield SourceDifference(key, here, there)
    if one.source.state and other.source.state and one.source.state != other.source.state:
        yield SourceDifference("form of the state", one.source.state[:12], other.source.state[:12])


def _first_byte(one: Image, other: Image) -> Iterator[SourceDifference]:
    places = [at for at, (a, b) in enumerate(zip(one.code, other.code, strict=False)) if a != b]
    if not places:
        yield SourceDifference("firmware code", "the same bytes", "the same bytes")
        return
    where = (
        f"{image.code[places[0]]:02X}h at {places[0]:#06x} in {SymbolNames(image).place(places[0])}"
        for image in (one, other)
    )
    yield SourceDifference(f"firmware code, the first of {amount(len(places), 'byte')}", *where)


def _flat(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flat(f"{path}.{key}" if path else str(key), inner)
    elif isinstance(value, list | tuple) and any(isinstance(item, dict) for item in value):
        for index, inner in enumerate(value):
            yield from _flat(f"{path}.{index}", inner)
    else:
        yield path, value


def _shown(value: Any) -> str:
    return "nothing" if value is None else str(value)


Both = tuple[Made, Made]


class ExactDifference(msgspec.Struct, frozen=True):
    """The result. `period`: the first control period that differs."""

    period: int | None = None
    state: StateDifference | None = None
    firmwares: FirmwareDifference | None = None

    def as_json(self) -> dict[str, Any]:
        return {
            "period": self.period,
            "state": None if self.state is None else self.state.as_json(),
            "instruction": None if self.firmwares is None else self.firmwares.as_json(),
        }


def locate(
    made: Both, annotated: Sequence[AnnotatedImage], found: Sequence[Difference], notes: list[str]
) -> ExactDifference:
    """Runs both again as far as their digests allow; `notes` gets what could not be done, and why."""
    period = min(one.period for one in found)
    first = _first_period(made, period)
    worlds = None
    try:
        with plain_parameters(made[0].path):
            worlds = _repeating(made, first, notes)
    except BadInput as error:
        notes.append(f"they cannot be run again: {error}")
    if worlds is None:
        return ExactDifference(period)
    one, other, scripted = worlds
    state = first_difference(one, other, (max(first, period) + 1) * CONTROL_PERIOD_TICKS)
    if state is None:
        notes.append(
            f"run again, their states do not differ up to the end of control period {period}: what made the difference"
            " is in neither recording (another version of this program, or values that were changed)"
        )
        return ExactDifference(period)
    return ExactDifference(period, state, _firmwares(made, annotated, _seen_tick(found), scripted))


def _first_period(made: Both, period: int) -> int:
    """Where the states differ first, by the digests; else the one before what was seen when `period` began."""
    one, other = made
    if one.source.state == other.source.state:
        for here, there in zip(one.recording.periods, other.recording.periods, strict=False):
            if here.digest != there.digest:
                return here.index
    return max(0, period - 1)


def _repeating(made: Both, period: int, notes: list[str]) -> tuple[World, World, bool] | None:
    for scripted in (False, True):
        one, other = (each.repeating(period, scripted) for each in made)
        if one is not None and other is not None:
            return one, other, scripted
    which = " and ".join(
        word
        for word, each in zip("AB", made, strict=True)
        if all(each.repeating(period, scripted) is None for scripted in (False, True))
    )
    whose = f"{which} does" if len(which) == 1 else "they do"
    notes.append(
        f"no tick within the control period: run again, {whose} not give the recorded digests up to there (another"
        " version of this program recorded, or input was put in beside a controller)"
    )
    return None


def _seen_tick(found: Sequence[Difference]) -> int:
    """When something differs that is more than a digest: dead bytes of a stack are enough for that."""
    return next((one.tick for one in found if one.channel != DIGEST), found[0].tick)


def _firmwares(
    made: Both, annotated: Sequence[AnnotatedImage], tick: int, scripted: bool
) -> FirmwareDifference | None:
    """Where the firmwares go apart, in runs that differ in nothing else."""
    alike = made[0].scenario == made[1].scenario and made[0].source.seed == made[1].source.seed
    if not alike or len(annotated) < 2 or annotated[0].image.code == annotated[1].image.code:
        return None

    def make(image: Image) -> World:
        return world_of(made[0].recording, made[0].path, image, scripted)

    return first_instruction(make, annotated[0], annotated[1], tick + LOOK_TICKS)
