"""The keys of a part, its pins, and where it is soldered."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import msgspec

if TYPE_CHECKING:
    from miro_exact.rng import Stream
    from miro_robot.parts.part import Part

IN, STRONG, OPEN_DRAIN, TWO_WAY = range(4)
"""Kinds of pins: an input; an output that drives both levels, or lets go; pulls low or lets go, and is an input, too;
drives both levels or lets go, and is an input, too: a data bus.
"""
LOW, HIGH, RELEASED = 0, 1, 2
"""Drives of a pin by a part. RELEASED: the driver has let go and drives nothing."""
MOST_PINS = 32
"""A part has 30 at most."""


class Pin(NamedTuple):
    """A pin of a part. `optional`: it need not be connected; `level` is then what the part finds there."""

    name: str
    kind: int = IN
    optional: bool = False
    level: int = 1


class Place(msgspec.Struct, frozen=True):
    """The place of a part on the board: its name, the crystal, its noise, and the parts that share the nets of its
    pins.

    `at_cpu`: pins on a net with a port pin, or that a MOVX reads. `peers`: by pin, the other parts on its net with the
    index of their pin; parts that are made later are put in before `start`.
    """

    name: str
    crystal_hz: int
    noise: Stream
    connected: frozenset[int]
    peers: dict[int, list[tuple[Part, int]]]
    at_cpu: frozenset[int] = frozenset()


class PartKeys(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="part"):
    """Base of the keys of every part. Derive with `frozen=True, kw_only=True, tag="name_of_the_part"`.

    `PINS`: in the order of their numbers. `AT`: pins of the serial line, with the port pin that they must be on.
    `PUTS`: what a test may put, each with its type, as `Annotated[float, Meta(ge=2.0)]`. `READS`: what it may read,
    each with a few words. `SHEET`: the maker's sheet.
    """

    PINS: ClassVar[tuple[Pin, ...]] = ()
    AT: ClassVar[dict[str, str]] = {}
    PUTS: ClassVar[dict[str, Any]] = {}
    READS: ClassVar[dict[str, str]] = {}
    SHEET: ClassVar[str] = ""

    @property
    def name(self) -> str:
        return str(self.__struct_config__.tag)

    def pin_kind(self, number: int) -> int:
        """The kind of a pin of a part with these keys, which may be less than what its kind allows."""
        return self.PINS[number].kind

    @property
    def pulled_up(self) -> tuple[str, ...]:
        """Pins that the part itself pulls up to VCC, as a resistor would: nothing else needs to drive them high."""
        return ()

    @property
    def never_low(self) -> tuple[str, ...]:
        """Outputs that drive high or let go: who else reads the net sees a change only if something pulls it low."""
        return ()

    @property
    def line_baud(self) -> int:
        """The rate of who is at the other end of the serial line behind this part; 0: as if it was not there."""
        return 0

    def make(self, place: Place) -> Part:
        """The part of these keys, soldered to this place."""
        raise NotImplementedError
