"""Checks of values that come from a saved state, before compiled code relies on them.

What belongs here: one function a kind of value; each returns the value or raises ValueError with its name. What does
not: which values a part has (its `restore`) and the form of saved worlds (`miro_sim.world.world`).

Compiled code checks no index and no length. So a `restore` checks everything that becomes an index, a length, a
divisor or the bound of a loop.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

LAST_TICK = 1 << 62
"""The tick of an event that will not happen; no tick lies beyond it."""
_REAL_LIMIT = 1e15


def whole(state: Mapping[str, Any], name: str, low: int, high: int) -> int:
    """An integer from `low` to `high`."""
    value = state[name]
    if not isinstance(value, int) or not low <= value <= high:
        raise ValueError(f"{name} is {_shown(value)}, not an integer from {low} to {high}")
    return int(value)


def tick(state: Mapping[str, Any], name: str, low: int = 0) -> int:
    """A tick or a cycle."""
    return whole(state, name, low, LAST_TICK)


def real(state: Mapping[str, Any], name: str, limit: float = _REAL_LIMIT) -> float:
    """A finite number within plus or minus `limit`."""
    value = state[name]
    if not isinstance(value, float) or not -limit <= value <= limit:
        raise ValueError(f"{name} is {_shown(value)}, not a number within {limit:g}")
    return value


def wholes(state: Mapping[str, Any], name: str, count: int, low: int, high: int) -> list[int]:
    """`count` integers from `low` to `high`."""
    values = state[name]
    if not isinstance(values, list | tuple) or len(values) != count:
        raise ValueError(f"{name} is {_shown(values)}, not {count} integers")
    for value in values:
        if not isinstance(value, int) or not low <= value <= high:
            raise ValueError(f"{name} holds {_shown(value)}, not integers from {low} to {high}")
    return [int(value) for value in values]


def ascending(state: Mapping[str, Any], name: str) -> list[int]:
    """Any number of ticks, each later than the one before."""
    values = state[name]
    if not isinstance(values, list | tuple):
        raise ValueError(f"{name} is {_shown(values)}, not a list of ticks")
    before = -1
    for value in values:
        if not isinstance(value, int) or not before < value <= LAST_TICK:
            raise ValueError(f"{name} holds {_shown(value)} behind {before}, not ticks in order")
        before = value
    return [int(value) for value in values]


def octets(state: Mapping[str, Any], name: str, count: int) -> bytes:
    """`count` bytes."""
    value = state[name]
    if not isinstance(value, bytes) or len(value) != count:
        raise ValueError(f"{name} is {_shown(value)}, not {count} bytes")
    return value


def only(state: Mapping[str, Any], names: Collection[str]) -> None:
    """Nothing but these names, and all of them."""
    wrong = [str(name) for name in (*state, *names) if name not in state or name not in names]
    if wrong:
        raise ValueError(f"{', '.join(wrong)[:80]} is missing or has no place in a saved state")


def _shown(value: object) -> str:
    """At most one line."""
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:40]}.."
