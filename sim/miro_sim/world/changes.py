"""Changes of nets and of values of parts on one board, with exact ticks, for waits and checks.

All edges below the tick at which the world stands are known. A net that somebody has watched once is watched to the end
of the run, so that a wait knows what happened on the tick at which the one before it ended. Values are looked at on a
grid of `crystal_hz // 1000` ticks from power-on (1 ms; at 11.0592 MHz 11,059 ticks) and right after each put. Watching
changes no bit of a run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import msgspec

from miro_exact.bad_input import did_you_mean
from miro_robot.board_spec import BoardSpec
from miro_robot.parts.netlist import Netlist
from miro_robot.parts.nets import Observer
from miro_robot.parts.resolve import GROUND, VCC
from miro_robot.wired_board import WiredBoard
from miro_sim.world.conditions import PORT_PINS
from miro_sim.world.followers import Change

if TYPE_CHECKING:
    from miro_sim.world.wire import BoardAlone

KEPT = 1 << 16
"""Entries of a log kept for a reader that has not read it for long."""


class PinPlace(msgspec.Struct, frozen=True):
    """The net of a pin's name, -1 for an unconnected port pin; `port_pin`: 8 * port + bit, or -1."""

    net: int
    port_pin: int = -1
    inverted: bool = False


def find_pin(spec: BoardSpec, netlist: Netlist, name: str) -> PinPlace:
    """The pin that a test names: `P2.0`, a net (`SDA`), a part's pin (`eyes.trig`). Raises ValueError."""
    if name in PORT_PINS:
        port, bit = PORT_PINS[name]
        return PinPlace(netlist.ports[8 * port + bit], 8 * port + bit)
    if name in netlist.names and name not in (GROUND, VCC):
        return PinPlace(netlist.names.index(name))
    if name in spec.nets:
        return find_pin(spec, netlist, spec.nets[name][0])
    part, _, pin = name.partition(".")
    for (other, about), places in zip(spec.parts.items(), netlist.parts, strict=True):
        for number, place in enumerate(places):
            if (other, about.keys.PINS[number].name) == (part, pin) and place.net >= 0:
                return PinPlace(place.net, -1, place.inverted)
    known = names_of_pins(spec, netlist)
    remedy = did_you_mean(name, known) or f"there are P0.0 to P3.7{''.join(f', {key}' for key in known[32:])}"
    raise ValueError(f"pin: {name!r} is no pin, net or part's pin of this board; {remedy}")


def names_of_pins(spec: BoardSpec, netlist: Netlist) -> list[str]:
    """All names that `find_pin` knows, port pins first."""
    nets = [name for name in (*netlist.names, *spec.nets) if name not in (GROUND, VCC)]
    pins = [
        f"{part}.{about.keys.PINS[number].name}"
        for (part, about), places in zip(spec.parts.items(), netlist.parts, strict=True)
        for number, place in enumerate(places)
        if place.net >= 0
    ]
    return [*dict.fromkeys([*PORT_PINS, *nets, *pins])]


class Log:
    """`changes` in the order of time, with serial numbers: `first` is that of the oldest kept."""

    def __init__(self, changes: list[Change]) -> None:
        self.changes = changes
        self.first = 0

    @property
    def end(self) -> int:
        return self.first + len(self.changes)

    def since(self, serial: int, tick: int) -> list[Change]:
        """Changes from `serial` on, before `tick`."""
        changes = self.changes[max(0, serial - self.first) :]
        while changes and changes[-1][0] >= tick:
            changes.pop()
        return changes

    def cut(self, serial: int) -> None:
        """Forgets those from `serial` on: the world goes back."""
        del self.changes[max(0, serial - self.first) :]

    def trim(self) -> None:
        """Forgets the oldest, if there are many."""
        if len(self.changes) > KEPT:
            self.first += len(self.changes) - KEPT // 2
            del self.changes[: -KEPT // 2]

    def clear(self) -> None:
        self.first = self.end
        self.changes.clear()


class Changes:
    """The changes of one board. `edges`: (tick, net, level); `values`: (tick, PART.KEY, value)."""

    NOT_STATE = ("*",)

    def __init__(self, device: BoardAlone, board: WiredBoard) -> None:
        self.device = device
        self.board = board
        self.grid_ticks = device.sample_ticks
        self.observer = Observer(())
        self.edges = Log(self.observer.edges)
        self.values = Log([])
        self.now: dict[str, Any] = {}  # values as they were seen last
        self.look_tick = 0

    # Nets

    def find(self, pin: str) -> PinPlace:
        """Watches a pin from now on. Raises ValueError for one that is not there."""
        nets = self.board.nets
        place = self.device.find_pin(pin)
        if place.net < 0:  # nothing but the port is on it
            place = msgspec.structs.replace(place, net=nets.ports[place.port_pin])
        observed = self.observer.nets
        if place.net not in observed:
            if observed:
                nets.ignore(self.observer)
            self.observer = Observer([*observed, place.net])
            self.observer.edges = self.edges.changes
            nets.observe(self.observer)
        return place

    def level_before(self, net: int, tick: int) -> tuple[int, int]:
        """The level of a net just before `tick`, and the serial number from which its edges from then on stand."""
        changes = self.edges.changes
        level, place = self.board.nets.levels[net], len(changes)
        while place and changes[place - 1][0] >= tick:
            place -= 1
            if changes[place][1] == net:
                level = 1 - changes[place][2]
        return level, self.edges.first + place

    # Values

    def watch_value(self, path: str, tick: int) -> Any:
        """Looks at a value from `tick` on, which is now; returns it. Raises ValueError for one that is not there."""
        value = self.device.value(path)
        if not self.now:
            self.look_tick = (tick // self.grid_ticks + 1) * self.grid_ticks
        self.now.setdefault(path, value)
        return value

    def look(self, tick: int) -> None:
        """Notes the values that have changed at `tick`."""
        for path, before in self.now.items():
            value = self.device.value(path)
            if value != before:
                self.now[path] = value
                self.values.changes.append((tick, path, value))

    def look_at_grid(self) -> None:
        """Samples the values at the next tick of the grid."""
        self.look(self.look_tick)
        self.look_tick += self.grid_ticks

    # Going back

    def records(self) -> list[Any]:
        return [self.edges.end, self.values.end, dict(self.now), self.look_tick]

    def put_back(self, records: list[Any]) -> None:
        edges, values, now, self.look_tick = records
        self.edges.cut(edges)
        self.values.cut(values)
        self.now = {path: now.get(path, value) for path, value in self.now.items()}

    def restart(self, tick: int) -> None:
        """The world was put somewhere else."""
        self.edges.clear()
        self.values.clear()
        for path in self.now:
            self.now[path] = self.device.value(path)
        self.look_tick = (tick // self.grid_ticks + 1) * self.grid_ticks

    def trim(self) -> None:
        self.edges.trim()
        self.values.trim()
