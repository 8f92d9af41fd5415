"""The names of laws, estimators and references. None is imported before a scenario names it.

`Controller`, `AnyEstimator` and `AnyReference` are the parameters of any; a plug-in's own struct derives from the base
in its table. They are plain classes, because msgspec reads a struct as itself and never as one derived from it.
"""

from typing import Any

from miro_exact.plugins import Registry


class Parameters:
    """Parameters of any plug-in."""

    __slots__ = ()

    @classmethod
    def name(cls: Any) -> str:
        """The plug-in's name in scenario files."""
        return str(cls.__struct_config__.tag)


class Controller(Parameters):
    """Parameters of any law."""

    __slots__ = ()


class AnyEstimator(Parameters):
    """Parameters of any estimator."""

    __slots__ = ()


class AnyReference(Parameters):
    """Parameters of any reference."""

    __slots__ = ()


DEFAULT_LAW = "yang_kim"
LAWS: Registry[Controller] = Registry(
    word="law",
    key="law",
    base="miro_host.laws.interface:LawParameters",
    own={
        "yang_kim": "miro_host.laws.yang_kim:Gains",
        "body_frame": "miro_host.laws.body_frame:BodyFrameParameters",
        "kanayama": "miro_host.laws.kanayama:KanayamaParameters",
        "dynamic_feedback": "miro_host.laws.dynamic_feedback:DynamicFeedbackParameters",
        "epsilon_tracking": "miro_host.laws.epsilon_tracking:EpsilonTrackingParameters",
    },
    default=DEFAULT_LAW,
)
DEFAULT_ESTIMATOR = "none"
ESTIMATORS: Registry[AnyEstimator] = Registry(
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
REFERENCES: Registry[AnyReference] = Registry(
    word="reference",
    key="kind",
    base="miro_host.references.interface:ReferenceParameters",
    own={
        "line": "miro_host.references.arc:LineRef",
        "arc": "miro_host.references.arc:ArcRef",
        "sine": "miro_host.references.sine:SineRef",
        "waypoints": "miro_host.references.waypoints:WaypointsRef",
        "timed": "miro_host.references.timed:TimedRef",
    },
)
