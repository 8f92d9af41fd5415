"""Twin of `miro_host.estimators.filter`: a textbook filter in numpy, with derivatives taken numerically.

The motion is integrated in many small steps, the gain comes from an inverse, and the covariance from (1 - K H) P.
Nothing is shared with the code under test. Its additions have another order, so it agrees within a tolerance only.
"""

import math

import numpy as np


def rim_speed(start, to, slope, time):
    """Speed of a rim that goes from `start` to `to` with a constant slope."""
    change = math.copysign(min(abs(to - start), slope * time), to - start)
    return start + change


def moved(state, left, right, slope, begin, end, track, aside=(0.0, 0.0), steps=4000):
    """State after the motion between two times since the effect of one command, by the midpoint rule.

    `left` and `right` are (start, to) of each rim in m/s, `aside` the ways in m by which the rims go further, evenly.
    """
    x, y, theta, left_factor, right_factor, extra_left, extra_right, *warp = state
    dt = (end - begin) / steps
    more = [way / (end - begin) for way in aside]
    for index in range(steps):
        time = begin + (index + 0.5) * dt
        rim_left = left_factor * (rim_speed(*left, slope, time) + more[0])
        rim_right = right_factor * (rim_speed(*right, slope, time) + more[1])
        turn = (rim_right - rim_left) / track * dt
        x += 0.5 * (rim_left + rim_right) * math.cos(theta + 0.5 * turn) * dt
        y += 0.5 * (rim_left + rim_right) * math.sin(theta + 0.5 * turn) * dt
        theta += turn
    extras = extra_left + aside[0], extra_right + aside[1]
    return np.array([x, y, theta, left_factor, right_factor, *extras, *warp])


def derivative(function, at, step=1e-6):
    """Central differences of a function of some numbers, one column for each."""
    columns = []
    for index in range(len(at)):
        aside = np.zeros(len(at))
        aside[index] = step
        columns.append((function(at + aside) - function(at - aside)) / (2.0 * step))
    return np.array(columns).T


def warped(state, covariance, way, warp, length):
    """The camera's warp after a way: a first-order Gauss-Markov process of the way."""
    kept = max(0.0, 1.0 - way / length)
    by = np.diag([1.0] * 7 + [kept] * 2)
    grown = np.diag([0.0] * 7 + [(1.0 - kept * kept) * warp * warp] * 2)
    return by @ state, by @ covariance @ by.T + grown


def updated(state, covariance, h, innovation, noise):
    """State and covariance after a measurement h state, and the innovation's distance in deviations."""
    s = h @ covariance @ h.T + np.diag(noise)
    gain = covariance @ h.T @ np.linalg.inv(s)
    distance = math.sqrt(innovation @ np.linalg.inv(s) @ innovation)
    return state + gain @ innovation, (np.eye(len(state)) - gain @ h) @ covariance, distance
