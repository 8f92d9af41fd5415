"""What the estimators make of a long drive with noise, lost frames and answers, as a hash: for both engines."""

import hashlib
import math

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.rng import Stream
from miro_exact.state import snapshot
from miro_host.estimators.ekf import EkfParameters
from miro_host.estimators.interface import EstimatorInput
from miro_host.eye.track import Sighting
from miro_host.pilot import PERIOD_S


def bits(periods=300):
    """SHA-256 in hex over estimates and memories."""
    found = hashlib.sha256()
    for parameters in (EkfParameters(), EkfParameters(rim_noise_m_s=0.05, wheel_spread=0.05)):
        one, noise = parameters.estimator(), Stream(1, "bits")
        for index in range(periods):
            seen = Sighting(
                0.3 * math.ldexp(round(1e6 * noise.uniform(4 * index)), -20),
                0.1 * noise.uniform(4 * index + 1),
                6.0 * noise.uniform(4 * index + 2) - 3.0,
                (index - 1) * CONTROL_PERIOD_TICKS,
                noise.uniform(4 * index + 3),
            )
            rims = 0.02 * (index % 50) - 0.4, 0.4 - 0.03 * (index % 31)
            estimate = one.step(
                EstimatorInput(index * PERIOD_S, PERIOD_S, None if index % 7 == 0 else seen, 0.0, 0.0, *rims)
            )
            found.update(repr(estimate).encode())
            found.update(snapshot(one))
    return found.hexdigest()
