"""The interface of a board's parts: keys, pins, values that a test may put and read, and behaviour.

A part is two classes in one file. `PartKeys` is the table of the board file: a frozen struct whose tag is the part's
name, with its pins, its values and its sheet as class variables; `make` gives the `Part`, which behaves.

    others' drives ──► net ──► levels, outside, driven ──► changed(pins, tick)   pins of it have other levels
                                             time      ──► due(tick)             `next_tick` has come
                                             a test    ──► put(name, value, tick)
    net <── drive(pin, level)  <── what the part answers, on the same tick or from a later `next_tick` on

A call takes no time. All parts that are called on one tick see the same levels; what they drive takes effect together
afterwards, and then those are called whose pins have other levels. Time is in ticks of the board's crystal: `ticks(us)`
converts. A part changes at its events and at edges of its pins only, never because somebody looks at it: `read` gets
the tick and works out from what the part keeps what it is by then.
"""

from __future__ import annotations

from typing import Any

from miro_exact.clock import NEVER_TICK
from miro_exact.state import TICK
from miro_robot.faults import FaultKind
from miro_robot.parts.keys import IN, LOW, MOST_PINS, RELEASED, STRONG, TWO_WAY, PartKeys, Place

_NEVER = NEVER_TICK
_FAULT_KINDS = frozenset(int(kind) for kind in FaultKind)


class Part:
    """A part on a board.

    `levels`, `outside`, `driven`: bit per pin: the level of its net; the same without the part's own drive; whether
    another part drives the net strongly. `next_tick`: of its next event; `reach_tick`: of the next that may change one
    of its outputs, if that is later. Set both after each call, beyond its tick.
    """

    STATE: dict[str, Any] = {"next_tick": TICK, "reach_tick": TICK, "drives": ("32B", 0, 2)}
    NOT_STATE: tuple[str, ...] = (
        *("keys", "place", "name", "crystal_hz", "continuous", "senses_drive", "low_pins", "high_pins"),
        *("levels", "outside", "driven", "pending", "wanted", "moved"),  # follow from the drives of all
        "faults",  # the board takes them at once
    )
    CONTINUOUS = False
    """True if it moves on all the time: `advance` is called before each event of a part that is wired to it."""
    SENSES_DRIVE = False
    """True if `changed` is also called when only `is_driven` of a pin changes: a motor that is let go coasts."""

    def __init__(self, keys: PartKeys, place: Place) -> None:
        self.keys = keys
        self.place = place
        self.name = place.name
        self.crystal_hz = place.crystal_hz
        self.continuous = 1 if self.CONTINUOUS else 0
        self.senses_drive = 1 if self.SENSES_DRIVE else 0
        self.next_tick = NEVER_TICK
        self.reach_tick = 0  # not later than the next event
        self.driven = 0
        self.levels = 0
        for number, pin in enumerate(keys.PINS):
            self.levels |= pin.level << number  # where nothing is connected; the nets put the others
        self.outside = self.levels
        self.pending = 0  # pins that have changed since the last call
        self.moved = 0  # pins that the part has driven since the last wave
        self.low_pins = self.high_pins = 0  # pins that it may drive low, .. high
        for number, pin in enumerate(keys.PINS):
            self.low_pins |= int(pin.kind != IN) << number
            self.high_pins |= int(pin.kind in (STRONG, TWO_WAY)) << number
        self.wanted = [RELEASED] * 32
        self.drives = [RELEASED] * 32
        self.faults: list[
            tuple[int, int, str, int]
        ] = []  # order, kind, detail, ticks ago: since the last call

    # What it may ask and do

    def level(self, pin: int) -> int:
        """The level of the net at `pin`."""
        return self.levels >> pin & 1

    def others(self, pin: int) -> int:
        """The level that the net would have without the part's own drive."""
        return self.outside >> pin & 1

    def is_driven(self, pin: int) -> int:
        """True if another part drives the net to a level, strongly: 0 where it floats or hangs on a resistor."""
        return self.driven >> pin & 1

    def drive(self, pin: int, level: int) -> None:
        """From the tick of this call on the part drives `pin` LOW or HIGH, or has RELEASED it.

        Raises ValueError for a pin or a level that the part does not have.
        """
        if pin < 0 or pin >= MOST_PINS or level < LOW or level > RELEASED:
            raise ValueError(f"drives pin {pin} to level {level}, which does not exist")
        if level != RELEASED and not (self.high_pins if level else self.low_pins) >> pin & 1:
            raise ValueError(
                f"drives its pin {self._named(pin)} {'high' if level else 'low'}, which it cannot"
            )
        if self.wanted[pin] != level:
            self.wanted[pin] = level
            self.moved |= 1 << pin

    def fault(self, kind: int, detail: str, order: int = 0, ago: int = 0) -> None:
        """The firmware does to the part what it must not (`faults.py`), on the tick of this call or `ago` ticks before.

        What it does to several parts on one tick is one fault if kind and `order` are the same: of a tick, those of
        lower order come first. Raises ValueError for a kind that there is not.
        """
        if kind not in _FAULT_KINDS:
            raise ValueError(f"has found a fault of kind {kind}, which does not exist")
        self.faults.append((order, kind, detail, ago))

    def source(self, pin: int) -> Part | None:
        """The part whose output is on the net of `pin`, as a motor's shaft; from `start` on."""
        for part, number in self.place.peers.get(pin, []):
            if part.keys.PINS[number].kind == STRONG:
                return part
        return None

    def _named(self, pin: int) -> str:
        return self.keys.PINS[pin].name if pin < len(self.keys.PINS) else str(pin)

    def ticks(self, us: float) -> int:
        """Microseconds to ticks, rounded half up."""
        return int(us * self.crystal_hz / 1e6 + 0.5)

    # What it does

    def start(self, tick: int) -> None:
        """The supply comes up at `tick`: everything as at first, but what a part keeps without supply."""

    def supply(self, on: int, tick: int) -> None:
        """The supply of the board is switched: off, a part lets go of its pins and stands; on, it starts."""
        if on:
            self.start(tick)
            return
        self.next_tick = _NEVER
        for pin in range(MOST_PINS):
            self.drive(pin, RELEASED)

    def changed(self, pins: int, tick: int) -> None:
        """`pins`, bit per pin, have other levels from `tick` on."""

    def due(self, tick: int) -> None:
        """`next_tick` has come."""
        self.next_tick = _NEVER

    def advance(self, tick: int) -> None:
        """Advances a continuous part to `tick`, before a part that is wired to it has an event there."""

    def put(self, name: str, value: Any, tick: int) -> None:
        """A test puts `value`, of the type in `PUTS`, at `tick`."""
        setattr(self, name, value)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        """A value in `READS` as it is at `tick`; reading changes nothing.

        `tick` is the end of the last instruction, or the part's next event if that comes first: never before a call
        that the part has had. So a value is the same whoever looks, and however often.
        """
        value: float | int | bool | str = getattr(self, name)
        return value

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name})"
