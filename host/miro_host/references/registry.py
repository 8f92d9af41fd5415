"""The names of the references."""

from miro_host.plugins import Registry


class AnyReference:
    """Parameters of any reference. A reference's own struct derives from `interface.ReferenceParameters`.

    A plain class, because msgspec reads a struct as itself and never as one of the structs derived from it.
    """

    __slots__ = ()


REFERENCES: Registry[AnyReference] = Registry(
    "mirotwin.references",
    word="reference",
    key="kind",
    base="miro_host.references.interface:ReferenceParameters",
    own={
        "line": "miro_host.references.line:LineRef",
        "arc": "miro_host.references.arc:ArcRef",
        "sine": "miro_host.references.sine:SineRef",
        "waypoints": "miro_host.references.waypoints:WaypointsRef",
    },
)
