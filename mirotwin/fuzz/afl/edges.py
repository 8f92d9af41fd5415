"""The edges that a set of inputs executes together.

AFL++ says how many edges it has seen once a minute; this counts them when asked.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mirotwin.fuzz.target import Target

_ONE_IF_ANY = bytes([0]) + bytes([1]) * 255


class EdgeUnion:
    """Edges of all inputs that were `add`ed. `count` is how many these are.

    The target counts into this object's map from then on: give it another by `use_map` to use it elsewhere.
    """

    def __init__(self, target: Target) -> None:
        self._target = target
        self._edges = bytearray(target.map_size)
        self._none = bytes(target.map_size)
        self._seen = 0

    @property
    def count(self) -> int:
        """Edges seen."""
        return self._seen.bit_count()

    def add(self, data: bytes) -> int:
        """Runs an input; how many edges no input before has executed. Those of a run with a failure do not count."""
        self._edges[:] = self._none
        self._target.use_map(self._edges)
        if self._target.run(data):
            return 0
        before = self.count
        self._seen |= int.from_bytes(self._edges.translate(_ONE_IF_ANY), "little")
        return self.count - before
