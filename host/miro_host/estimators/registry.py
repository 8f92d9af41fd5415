"""The names of the posture estimators.

None is imported before a scenario names it.
"""

from miro_host.plugins import Registry


class AnyEstimator:
    """Parameters of any estimator. An estimator's own struct derives from `interface.EstimatorParameters`.

    A plain class, because msgspec reads a struct as itself and never as one of the structs derived from it.
    """

    __slots__ = ()


DEFAULT_ESTIMATOR = "none"
ESTIMATORS: Registry[AnyEstimator] = Registry(
    "mirotwin.estimators",
    word="estimator",
    key="kind",
    base="miro_host.estimators.interface:EstimatorParameters",
    own={
        "none": "miro_host.estimators.predict:NoEstimator",
        "ekf": "miro_host.estimators.ekf:EkfParameters",
        "ekf+telemetry": "miro_host.estimators.ekf_telemetry:EkfTelemetryParameters",
        "predict": "miro_host.estimators.predict:PredictParameters",
    },
    default=DEFAULT_ESTIMATOR,
)
