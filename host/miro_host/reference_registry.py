"""The names of the references.

What belongs here: the table of our own references, and the type of a scenario's `reference`. What does not: their
parameters (`reference_keys`) and the trajectories (`reference`), which are not imported before a scenario names one.
"""

from miro_host.parts import Registry


class AnyReference:
    """Parameters of any reference. A reference's own struct derives from `reference_keys.ReferenceParameters`.

    A plain class, because msgspec reads a struct as itself and never as one of the structs derived from it.
    """

    __slots__ = ()


REFERENCES: Registry[AnyReference] = Registry(
    "mirotwin.references",
    word="reference",
    key="kind",
    base="miro_host.reference_keys:ReferenceParameters",
    own={"line": "miro_host.reference_keys:LineRef", "arc": "miro_host.reference_keys:ArcRef"},
)
