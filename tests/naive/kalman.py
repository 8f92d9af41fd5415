"""Twin of `miro_host.estimators.ekf`: a textbook filter in numpy, with derivatives taken numerically.

The motion is integrated in many small steps, the gain comes from an inverse, and the covariance from (1 - K H) P.
Nothing is shared with the code under test. Its additions have another order, so it agrees within a tolerance only.
"""

import math

import numpy as np


def rim_speed(start, to, slope, time):
    """Speed of a rim that goes from `start` to `to` with a constant slope."""
    change = math.copysign(min(abs(to - start), slope * time), to - start)
    return start + change


def moved(state, left, right, slope, begin, end, track, steps=4000):
    """State after the motion between two times since the effect of one command, by the midpoint rule.

    `left` and `right` are (start, to) of each rim in m/s.
    """
    x, y, theta, left_factor, right_factor = state
    dt = (end - begin) / steps
    for index in range(steps):
        time = begin + (index + 0.5) * dt
        rim_left = left_factor * rim_speed(*left, slope, time)
        rim_right = right_factor * rim_speed(*right, slope, time)
        turn = (rim_right - rim_left) / track * dt
        x += 0.5 * (rim_left + rim_right) * math.cos(theta + 0.5 * turn) * dt
        y += 0.5 * (rim_left + rim_right) * math.sin(theta + 0.5 * turn) * dt
        theta += turn
    return np.array([x, y, theta, left_factor, right_factor])


def derivative(function, state, step=1e-6):
    """Central differences of a function of the state, one column for each of its five numbers."""
    columns = []
    for index in range(5):
        aside = np.zeros(5)
        aside[index] = step
        columns.append((function(state + aside) - function(state - aside)) / (2.0 * step))
    return np.array(columns).T


def predicted(covariance, by, drift, time):
    """F P F^T + Q t."""
    return by @ covariance @ by.T + np.diag(np.square(drift)) * time


def updated(state, covariance, measured, noise):
    """State and covariance after a measurement of the first three, and the innovation's distance in deviations."""
    h = np.eye(3, 5)
    innovation = np.array(measured) - state[:3]
    innovation[2] = math.remainder(innovation[2], math.tau)
    s = h @ covariance @ h.T + np.diag(noise)
    gain = covariance @ h.T @ np.linalg.inv(s)
    distance = math.sqrt(innovation @ np.linalg.inv(s) @ innovation)
    return state + gain @ innovation, (np.eye(5) - gain @ h) @ covariance, distance
