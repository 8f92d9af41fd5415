"""The design points of a campaign: every combination of factor levels, draws and seeds, in one order.

    run = ((point * draws) + draw) * seeds + seed        point: the last factor changes first

A run is computed from its number, so a plan of millions takes no memory.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import msgspec
import tomli_w

from miro_exact import dmath
from miro_exact.rng import Stream

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def inline(value: Any) -> str:
    """The value as TOML on one line; a table as `{key = value}`."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {inline(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(inline(inner) for inner in value) + "]"
    return tomli_w.dumps({"x": value}).removeprefix("x = ").rstrip("\n")


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else inline(key)


Value = float | int | bool | str
"""A value that a column of the results can hold."""


def kind_of(values: Iterable[Value]) -> type:
    """The type of a column that holds these values: theirs, else float for numbers, and str for all others."""
    kinds = {type(value) for value in values}
    return float if kinds == {int, float} else kinds.pop() if len(kinds) == 1 else str


def as_kind(value: Value, kind: type) -> Any:
    """The value as such a column shows it."""
    return inline(value) if kind is str and not isinstance(value, str) else kind(value)


class Level(msgspec.Struct, frozen=True):
    """A level of a factor: its value in the column, and the settings that it makes.

    `settings`: KEY=VALUE, as `--set`. `scenario`, `firmware`: replace the campaign's own; "" keeps it. `place`: key
    path in the campaign's file, or the option, for errors.
    """

    value: Value
    settings: tuple[str, ...] = ()
    scenario: str = ""
    firmware: str = ""
    place: str = ""


class Factor(msgspec.Struct, frozen=True):
    """A factor that is varied, and its levels."""

    name: str
    levels: tuple[Level, ...]


class Draw(msgspec.Struct, frozen=True):
    """A key whose value is drawn: between `low` and `high`, or one of `choices`.

    `scale`: "linear", or "log" (equal ratios are equally likely). `whole`: integers, both ends included.
    """

    name: str
    low: float = 0.0
    high: float = 0.0
    scale: str = "linear"
    whole: bool = False
    choices: tuple[Value, ...] = ()

    def value(self, seed: int, index: int) -> Value:
        """The draw `index`: a function of the seed, the key and the index alone."""
        share = Stream(seed, f"campaign {self.name}").uniform(index)
        if self.choices:
            return self.choices[int(share * len(self.choices))]
        if self.whole:
            return int(self.low) + int(share * (int(self.high) - int(self.low) + 1))
        if self.scale == "log":
            low, high = dmath.log(self.low), dmath.log(self.high)
            return min(max(dmath.exp(low + (high - low) * share), self.low), self.high)
        return self.low + (self.high - self.low) * share

    def ends(self) -> tuple[Value, ...]:
        """The values that are tried before anything runs."""
        if self.choices:
            return self.choices
        return (int(self.low), int(self.high)) if self.whole else (self.low, self.high)

    def setting(self, value: Value) -> str:
        return f"{self.name}={inline(value)}"


class DesignPoint(msgspec.Struct, frozen=True):
    """One run: the level of each factor, the values drawn, the number of the draw, and the seed."""

    levels: tuple[Level, ...]
    drawn: tuple[Value, ...]
    draw: int
    seed: int


class Design(msgspec.Struct, frozen=True):
    """All runs of a campaign. `draw_count`: 1 if nothing is drawn; 0 if each seed has its own draw."""

    first_seed: int
    seed_count: int
    factors: tuple[Factor, ...] = ()
    draws: tuple[Draw, ...] = ()
    draw_count: int = 1
    draw_seed: int = 0

    @property
    def runs(self) -> int:
        count = self.seed_count * max(self.draw_count, 1)
        for factor in self.factors:
            count *= len(factor.levels)
        return count

    @property
    def names(self) -> list[str]:
        """The names of the factors and draws, in the order of the columns."""
        return [*(factor.name for factor in self.factors), *(draw.name for draw in self.draws)]

    def point(self, run: int) -> DesignPoint:
        """The design point of run number `run`, from 0."""
        rest, seed = divmod(run, self.seed_count)
        rest, draw = divmod(rest, max(self.draw_count, 1))
        levels: list[Level] = []
        for factor in reversed(self.factors):
            rest, level = divmod(rest, len(factor.levels))
            levels.append(factor.levels[level])
        run_seed = self.first_seed + seed
        draw_seed = self.draw_seed if self.draw_count else run_seed
        drawn = tuple(source.value(draw_seed, draw) for source in self.draws)
        return DesignPoint(tuple(reversed(levels)), drawn, draw, run_seed)

    def settings(self, point: DesignPoint) -> tuple[str, ...]:
        """The settings of a point, in the order of the file."""
        settings = [setting for level in point.levels for setting in level.settings]
        settings += [draw.setting(value) for draw, value in zip(self.draws, point.drawn, strict=True)]
        return tuple(settings)
