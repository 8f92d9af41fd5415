"""A limit to the time in which Hypothesis looks for a smaller example of a failure.

Hypothesis has one constant for this, of 300 s, and no setting: its documentation ("engine constants") says to replace
the constant in the module. It reads it when shrinking begins, which is after the first failure; so it is replaced at
each failure, and put back when the smallest example runs for the last time.
"""

from __future__ import annotations

from hypothesis.control import current_build_context
from hypothesis.internal.conjecture import engine

_DEFAULT = engine.MAX_SHRINKING_SECONDS


def limit(seconds: float) -> None:
    """From now on, shrinking lasts at most so long."""
    engine.MAX_SHRINKING_SECONDS = seconds  # type: ignore[assignment]


def no_limit() -> None:
    """Hypothesis' own limit again."""
    engine.MAX_SHRINKING_SECONDS = _DEFAULT


def is_last_run() -> bool:
    """Whether Hypothesis runs the example that it will show."""
    return bool(current_build_context().is_final)
