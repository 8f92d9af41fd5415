"""Structs of numbers that lie in ranges: what the parameters of a plant and of a radio are."""

from typing import ClassVar

import msgspec

Ranges = dict[str, tuple[float, float]]
"""Lowest and highest value of numbers, by their names."""


class Ranged(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Numbers that are in their range, see WITHIN, or None."""

    WITHIN: ClassVar[Ranges] = {}

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if value is None or name not in self.WITHIN:
                continue
            low, high = self.WITHIN[name]
            if not low <= value <= high:
                raise ValueError(f"{name} must be {low:g} to {high:g}, got {value!r}")
