"""Replay: the script of a recording or stream, where two runs differ, and what made them.

    difference = mirotwin.replay.first_difference(one, other)    # two worlds: tick, field, both values

The name is loaded on first use, as those of `mirotwin` are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mirotwin.replay.lockstep import StateDifference as StateDifference
    from mirotwin.replay.lockstep import first_difference as first_difference

__all__ = ["StateDifference", "first_difference"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'mirotwin.replay' has no attribute {name!r}")
    from mirotwin.replay import lockstep

    return getattr(lockstep, name)
