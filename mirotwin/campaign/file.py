"""The campaign file: its runs and the expectations on them. README.md shows an example."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from miro_exact.bad_input import BadInput
from miro_exact.domain import MAX_SEED
from miro_exact.inputs import path_beside, read_input
from miro_protocol.toml_text import TEXT_KIB, TomlError, check_numbers, struct_of, tables
from miro_sim.scenario.base import beside
from miro_sim.scenario.file import decode
from miro_sim.scenario.settings import EXPECT, in_text
from mirotwin.campaign.design import Design, Draw, Factor, Level, Value, as_kind, inline, kind_of
from mirotwin.campaign.plan import OWN_IMAGE, Plan, checked
from mirotwin.campaign.ranges import draw_of, is_range, seeds_of
from mirotwin.shell.plugin_files import PluginFiles

BUILTIN = Path(__file__).parent / "builtin"
MOST_RUNS = 1_000_000_000
"""More is a mistake in the file."""
SCENARIO, FIRMWARE = "scenario", "firmware"
NOT_VARIED = ("name", "title", "network", "board", "step", "expect", "seed")
"""Keys of a scenario that are no factor by themselves."""


class Random(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`[random]`. `count` 0: one draw for each seed of the runs, by that seed."""

    count: Annotated[int, Meta(ge=0, le=MOST_RUNS)] = 0
    seed: Annotated[int, Meta(ge=0, le=MAX_SEED)] = 0
    range: dict[str, Any] = {}


