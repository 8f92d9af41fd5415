"""Least squares for a few parameters: damped Gauss-Newton steps in plain float64, in a written order.

No numpy: its linear algebra gives other bits on other machines.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

STEPS = 100
"""Tried steps, good ones and bad ones."""
FLAT = 1e-12
"""A step that gains less, as a share of the sum of squares, is the last."""
SMALL = 1e-10
"""A step shorter than this (root mean square over parameters of size 1) ends the iteration."""
_DIFFERENCE = 1e-6

Residuals = Callable[[list[float]], list[float]]


class NoConvergenceError(Exception):
    """The iteration did not reach a minimum."""


def minimised(residuals: Residuals, first: Sequence[float]) -> list[float]:
    """The parameters with the least sum of squares near `first`.

    `residuals` may raise ValueError where it is not defined: such a step is not taken. Raises NoConvergenceError.
    """
    values = list(first)
    off = residuals(values)
    best = _squares(off)
    damping = 1e-3
    for _ in range(STEPS):
        step = _step(residuals, values, off, damping)
        tried = [value + change for value, change in zip(values, step, strict=True)]
        try:
            tried_off = residuals(tried)
            squares = _squares(tried_off)
        except ValueError:
            squares = math.inf
        length = math.sqrt(_squares(step) / len(step))
        if squares <= best:
            gained = best - squares
            values, off, best = tried, tried_off, squares
            damping = max(0.1 * damping, 1e-12)
            if gained <= FLAT * best:  # a valley without a slope: further steps only walk along it
                return values
        else:
            damping *= 10.0
        if length < SMALL:
            return values
        if damping > 1e12:
            raise NoConvergenceError("no step makes it better")
    raise NoConvergenceError(f"no end after {STEPS} steps")


def _step(residuals: Residuals, values: list[float], off: list[float], damping: float) -> list[float]:
    """Solves (J'J + damping diag(J'J)) step = -J'r."""
    columns = [_derivative(residuals, values, index) for index in range(len(values))]
    matrix = [[product(column, other) for other in columns] for column in columns]
    for index, row in enumerate(matrix):
        row[index] += damping * row[index] + 1e-12
    return solved(matrix, [0.0 - product(column, off) for column in columns])


def _derivative(residuals: Residuals, values: list[float], index: int) -> list[float]:
    """Central difference along one parameter."""
    up, down = list(values), list(values)
    up[index] += _DIFFERENCE
    down[index] -= _DIFFERENCE
    try:
        above, below = residuals(up), residuals(down)
    except ValueError as error:
        raise NoConvergenceError(f"{error}") from None
    return [(upper - other) / (2.0 * _DIFFERENCE) for upper, other in zip(above, below, strict=True)]


def solved(matrix: list[list[float]], right: list[float]) -> list[float]:
    """x of A x = b by elimination with row exchange. Raises NoConvergenceError for a singular matrix."""
    size = len(right)
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    for column in range(size):
        pivot = max(range(column, size), key=lambda row: abs(rows[row][column]))
        if rows[pivot][column] == 0.0:
            raise NoConvergenceError("the points do not tell all parameters")
        rows[column], rows[pivot] = rows[pivot], rows[column]
        for row in range(column + 1, size):
            factor = rows[row][column] / rows[column][column]
            for place in range(column, size + 1):
                rows[row][place] -= factor * rows[column][place]
    x = [0.0] * size
    for column in range(size - 1, -1, -1):
        rest = rows[column][size]
        for place in range(column + 1, size):
            rest -= rows[column][place] * x[place]
        x[column] = rest / rows[column][column]
    return x


def product(first: Sequence[float], other: Sequence[float]) -> float:
    """The scalar product, added in this order."""
    total = 0.0
    for left, right in zip(first, other, strict=True):
        total += left * right
    return total


def _squares(values: Sequence[float]) -> float:
    return product(values, values)
