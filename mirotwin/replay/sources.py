"""What two recordings were made from, and where that differs: scenario key by key, seed, firmware."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec

from miro_robot.image import Image
from miro_robot.inspect.symbol_names import SymbolNames
from miro_sim.scenario.keys import Scenario
from mirotwin.recording.recorder import RunSource


class SourceDifference(msgspec.Struct, frozen=True):
    """`key`: `seed`, `firmware`, or a key of the scenario as for `--set`. Values as text, "nothing" for none."""

    key: str
    one: str
    other: str

    def as_json(self) -> dict[str, str]:
        return {"key": self.key, "a": self.one, "b": self.other}


class Made(msgspec.Struct, frozen=True):
    """What a recording was made from. `image` None: what it holds is none."""

    source: RunSource
    scenario: Scenario
    image: Image | None


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
    yield SourceDifference(f"firmware code, the first of {len(places)} bytes", *where)


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
