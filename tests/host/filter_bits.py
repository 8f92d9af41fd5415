"""What the estimators make of a long drive with noise, lost frames and answers, as a hash: for both engines."""

import hashlib

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.rng import Stream
from miro_exact.state import snapshot
from miro_host.estimators.ekf import EkfParameters
from miro_host.estimators.ekf_telemetry import EkfTelemetryParameters
from miro_host.estimators.interface import EstimatorInput
from miro_host.eye.track import Sighting
from miro_host.pilot import PERIOD_S
from miro_host.telemetry_receiver import LastTelemetry


def bits(periods=300):
    """SHA-256 in hex over estimates and memories."""
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
