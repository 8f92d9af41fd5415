"""The Kalman filter beside a textbook one, and the compiled one beside its source."""

import hashlib
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact import engine
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.rng import Stream
from miro_host.estimators.ekf import EkfParameters
from miro_host.estimators.ekf_telemetry import EkfTelemetryParameters
from miro_host.estimators.filter import Filter
from miro_host.estimators.interface import EstimatorInput
from miro_host.estimators.motion import Motion
from miro_host.eye.track import Sighting
from miro_host.pilot import PERIOD_S
from miro_host.telemetry_receiver import LastTelemetry
from tests.children import uncompiled
from tests.naive import kalman
from tests.states import snapshot


def bits(periods=300):
    """SHA-256 in hex over estimates and memories of a long drive with noise, lost frames and answers."""
    found = hashlib.sha256()
    for parameters in (EkfParameters(wheel_spread=0.05), EkfTelemetryParameters(warp_m=0.005)):
        one, noise = parameters.estimator(), Stream(1, "bits")
        for index in range(periods):
            seen = Sighting(
                0.01 * noise.uniform(4 * index),
                0.01 * noise.uniform(4 * index + 1) + (0.3 if index % 100 > 80 else 0.0),
                0.2 * noise.uniform(4 * index + 2),
                (index - 1) * CONTROL_PERIOD_TICKS,
                noise.uniform(4 * index + 3),
            )
            rims = 0.002 * (index % 50) - 0.04, 0.03 - 0.002 * (index % 31)
            estimate = one.step(
                EstimatorInput(
                    *(index * PERIOD_S, PERIOD_S, None if index % 7 == 0 else seen, 0.0, 0.0, *rims),
                    telemetry=LastTelemetry(
                        *((index // 3 * 3 - 2) * CONTROL_PERIOD_TICKS + 720_000, 0, 0, 0, 0),
                        *(40 * index, -31 * index, 0, 0),
                    ),
                )
            )
            found.update(repr(estimate).encode())
            found.update(snapshot(one))
    return found.hexdigest()


SIZE = 9
"""All that the filter can estimate."""
TRACK_M, SLOPE = 0.068, 6.0
DRIFT = (0.002, 0.01, 0.0002, 0.01)
WARP = (0.005, 0.3)
DOUBT = 0.14
SEEN = np.array([[1.0 if j in (i, i + 7 if i < 2 else i) else 0.0 for j in range(SIZE)] for i in range(3)])

RIM = st.tuples(st.floats(-1.0, 1.0), st.floats(-0.1, 0.1)).map(lambda pair: (pair[0], pair[0] + pair[1]))
ASIDE = st.floats(-0.002, 0.002)


def made(theta, size, left, right, end_s):
    """A filter in the middle of its work, whose next command but one takes effect `end_s` ago."""
    one = Filter(size, Motion(TRACK_M, SLOPE, DOUBT), 0.0087, DRIFT, *WARP)
    one.command(0.0, 0.0, 1.0 + PERIOD_S, PERIOD_S)
    for name, values in (("left", left), ("right", right)):
        for end, value in zip(("start", "to"), values, strict=True):
            setattr(one.motion, f"{name}_{end}_m_s", [value, *[0.0] * 15])
    one.at_s, one.known = 1.0, 1
    one.state = [0.1, -0.2, theta, 1.01, 0.98, *(0.001, -0.002, 0.003, 0.001)[: SIZE - 5]]
    spread = np.array([[2e-3, 2e-3, 2e-2, 9e-3, 9e-3, 1e-3, 1e-3, 5e-3, 5e-3]]).T
    root = np.tril(np.cos(np.arange(81.0).reshape(9, 9))) * spread
    covariance = root @ root.T + np.diag(1e-2 * spread[:, 0] ** 2)
    if size == 5:
        one.state = [*list(one.state)[:5], *[0.0] * 4]
        covariance[5:, :] = covariance[:, 5:] = 0.0
    one.covariance = [float(each) for each in (0.5 * (covariance + covariance.T)).ravel()]
    return one


def matrix(one):
    return np.array(one.covariance).reshape(SIZE, SIZE)


def agree(one, state, covariance, within_m, within_rad, within_spreads):
    off = np.array(one.state) - state
    assert math.hypot(off[0], off[1]) < within_m
    assert abs(math.remainder(off[2], math.tau)) < within_rad
    assert np.abs(off[3:]).max() < 1e-11
    spread = np.sqrt(np.diag(covariance))
    assert (np.abs(matrix(one) - covariance) <= within_spreads * np.outer(spread, spread)).all()


@settings(max_examples=10)
@given(RIM, RIM, st.floats(-3.1, 3.1), st.tuples(ASIDE, ASIDE), st.sampled_from([5, SIZE]))
def test_one_cycle_agrees_with_the_textbook(left, right, theta, aside, size):
    """The prediction within 0.1 mm, 1e-6 rad and 2 % of the spreads (`motion` says why), the update within 1e-11."""
    end_s = 0.8 * PERIOD_S
    one = made(theta, size, left, right, end_s)

    def drive(state, more=(0.0, 0.0)):
        return kalman.moved(state, left, right, SLOPE, 0.0, end_s, TRACK_M, more, steps=300)

    start = np.array(one.state)
    by = kalman.derivative(drive, start)
    covariance = by @ matrix(one) @ by.T
    covariance += np.diag([*[DRIFT[0] ** 2] * 2, DRIFT[1] ** 2, *[DRIFT[2] ** 2] * 2, *[0.0] * 4]) * end_s
    moved_by = kalman.derivative(lambda more: drive(start, more), np.zeros(2))
    rim = [
        (DOUBT * (to - begin) * end_s) ** 2 + DRIFT[3] ** 2 * PERIOD_S * end_s for begin, to in (left, right)
    ]
    covariance += moved_by @ np.diag(rim) @ moved_by.T
    state = drive(start)
    one.predict(1.0 + end_s)
    way = 0.5 * (abs(one.motion.left_m) + abs(one.motion.right_m))
    if size == 5:
        covariance[5:, :] = covariance[:, 5:] = 0.0
    else:
        state, covariance = kalman.warped(state, covariance, way, *WARP)
    agree(one, state, covariance, 1e-4, 1e-6, 2e-2)

    noise = [1e-6, 1e-6, 4e-4]
    before, h = np.array(one.state), SEEN.copy()
    measured = SEEN @ before + [aside[0], -aside[0], 10.0 * aside[1]]
    innovation = measured - SEEN @ before
    innovation[2] = math.remainder(innovation[2], math.tau)
    state, covariance, distance = kalman.updated(before, matrix(one), h, innovation, noise)
    assert math.sqrt(one.distance2(*measured, noise[0], noise[2])) == pytest.approx(distance, rel=1e-9)
    one.see(*measured, noise[0], noise[2])
    agree(one, state, covariance, 1e-11, 1e-11, 1e-9)


@settings(max_examples=10)
@given(st.floats(-0.01, 0.01), st.sampled_from([5, 6]))
def test_a_count_agrees_with_the_textbook_and_begins_anew(extra_m, index):
    one = made(0.3, SIZE, (0.1, 0.2), (0.1, 0.0), 0.02)
    state, before = np.array(one.state), matrix(one)
    h = np.eye(SIZE)[[index]]
    innovation = np.array([extra_m - state[index]])
    state, covariance, distance = kalman.updated(state, before, h, innovation, [1e-8])
    believed = one.count(index, extra_m, 1e-8, 3.0)
    assert believed == (distance <= 3.0)
    if not believed:
        state, covariance = np.array(made(0.3, SIZE, (0.1, 0.2), (0.1, 0.0), 0.02).state), before
    state[index] = 0.0
    covariance[index, :] = covariance[:, index] = 0.0
    agree(one, state, covariance, 1e-11, 1e-11, 1e-9)


@pytest.mark.skipif(engine.active() != "compiled", reason="no compiled modules here")
def test_the_compiled_filter_and_its_source_have_the_same_bits():
    assert uncompiled("from tests.host.test_filter import bits; print(bits())").strip() == bits()
