"""The nets of a board while it runs: who drives them, their levels, and the waves in which changes spread.

    port pins, latches of MOVX ─┐                                          ┌─> `external` levels of the ports
    parts' outputs ─────────────┼─> drivers of a net ──> level of the net ─┼─> pins of parts ──> `changed`
    resistors, VCC, ground ─────┘                                          └─> who watches

Drivers, and what the level of a net is:

    a strong low, perhaps with a strong high    0   (both: contention, a fault once the tick is settled)
    a strong high                               1
    a resistor to ground                        0
    a resistor to VCC, or nothing               1   (X4: a bus that nothing drives reads high)

Ports drive 0 strongly; their 1 is a weak pull-up that a resistor to ground overcomes, of P0 none at all. The order of
things on one tick: what a test puts; parts whose `next_tick` has come, after the continuous parts that are wired to
them, then waves; what the CPU writes, all bits of a port at once, then waves. In a wave each part is called once, with
the set of its pins that have changed; what all of them drive takes effect together after it. Parts are in the order of
their names, so the order of a file changes no bit.

Nothing here is state: levels follow from the drives of the parts and the latches of the ports.
"""

from __future__ import annotations

from collections.abc import Sequence

from miro_exact.clock import NEVER_TICK
from miro_exact.domain import DomainError
from miro_exact.plugins import PluginError
from miro_exact.raised import raised
from miro_robot.parts.keys import LOW, MOST_PINS, RELEASED
from miro_robot.parts.netlist import MOST_PARTS, PORT_PINS, Netlist
from miro_robot.parts.part import Part

MOST_WAVES = 1000
"""On one tick; more are a ring without delay."""
_NEVER = NEVER_TICK
_WAVES = MOST_WAVES


