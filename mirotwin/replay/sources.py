"""What two runs were made from, and where that is not the same."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec

from miro_exact.bad_input import amount
from miro_robot.image import Image
from miro_robot.inspect.symbol_names import SymbolNames
from miro_sim.scenario.keys import Scenario
from mirotwin.recording.difference import shown
from mirotwin.replay.lockstep.fields import Record


class RunOrigin(msgspec.Struct, frozen=True):
    """`image` None: what was recorded is none. `state`: the form of the states, "" where it is not known."""

    scenario: Scenario
    seed: int
    firmware_sha256: str
    image: Image | None
    plugins: tuple[str, ...] = ()
    state: str = ""


class SourceDifference(Record, frozen=True):
    """`key`: `seed`, `firmware`, or a key of the scenario as for `--set`. Values as text, "nothing" for none."""

    key: str
    a: str
    b: str


def source_differences(one: RunOrigin, other: RunOrigin) -> Iterator[SourceDifference]:
    """Seed, firmware, and the keys of the scenario that differ, those that a scenario leaves out included."""
    if one.seed != other.seed:
        yield SourceDifference("seed", str(one.seed), str(other.seed))
    if one.firmware_sha256 != other.firmware_sha256:
        hashes = (origin.firmware_sha256 or "nothing" for origin in (one, other))
        yield SourceDifference("firmware", *hashes)
        if one.image is not None and other.image is not None:
            yield _first_byte(one.image, other.image)
    keys, others = (dict(_flat("", msgspec.to_builtins(origin.scenario))) for origin in (one, other))
    for key in {**keys, **others}:
        here, there = shown(keys.get(key)), shown(others.get(key))
        if here != there:
            yield SourceDifference(key, here, there)
    if one.plugins != other.plugins:
        yield SourceDifference("plug-ins", *("; ".join(origin.plugins) or "none" for origin in (one, other)))
    if one.state and other.state and one.state != other.state:
        yield SourceDifference("form of the state", one.state[:12], other.state[:12])


def _first_byte(one: Image, other: Image) -> SourceDifference:
    places = [place for place, (a, b) in enumerate(zip(one.code, other.code, strict=False)) if a != b]
    if not places:
        return SourceDifference("firmware code", "the same bytes", "the same bytes")
    where = (
        f"{image.code[places[0]]:02X}h at {places[0]:#06x} in {SymbolNames(image).place(places[0])}"
        for image in (one, other)
    )
    return SourceDifference(f"firmware code, the first of {amount(len(places), 'byte')}", *where)


def _flat(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flat(f"{path}.{key}" if path else str(key), inner)
    elif isinstance(value, list | tuple) and any(isinstance(item, dict) for item in value):
        for index, inner in enumerate(value):
            yield from _flat(f"{path}.{index}", inner)
    else:
        yield path, value
