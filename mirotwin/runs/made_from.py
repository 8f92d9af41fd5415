"""The sources of two runs, and their differences."""

from __future__ import annotations

from collections.abc import Iterator
from hashlib import sha256
from typing import Any, NamedTuple

import msgspec

from miro_exact.bad_input import amount
from miro_robot.image import Image
from miro_robot.inspect.symbol_names import SymbolNames
from mirotwin.recording.difference import shown
from mirotwin.runs.spec import RunSpec


class MadeFrom(NamedTuple):
    """The sources of a run. `state`: the form of its states, and `plugins` that it used, as its recording has them."""

    spec: RunSpec
    state: str = ""
    plugins: tuple[str, ...] = ()


class SourceDifference(msgspec.Struct, frozen=True):
    """`key`: `seed`, `firmware`, or a key of the scenario as for `--set`. Values as text, "nothing" for none."""

    key: str
    a: str
    b: str


def source_differences(first: MadeFrom, other: MadeFrom) -> Iterator[SourceDifference]:
    """Seed, firmware, and the keys of the scenario that differ, those that a scenario leaves out included."""
    spec, other_spec = first.spec, other.spec
    if spec.seed != other_spec.seed:
        yield SourceDifference("seed", str(spec.seed), str(other_spec.seed))
    if spec.image.sha256 != other_spec.image.sha256:
        yield SourceDifference(
            "firmware", spec.image.sha256 or "nothing", other_spec.image.sha256 or "nothing"
        )
        yield _first_byte(spec.image, other_spec.image)
    keys, others = (dict(_flat("", msgspec.to_builtins(each.scenario))) for each in (spec, other_spec))
    for key in {**keys, **others}:
        pair = (keys.get(key), others.get(key))
        here, there = (_hashed(value) if key.endswith(".image") else shown(value) for value in pair)
        if here != there:
            yield SourceDifference(key, here, there)
    if first.plugins != other.plugins:
        yield SourceDifference("plug-ins", *("; ".join(run.plugins) or "none" for run in (first, other)))
    if first.state and other.state and first.state != other.state:
        yield SourceDifference("form of the state", first.state[:12], other.state[:12])


def _hashed(image: Any) -> str:
    """Of the text of another board's image."""
    return sha256(image.encode("latin-1")).hexdigest() if image else "nothing"


def _first_byte(first: Image, other: Image) -> SourceDifference:
    places = [place for place, (a, b) in enumerate(zip(first.code, other.code, strict=False)) if a != b]
    if not places:
        return SourceDifference("firmware code", "the same bytes", "the same bytes")
    where = (
        f"{image.code[places[0]]:02X}h at {places[0]:#06x} in {SymbolNames(image).place(places[0])}"
        for image in (first, other)
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