class Nets:
    """Nets of a board, by the numbers of its `netlist`, with its `parts` in the order of their names.

    `external`: by port, what the outside puts on its pins; `ports_changed`: bit per port, since it was last taken.
    `faults`: of the firmware, as parts have found them, until they are taken: order, kind, detail.
    `contended`: nets on which a strong low meets a strong high, as last judged; `new_contention`: one that has begun.
    `edges`: None, or a list of yours that gets (tick, net, level) of the nets that are `watch`ed.
    """

    NOT_STATE = ("*",)

    def __init__(self, netlist: Netlist, parts: Sequence[Part]) -> None:
        self.netlist = netlist
        self.parts = list(parts)
        self.count = len(netlist.names)
        self.part_count = len(self.parts)
        self.names = netlist.names
        self.lows = [0] * 256
        self.highs = [0] * 256
        self.downs = [0] * 256
        self.levels = [1] * 256
        self.contended = [0] * 256
        self.watched = [0] * 256
        self.touched = [0] * 256  # their numbers
        self.is_touched = [0] * 256
        self.touched_count = 0
        self.settled = [0] * 256  # nets touched since contention was last judged
        self.is_settled = [0] * 256
        self.settled_count = 0
        self.edges: list[tuple[int, int, int]] | None = None
        self.ports = list(netlist.ports)
        self.latches = [0xFF] * 4
        self.external = [0xFF] * 4
        self.wired = [0] * 4
        self.ports_changed = 0
        self.new_contention = -1
        self.faults: list[
            tuple[int, int, str]
        ] = []  # of the firmware, that parts have found: order, kind, detail
        self.is_waiting = [0] * 64  # parts with pending pins
        self.is_moving = [0] * 64  # parts that have driven pins
        self.moving = 0  # how many
        self._connect(netlist)
        self.restart()

    def _connect(self, netlist: Netlist) -> None:
        """By net: the pins of parts on it, and the port pins."""
        pins: list[list[tuple[int, int, int]]] = [[] for _ in range(self.count)]
        for index, places in enumerate(netlist.parts):
            for pin, place in enumerate(places):
                if place.net >= 0:
                    pins[place.net].append((index, pin, int(place.inverted)))
        self.first = [0] * 257
        self.pin_part = [0] * 2048
        self.pin_number = [0] * 2048
        self.pin_inverted = [0] * 2048
        end = 0
        for net, on_net in enumerate(pins):
            self.first[net] = end
            for index, pin, inverted in on_net:
                self.pin_part[end], self.pin_number[end], self.pin_inverted[end] = index, pin, inverted
                end += 1
            self.first[net + 1] = end
        self.net_of = [-1] * 2048  # by part and pin
        self.inverted = [0] * 2048
        for index, places in enumerate(netlist.parts):
            for pin, place in enumerate(places):
                self.net_of[index * MOST_PINS + pin] = place.net
                self.inverted[index * MOST_PINS + pin] = int(place.inverted)
        self.port_of = [-1] * 256  # a port pin on the net; others follow by `next_port`
        self.next_port = [-1] * 32
        for number, net in enumerate(netlist.ports):
            if net >= 0:
                self.next_port[number] = self.port_of[net]
                self.port_of[net] = number
                self.wired[number >> 3] |= 1 << (number & 7)
        self.latch_nets = [net for nets in netlist.latches for net in nets]
        feeders = [self._feeders(netlist, index) for index in range(self.part_count)]
        self.feeder_first = [0] * 65
        self.feeder = [0] * 4096
        end = 0
        for index, there in enumerate(feeders):
            for feeder in there:
                self.feeder[end] = feeder
                end += 1
            self.feeder_first[index + 1] = end
        self.reaches = self._reaching(netlist)

    def _feeders(self, netlist: Netlist, index: int) -> list[int]:
        """The continuous parts that share a net with a part."""
        mine = {place.net for place in netlist.parts[index] if place.net >= 0}
        return [
            other
            for other, part in enumerate(self.parts)
            if other != index
            and part.continuous
            and mine.intersection(place.net for place in netlist.parts[other])
        ]

    def _reaching(self, netlist: Netlist) -> list[int]:
        """By part, 1 if what it does may come to a port pin, also by way of other parts."""
        nets = {net for net in netlist.ports if net >= 0}
        nets.update(net for buffer in netlist.buffers for net in buffer)
        reaching = [0] * MOST_PARTS
        more = [-1]
        while more:
            more = [
                index
                for index, places in enumerate(netlist.parts)
                if not reaching[index] and nets.intersection(place.net for place in places)
            ]
            for index in more:
                reaching[index] = 1
                nets.update(place.net for place in netlist.parts[index] if place.net >= 0)
        return reaching

    # Beginning, and going on from a saved state

    def restart(self) -> None:
        """Levels from scratch: those of the drives of all parts, ports with their latches."""
        for net in range(self.count):
            self.lows[net] = self.highs[net] = self.downs[net] = 0
            self.contended[net] = self.is_touched[net] = self.is_settled[net] = 0
        self.touched_count = self.settled_count = 0
        self.moving = 0
        netlist = self.netlist
        for net in netlist.lows:
            self.lows[net] += 1
        for net in netlist.highs:
            self.highs[net] += 1
        for net in netlist.pull_downs:
            self.downs[net] += 1
        for number in range(PORT_PINS):
            if self.ports[number] >= 0:
                self._add_port(number, 1)
        for index in range(self.part_count):
            part = self.parts[index]
            part.pending = part.moved = 0
            self.is_waiting[index] = self.is_moving[index] = 0
            for pin in range(MOST_PINS):
                part.wanted[pin] = part.drives[pin]
                self._add_drive(index, pin, part.drives[pin], 1)
        for net in range(self.count):
            self.levels[net] = self._level(net, 0, 0)
            self._show(net)
        for index in range(self.part_count):
            self.parts[index].pending = self.is_waiting[index] = 0
        for net in range(self.count):
            self.contended[net] = 1 if self.lows[net] and self.highs[net] else 0
        self.new_contention = -1
        self.ports_changed = 0
        for port in range(4):
            self.external[port] = self._external(port)

    def watch(self, net: int, on: int) -> None:
        """From now on `edges` gets the changes of a net, or does not."""
        self.watched[net] = on

    # Time

    def next_tick(self) -> int:
        """Of the next event of a part."""
        tick = _NEVER
        for index in range(self.part_count):
            tick = min(tick, self._part(index).next_tick)
        return tick

    def reach_tick(self) -> int:
        """The first tick at which an event may change a port pin."""
        tick = _NEVER
        for index in range(self.part_count):
            if self.reaches[index]:
                part = self._part(index)
                tick = min(tick, max(part.next_tick, part.reach_tick))
        return tick

    def _part(self, index: int) -> Part:
        return self.parts[index]

    def due(self, tick: int) -> None:
        """The events of all parts at `tick`, which is the earliest, and what follows from them."""
        for index in range(self.part_count):
            part = self._part(index)
            if part.next_tick <= tick:
                for place in range(self.feeder_first[index], self.feeder_first[index + 1]):
                    self._call(self.feeder[place], 2, tick)
        for index in range(self.part_count):
            part = self._part(index)
            if part.next_tick <= tick:
                self._call(index, 1, tick)
        self.settle(tick)

    # Drivers

    def write_port(self, port: int, latch: int, tick: int) -> None:
        """The latch of a port has changed: all its bits at once, then waves."""
        changed = (self.latches[port] ^ latch) & self.wired[port]
        for bit in range(8):
            if changed >> bit & 1:
                self._add_port(8 * port + bit, -1)
        self.latches[port] = latch
        for bit in range(8):
            if changed >> bit & 1:
                self._add_port(8 * port + bit, 1)
                self._touch(self.ports[8 * port + bit])
        self.settle(tick)

    def _add_port(self, number: int, count: int) -> None:
        if not self.latches[number >> 3] >> (number & 7) & 1:
            self.lows[self.ports[number]] += count

    def write_latch(self, index: int, before: int, after: int, tick: int) -> None:
        """An output latch of MOVX stores a byte; no waves yet."""
        for bit in range(8):
            net = self.latch_nets[8 * index + bit]
            if (before ^ after) >> bit & 1 and net >= 0:
                self._drive_latch(net, before >> bit & 1, -1)
                self._drive_latch(net, after >> bit & 1, 1)
                self._touch(net)

    def add_latch(self, index: int, value: int) -> None:
        """An output latch of MOVX drives its nets from now on; for `restart`."""
        for bit in range(8):
            net = self.latch_nets[8 * index + bit]
            if net >= 0:
                self._drive_latch(net, value >> bit & 1, 1)

    def _drive_latch(self, net: int, level: int, count: int) -> None:
        if level:
            self.highs[net] += count
        else:
            self.lows[net] += count

    def _add_drive(self, index: int, pin: int, drive: int, count: int) -> None:
        """A driver comes (1) or goes (-1)."""
        net = self.net_of[index * MOST_PINS + pin]
        if net >= 0 and drive != RELEASED:
            if drive ^ self.inverted[index * MOST_PINS + pin]:
                self.highs[net] += count
            else:
                self.lows[net] += count

    # Waves

    def settle(self, tick: int) -> None:
        """Waves until nothing changes any more. Raises PluginError for a ring without delay."""
        waves = 0
        while self.moving or self.touched_count:
            self._take_effect()
            self._spread(tick)
            for index in range(self.part_count):
                if self.is_waiting[index]:
                    self.is_waiting[index] = 0
                    self._call(index, 0, tick)
            waves += 1
            if waves > _WAVES:
                raise self._ring(tick)
        self._judge()

    def collect(self, index: int, tick: int) -> None:
        """A part was called from outside of a wave: what it drives takes effect with the next one."""
        self._after(index, tick)

    def call(self, index: int, tick: int) -> None:
        """The same, and the waves."""
        self._after(index, tick)
        self.settle(tick)

    def _call(self, index: int, what: int, tick: int) -> None:
        """Calls `changed` (0), `due` (1) or `advance` (2) of a part. Raises PluginError for what it does wrong."""
        part = self._part(index)
        pins = part.pending
        part.pending = 0
        try:
            if what == 0:
                part.changed(pins, tick)
            elif what == 1:
                part.due(tick)
            else:
                part.advance(tick)
        except (Exception, SystemExit) as error:
            raise self._cannot(index, tick, pins if what == 0 else 0, error) from error
        self._after(index, tick)

    def _after(self, index: int, tick: int) -> None:
        part = self._part(index)
        if part.next_tick <= tick:
            raise self._too_early(index, tick)
        if part.faults:
            self.faults += part.faults
            part.faults = []
        if part.moved and not self.is_moving[index]:
            self.is_moving[index] = 1
            self.moving += 1

    def _take_effect(self) -> None:
        """What the parts of the last wave drive, all at once."""
        self.moving = 0
        for index in range(self.part_count):
            if self.is_moving[index]:
                self.is_moving[index] = 0
                part = self._part(index)
                moved = part.moved
                part.moved = 0
                for pin in range(MOST_PINS):
                    if moved >> pin & 1 and part.wanted[pin] != part.drives[pin]:
                        self._add_drive(index, pin, part.drives[pin], -1)
                        part.drives[pin] = part.wanted[pin]
                        self._add_drive(index, pin, part.drives[pin], 1)
                        if self.net_of[index * MOST_PINS + pin] >= 0:
                            self._touch(self.net_of[index * MOST_PINS + pin])

    def _touch(self, net: int) -> None:
        if not self.is_touched[net]:
            self.is_touched[net] = 1
            self.touched[self.touched_count] = net
            self.touched_count += 1

    def _spread(self, tick: int) -> None:
        """New levels of the nets whose drivers have changed, to all that are on them."""
        for place in range(self.touched_count):
            net = self.touched[place]
            self.is_touched[net] = 0
            level = self._level(net, 0, 0)
            changed = level != self.levels[net]
            self.levels[net] = level
            self._show(net)
            if changed:
                self._mark(net)
                if self.watched[net] and self.edges is not None:
                    self.edges.append((tick, net, level))
            if not self.is_settled[net]:
                self.is_settled[net] = 1
                self.settled[self.settled_count] = net
                self.settled_count += 1
            number = self.port_of[net]
            while number >= 0:
                self.ports_changed |= 1 << (number >> 3)
                number = self.next_port[number]
        self.touched_count = 0

    def _level(self, net: int, low: int, high: int) -> int:
        """The level of a net without so many of its strong drivers."""
        if self.lows[net] > low:
            return 0
        if self.highs[net] > high:
            return 1
        return 0 if self.downs[net] else 1

    def _show(self, net: int) -> None:
        """Puts the level on the pins of the parts."""
        level = self.levels[net]
        for place in range(self.first[net], self.first[net + 1]):
            part = self._part(self.pin_part[place])
            pin = self.pin_number[place]
            inverted = self.pin_inverted[place]
            drive = part.drives[pin]
            low = high = 0
            if drive != RELEASED:
                low = 1 if drive ^ inverted == LOW else 0
                high = 1 - low
            bit = 1 << pin
            part.levels = part.levels & ~bit | (level ^ inverted) << pin
            part.outside = part.outside & ~bit | (self._level(net, low, high) ^ inverted) << pin
            strong = 1 if self.lows[net] > low or self.highs[net] > high else 0
            if part.senses_drive and part.driven >> pin & 1 != strong:
                part.pending |= bit
                self.is_waiting[self.pin_part[place]] = 1
            part.driven = part.driven & ~bit | strong << pin

    def _mark(self, net: int) -> None:
        """The parts on a net are to be called."""
        for place in range(self.first[net], self.first[net + 1]):
            index = self.pin_part[place]
            part = self._part(index)
            part.pending |= 1 << self.pin_number[place]
            self.is_waiting[index] = 1

    def _judge(self) -> None:
        """Contention, once the tick is settled: one fault where it begins."""
        for place in range(self.settled_count):
            net = self.settled[place]
            self.is_settled[net] = 0
            both = 1 if self.lows[net] and self.highs[net] else 0
            if both and not self.contended[net]:
                self.new_contention = net
            self.contended[net] = both
        self.settled_count = 0

    # Ports

    def take_external(self, port: int) -> int:
        """Whether the outside puts other levels on a port than it did; `external` has them."""
        if not self.ports_changed >> port & 1:
            return 0
        self.ports_changed &= ~(1 << port)
        levels = self._external(port)
        if levels == self.external[port]:
            return 0
        self.external[port] = levels
        return 1

    def _external(self, port: int) -> int:
        """What the outside puts on the pins of a port: the level of each net without the port's own drive."""
        levels = 0xFF
        for bit in range(8):
            net = self.ports[8 * port + bit]
            if net >= 0:
                own_low = 1 - (self.latches[port] >> bit & 1)
                if not self._level(net, own_low, 0):
                    levels &= ~(1 << bit)
        return levels

    # What is wrong

    def drivers(self, net: int) -> list[str]:
        """Who drives a net strongly, by name."""
        there = [
            f"P{number >> 3}.{number & 7}"
            for number in range(PORT_PINS)
            if self.ports[number] == net and not self.latches[number >> 3] >> (number & 7) & 1
        ]
        for place in range(self.first[net], self.first[net + 1]):
            part, pin = self.parts[self.pin_part[place]], self.pin_number[place]
            if part.drives[pin] != RELEASED:
                there.append(f"{part.name}.{part.keys.PINS[pin].name}")
        there += ["ground"] * (net in self.netlist.lows) + ["VCC"] * (net in self.netlist.highs)
        return there

    def _place(self, index: int, pins: int, tick: int) -> str:
        part = self.parts[index]
        names = [pin.name for number, pin in enumerate(part.keys.PINS) if pins >> number & 1]
        there = f", pin {', '.join(names)}" if names else ""
        return f"part {part.name!r} ({part.keys.name}){there}, tick {tick}"

    def _cannot(self, index: int, tick: int, pins: int, error: BaseException) -> PluginError:
        if isinstance(error, (PluginError, DomainError)):
            return PluginError(f"{self._place(index, pins, tick)}: {error}")
        return PluginError(f"{self._place(index, pins, tick)}: {raised(error)}", "repair the part")

    def _too_early(self, index: int, tick: int) -> PluginError:
        reason = f"wants its next event at tick {self.parts[index].next_tick}, which is past"
        return PluginError(
            f"{self._place(index, 0, tick)}: {reason}", "set next_tick beyond the tick of the call"
        )

    def _ring(self, tick: int) -> PluginError:
        pins = {index: self.parts[index].moved for index in range(self.part_count) if self.is_moving[index]}
        where = "; ".join(self._place(index, moved, tick) for index, moved in pins.items())
        return PluginError(f"{where}: a ring without delay: no end after {_WAVES} waves", "give one a delay")

    def __repr__(self) -> str:
        return f"Nets({self.count} nets, {self.part_count} parts)"
