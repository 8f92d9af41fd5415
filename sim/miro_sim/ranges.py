"""Structs of numbers that lie in ranges: what the parameters of a plant and of a radio are."""

from typing import ClassVar, NamedTuple

import msgspec


class Within(NamedTuple):
    """The lowest and the highest value of a number, in its annotation: `Annotated[float, Within(0.0, 1.0)]`."""

    low: float
    high: float


class Ranged(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Numbers that are in their range, which `WITHIN` has by name, or None."""

    WITHIN: ClassVar[dict[str, Within]] = {}

    def __init_subclass__(cls) -> None:
        metadata = {name: getattr(kind, "__metadata__", ()) for name, kind in cls.__annotations__.items()}
        cls.WITHIN = cls.WITHIN | {name: metas[0] for name, metas in metadata.items() if metas}

    def __post_init__(self) -> None:
        for name, (low, high) in self.WITHIN.items():
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise ValueError(f"{name} must be {low:g} to {high:g}, got {value!r}")
