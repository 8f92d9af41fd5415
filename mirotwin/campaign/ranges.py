"""Ranges as people write them: seeds (0-49), and those of the random part of a campaign's file.

{ from = 0.001, to = 0.02 }            all values in between are equally likely
{ from = 1e-6, to = 1e-3, scale = "log" }      equal ratios are
{ from = 3, to = 16, whole = true }    whole numbers, both ends included
{ choose = ["euler", "exact"] }        one of these
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, NoReturn, Protocol

from miro_exact.domain import MAX_SEED
from mirotwin.campaign.design import Draw, Value
from mirotwin.shell.command import Option, Word

KEYS = ("from", "to", "scale", "whole")
CHOOSE = "choose"


class Refuse(Protocol):
    """Raises BadInput at the place of the range: what, remedy."""

    def __call__(self, what: str, remedy: str = "") -> NoReturn: ...


def is_range(value: Any) -> bool:
    """Whether this stands for a range, and not for keys below it."""
    return not isinstance(value, dict) or any(key in value for key in (*KEYS[:2], CHOOSE))


def draw_of(key: str, value: Any, refuse: Refuse) -> Draw:
    """The draw of the scenario's `key`."""
    if not isinstance(value, dict):
        refuse(f"expected a range, got {value!r}", "write { from = .., to = .. }")
    if CHOOSE in value:
        return _choice(key, value, refuse)
    for name in value:
        if name not in KEYS:
            refuse(f"{name}: unknown key", f"use {', '.join(KEYS)}, or {CHOOSE} alone")
    low, high = _number(value, "from", refuse), _number(value, "to", refuse)
    scale, whole = value.get("scale", "linear"), value.get("whole", False)
    if scale not in ("linear", "log"):
        refuse(f"scale: {scale!r} is not one of the choices", "use linear or log")
    if not isinstance(whole, bool):
        refuse(f"whole: expected true or false, got {whole!r}")
    if not low < high or not math.isfinite(high - low):
        refuse(f"{low} to {high} is no range", "give a smaller from than to")
    if scale == "log" and (low <= 0.0 or whole):
        refuse("scale log needs from > 0, and is not for whole numbers", "leave scale out")
    if whole and not (low.is_integer() and high.is_integer() and abs(high) + abs(low) < 1 << 53):
        refuse(f"{low} to {high} are not whole numbers", "give whole ends, or leave whole out")
    return Draw(key, low, high, scale, whole)


def _choice(key: str, value: dict[str, Any], refuse: Refuse) -> Draw:
    choices = value[CHOOSE]
    if len(value) > 1 or not isinstance(choices, list) or not choices:
        refuse(f"{CHOOSE} stands alone, with a list of values", "write { choose = [..] }")
    if not all(isinstance(one, Value) for one in choices):
        refuse("can choose among numbers, words, true and false only")
    return Draw(key, choices=tuple(choices))


def _number(value: dict[str, Any], name: str, refuse: Refuse) -> float:
    number = value.get(name)
    if isinstance(number, bool) or not isinstance(number, int | float):
        what = "this key is missing" if number is None else f"expected a number, got {number!r}"
        refuse(f"{name}: {what}", "write { from = .., to = .. }")
    try:
        return float(number)
    except OverflowError:
        refuse(f"{name}: is beyond every float", "give a smaller one")


MOST_SEEDS = 1000
_LONGEST = 40


def seeds_of(text: str, most: int = MOST_SEEDS) -> range:
    """First and last seed, both included, `most` at most. ValueError with what is wrong."""
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
