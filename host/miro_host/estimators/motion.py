"""How the state of the filter moves, and by how much its end changes with its beginning.

What belongs here: the state (x, y, theta, left factor, right factor), moved along circular arcs, and the derivative of
that. What does not: the speeds of the wheels (`wheel_model`), probabilities (`ekf`).

A wheel whose radius is the nominal one times a factor goes the nominal way times that factor. In one stretch the robot
goes v = (l fl + r fr) / 2 and turns by w = (r fr - l fl) / track. Its chord has the direction theta + w/2 and the
length v sin(w/2) / (w/2). The derivative leaves the last quotient as it is; for w = 0.1 rad it is 0.9996. While a rim's
speed changes the path is no exact circle: a change of both rims by 0.1 m/s in opposite senses at 1 m/s costs 0.07 mm.
"""

from collections.abc import Iterable

from miro_exact.dmath import sincos, wrap_pi
from miro_host.estimators.matrix import Matrix, diagonal
from miro_host.estimators.wheel_model import Stretch

State = list[float]
X, Y, THETA, LEFT, RIGHT = range(5)


def driven(state: State, way: Iterable[Stretch], track_m: float) -> tuple[State, Matrix]:
    """The state at the end of the way, and its derivative by the state at the beginning."""
    x, y, theta, left_factor, right_factor = state
    by = diagonal([1.0, 1.0, 1.0, 1.0, 1.0])
    by_x, by_y, by_theta = by[X], by[Y], by[THETA]
    for _, left_m, right_m in way:
        length = 0.5 * (left_m * left_factor + right_m * right_factor)
        half = 0.5 * (right_m * right_factor - left_m * left_factor) / track_m
        sin_half, _ = sincos(half)
        shrink = sin_half / half if abs(half) > 1e-6 else 1.0  # sin(h) / h is 1 - h^2 / 6
        sin, cos = sincos(theta + half)
        dx, dy = shrink * cos, shrink * sin
        x += length * dx
        y += length * dy
        theta = wrap_pi(theta + 2.0 * half)
        by_x[THETA] -= length * dy
        by_y[THETA] += length * dx
        for factor, rim_m, sign in ((LEFT, left_m, -0.5), (RIGHT, right_m, 0.5)):
            middle = by_theta[factor] + sign * rim_m / track_m  # of the chord's direction
            by_x[factor] += 0.5 * rim_m * dx - length * dy * middle
            by_y[factor] += 0.5 * rim_m * dy + length * dx * middle
            by_theta[factor] += 2.0 * sign * rim_m / track_m
    return [x, y, theta, left_factor, right_factor], by
