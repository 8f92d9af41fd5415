"""Parses ranges: seeds (0-49), and the random part of a campaign's file.

{ from = 0.001, to = 0.02 }            all values in between are equally likely
{ from = 1e-6, to = 1e-3, scale = "log" }      equal ratios are
{ from = 3, to = 16, whole = true }    whole numbers, both ends included
{ choose = ["euler", "exact"] }        one of these
"""

from __future__ import annotations

import math
from functools import partial
from typing import Annotated, Any

import msgspec

from miro_exact.domain import MAX_SEED
from miro_protocol.toml_text import TomlError, struct_of
from mirotwin.campaign.design import Draw, Value
from mirotwin.shell.command import Option, Word

CHOOSE = "choose"


class Range(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"low": "from", "high": "to"}):
    """A range between two ends; the head of this file lists its forms."""

    low: float
    high: float
    scale: str = "linear"
    whole: bool = False


class Choice(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    choose: Annotated[tuple[Value, ...], msgspec.Meta(min_length=1)]


def is_range(value: Any) -> bool:
    """True for a range, and for a value that is not a table; False for a table of further keys."""
    return not isinstance(value, dict) or any(key in value for key in ("from", "to", CHOOSE))


def draw_of(key: str, value: Any) -> Draw:
    """The draw of the scenario's `key`. Raises TomlError."""
    if not isinstance(value, dict):
        raise TomlError(f"expected a range, got {value!r}", "write { from = .., to = .. }")
    if CHOOSE in value:
        return Draw(key, choices=struct_of(value, Choice).choose)
    range_of_key = struct_of(value, Range)
    low, high, scale, whole = msgspec.structs.astuple(range_of_key)
    if scale not in ("linear", "log"):
        raise TomlError(f"scale: {scale!r} is not one of the choices", "use linear or log")
    if not low < high or not math.isfinite(high - low):
        raise TomlError(f"{low} to {high} is no range", "give a smaller from than to")
    if scale == "log" and (low <= 0.0 or whole):
        raise TomlError("scale log needs from > 0, and is not for whole numbers", "leave scale out")
    if whole and not (low.is_integer() and high.is_integer() and abs(high) + abs(low) < 1 << 53):
        raise TomlError(f"{low} to {high} are not whole numbers", "give whole ends, or leave whole out")
    return Draw(key, low, high, scale, whole)


MOST_SEEDS = 1000
_LONGEST = 40


def seeds_of(text: str, most: int = MOST_SEEDS) -> range:
    """Parses first and last seed, both included, at most `most` seeds. Raises ValueError."""
    first, _, last = text.partition("-")
    last = last or first
    if not (len(text) <= _LONGEST and first.isdecimal() and last.isdecimal()):
        raise ValueError(f"{text[:_LONGEST]!r} is no range of seeds; write it like 0-49")
    if int(last) > MAX_SEED:
        raise ValueError(f"{text!r}: the largest seed is {MAX_SEED}")
    first_seed, last_seed = int(first), int(last)
    count = last_seed - first_seed + 1
    if not 1 <= count <= most:
        raise ValueError(f"{text!r} has {max(count, 0)} seeds; give 1 to {most}")
    return range(first_seed, last_seed + 1)


def seed_range(most: int = MOST_SEEDS) -> Word:
    """Seeds from a first one to a last one: 0-49, or one alone; at most `most` of them."""
    return Word("seeds", partial(seeds_of, most=most), lambda seeds: f"{seeds[0]}-{seeds[-1]}")


SEEDS = Option("--seeds", type=seed_range(), help="First and last seed.")
