"""The names of the tracking laws.

No law is imported before a scenario names it.
"""

from miro_host.plugins import Registry


class Controller:
    """Parameters of any law. A law's own struct derives from `interface.LawParameters`.

    A plain class, because msgspec reads a struct as itself and never as one of the structs derived from it.
    """

    __slots__ = ()


DEFAULT_LAW = "yang_kim"
LAWS: Registry[Controller] = Registry(
    "mirotwin.laws",
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