class Document(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The whole file."""

    scenario: Annotated[str, Meta(min_length=1)]
    seeds: str | int = 0
    firmware: str = ""
    set: dict[str, Any] = {}
    values: tuple[str, ...] = ()
    allowed_failed_share: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.0
    expect: dict[str, Any] = {}
    grid: dict[str, Any] = {}
    factor: dict[str, dict[str, list[str]]] = {}
    random: Random | None = None


_OF_OTHERS = {"board", "chip", "crystal_hz", "duration_s", "network"}
"""Keys at the top of a scenario or of a board file."""


def builtin_names() -> list[str]:
    """Campaigns that are part of the program: `mirotwin campaign bench2`."""
    return sorted(path.stem for path in BUILTIN.glob("*.toml"))


def load(path: str | Path, settings: Sequence[str] = (), plugins: PluginFiles | None = None) -> Plan:
    """The campaign of a file, or the built-in one of that name, with more `settings` (KEY=VALUE) for all runs.

    `plugins`: brought by the command line; one alone is that of all robots, unless a setting or a level names it.
    Raises BadInput with the place of the error.
    """
    path = Path(path)
    if not path.exists() and str(path) in builtin_names():
        own = BUILTIN / f"{path}.toml"
        plan = _parsed(own.read_text(encoding="utf-8"), own)
        return _with_plugins(msgspec.structs.replace(plan, path=str(path)), settings, plugins)
    try:
        text = decode(read_input(path, TEXT_KIB << 10), str(path))
    except FileNotFoundError:
        remedy = f"`mirotwin examples campaign` writes one; built-in: {', '.join(builtin_names())}"
        raise BadInput(path, "", "there is no such file", remedy) from None
    return _with_plugins(_parsed(text, path), settings, plugins)


def _with_plugins(plan: Plan, settings: Sequence[str], plugins: PluginFiles | None) -> Plan:
    """Raises BadInput."""
    if plugins is None:
        return checked(plan, settings)
    named = [text for factor in plan.design.factors for level in factor.levels for text in level.settings]
    for_all = plugins.settings([*settings, *named])
    return msgspec.structs.replace(checked(plan, (*for_all, *settings)), plugins=plugins)


def parse(text: str, path: str | Path, settings: Sequence[str] = ()) -> Plan:
    """The campaign of a text; `path` names it in errors. Raises BadInput as `load` does."""
    return checked(_parsed(text, Path(path)), settings)


def _parsed(text: str, path: Path) -> Plan:
    """Reads the text of a campaign's file, with paths relative to the file."""
    with BadInput.at(path):
        raw = tables(text)
        check_numbers(raw)
        if SCENARIO not in raw and _OF_OTHERS & raw.keys():
            remedy = f'write scenario = "{path.name}" into a campaign file beside it'
            raise BadInput("", "", "is no campaign, but a scenario or a board", remedy)
        document = struct_of(raw, Document)
        design = _design(document, path)
        scenario, firmware = (
            _scenario(document.scenario, path, SCENARIO),
            _image(document.firmware, path, FIRMWARE),
        )
    settings = [(setting, f"set.{setting.partition('=')[0]}") for setting in in_text(document.set)]
    settings += [
        (f"{EXPECT}{key}={inline(value)}", f"expect.{key}") for key, value in document.expect.items()
    ]
    return Plan(
        path=str(path),
        scenario=scenario,
        firmware=firmware,
        settings=tuple(settings),
        allowed_failed_share=document.allowed_failed_share,
        values=document.values,
        design=design,
    )


def _scenario(name: str, path: Path, place: str) -> str:
    """Raises BadInput, as all below."""
    with BadInput.at(path, place):
        return beside(str(path), name)


def _image(name: str, path: Path, place: str) -> str:
    with BadInput.at(path, place):
        return str(Path(path_beside(path, name)).resolve()) if name else ""


def _design(document: Document, path: Path) -> Design:
    try:
        seeds = seeds_of(str(document.seeds), MOST_RUNS)
    except ValueError as error:
        raise TomlError(f"{error}", place="seeds") from None
    design = Design(
        first_seed=seeds[0],
        seed_count=len(seeds),
        factors=(*_grid(document.grid, path), *_factors(document.factor)),
        draws=tuple(_draws(document.random)) if document.random else (),
        draw_count=document.random.count if document.random else 1,
        draw_seed=document.random.seed if document.random else 0,
    )
    names = design.names
    for index, name in enumerate(names):
        if name in names[:index]:
            raise TomlError("is varied in two ways", "keep one of them", name)
    if design.runs > MOST_RUNS:
        raise TomlError(f"has {design.runs} runs; at most {MOST_RUNS}", "take fewer levels or seeds")
    return design


def _grid(table: dict[str, Any], path: Path) -> Iterator[Factor]:
    for key, values in _leaves(table, lambda value: not isinstance(value, dict)):
        place = f"grid.{key}"
        if key in NOT_VARIED:
            raise TomlError("cannot be varied", "name a key below it, or give seeds = ..", place)
        if not isinstance(values, list) or not values:
            raise TomlError(f"expected a list of values, got {values!r}", f"write {key} = [..]", place)
        levels = [_level(key, value, f"{place}[{at}]", path) for at, value in enumerate(values)]
        if len({repr(level.value) for level in levels}) < len(levels):
            raise TomlError("has a value twice", "a value once is enough: give more seeds", place)
        yield Factor(key, _of_one_kind(levels))


def _level(key: str, value: Any, place: str, path: Path) -> Level:
    if key not in (SCENARIO, FIRMWARE):
        shown = value if isinstance(value, Value) else inline(value)
        return Level(shown, (f"{key}={inline(value)}",), place=place)
    if not isinstance(value, str):
        raise TomlError(f"expected a name or a path, got {value!r}", place=place)
    if key == SCENARIO:
        return Level(value, scenario=_scenario(value, path, place), place=place)
    return Level(value, firmware=_image(value, path, place) or OWN_IMAGE, place=place)


def _factors(table: dict[str, dict[str, list[str]]]) -> Iterator[Factor]:
    for name, levels in table.items():
        place = f"factor.{name}"
        if not levels:
            raise TomlError("has no levels", "give each level a list of KEY=VALUE", place)
        made = (Level(level, tuple(made), place=f"{place}.{level}") for level, made in levels.items())
        yield Factor(name, tuple(made))


def _draws(random: Random) -> Iterator[Draw]:
    if not random.range:
        raise TomlError("says nothing to draw", "give KEY = { from = .., to = .. }", "random.range")
    if random.seed and not random.count:
        raise TomlError("has no effect: without count each seed draws its own", "give count", "random.seed")
    for key, value in _leaves(random.range, is_range):
        try:
            yield draw_of(key, value)
        except TomlError as error:
            reason = ": ".join(filter(None, (f"{error.place}", error.what)))
            raise TomlError(reason, error.remedy, f"random.range.{key}") from None


def _leaves(table: dict[str, Any], ends: Callable[[Any], bool], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yields key path and value of each leaf; nested tables extend the path."""
    for key, value in table.items():
        if ends(value) or not value:
            yield f"{above}{key}", value
        else:
            yield from _leaves(value, ends, f"{above}{key}.")


def _of_one_kind(levels: list[Level]) -> tuple[Level, ...]:
    """Levels with values of one type: all numbers, all truth values, or else all as text."""
    kind = kind_of(level.value for level in levels)
    return tuple(msgspec.structs.replace(level, value=as_kind(level.value, kind)) for level in levels)
