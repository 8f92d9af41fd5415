"""Radio profiles: named sets of `[network.radio]` keys, and how a scenario's table is made of them."""

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from miro_exact.bad_input import did_you_mean
from miro_sim.scenario.errors import Refused

ERROR_KEYS = ("bit_error_rate", "eb_n0_db")
"""Two ways to say one thing: a table that has one of them takes the other one away."""

Table = dict[str, Any]


@cache
def tables_of(kind: str) -> Mapping[str, Mapping[str, Any]]:
    """Name -> `about` and keys of the profiles or variants that come with the package, in the order of their file."""
    return tomllib.loads(Path(__file__).with_name(f"{kind}s.toml").read_text(encoding="utf-8"))


def named(kind: str, name: object) -> Mapping[str, Any]:
    """The keys of the profile or variant with this name. Raises Refused."""
    known = tables_of(kind)
    if not isinstance(name, str) or name not in known:
        raise Refused(
            f"{name!r} is no {kind}", did_you_mean(str(name), known, f"{kind}s: {', '.join(known)}")
        )
    return known[name]


def keys_of(name: str) -> Table:
    """The keys that a profile sets. Raises Refused."""
    return {key: value for key, value in named("profile", name).items() if key != "about"}


def with_profiles(radio: Table) -> Table:
    """A radio table with the keys of its profiles filled in; its own keys win. Raises Refused."""
    named = radio.get("profile", [])
    names = [named] if isinstance(named, str) else named
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise Refused(
            f"expected a name or a list of names, got {named!r}", "see `mirotwin scenarios profiles`"
        )
    merged: Table = {}
    for name in names:
        merged = overridden(merged, keys_of(name))
    merged = overridden(merged, radio)
    _check_slicer(names, radio, merged)
    return merged


def _check_slicer(names: list[str], radio: Table, merged: Table) -> None:
    """Refuses a profile with a slicer whose Eb/N0 was taken away: no key in the scenario says `slicer`."""
    slicers = [name for name in names if "slicer" in keys_of(name)]
    if not slicers or "eb_n0_db" in merged:
        return
    problem = f"{slicers[-1]} needs eb_n0_db, and"
    if "bit_error_rate" in radio:
        raise Refused(
            f"{problem} bit_error_rate is given in its place",
            "leave one of them out, or give eb_n0_db instead",
        )
    taker = [name for name in names if "bit_error_rate" in keys_of(name)][-1]
    raise Refused(
        f"{problem} {taker} sets bit_error_rate in its place",
        f"leave one of them out, name {slicers[-1]} after {taker}, or give eb_n0_db",
    )


def overridden(table: Table, winner: Table) -> Table:
    """Both tables as one; where both have a key the second one's holds, and tables are merged likewise."""
    merged = dict(table)
    if any(key in winner for key in ERROR_KEYS):
        for key in ERROR_KEYS:
            merged.pop(key, None)
    for key, value in winner.items():
        below = merged.get(key)
        both = isinstance(below, dict) and isinstance(value, dict)
        merged[key] = {**below, **value} if both else value  # type: ignore[dict-item]
    return merged
