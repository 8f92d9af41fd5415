"""The nets of a board while it runs: who drives them, their levels, and the waves in which changes spread.

    port pins, latches of MOVX ─┐                                          ┌─> `external` levels of the ports
    parts' outputs ─────────────┼─> drivers of a net ──> level of the net ─┼─> pins of parts ──> `changed`
    resistors, VCC, ground ─────┘                                          └─> observers

Drivers, and what the level of a net is:

    a short of a port pin, a fault              that of the rail, whoever drives
    a strong low, perhaps with a strong high    0   (both: contention, a fault once the tick is settled)
    a strong high                               1
    a resistor to ground                        0
    a resistor to VCC, or nothing               1   (X4: a bus that nothing drives reads high)

Ports drive 0 strongly; their 1 is a weak pull-up that a resistor to ground overcomes, of P0 none at all. The order of
things on one tick: what a test puts; parts whose `next_tick` has come, after the continuous parts that are wired to
them, then waves; what the CPU writes, all bits of a port at once, then waves. In a wave each part is called once, with
the set of its pins that have changed; what all of them drive takes effect together after it. Parts are in the order of
their names, so the order of a file changes no bit.

Nothing here is state: levels follow from the drives of the parts and the latches of the ports. What parts have set
(`next_tick`, `reach_tick`, the pins they drive) is looked up after each call of them, of them alone; between parts of
which one is continuous, one may also set these of the other (an encoder's next edge, by its motor).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from miro_exact.clock import NEVER_TICK
from miro_exact.domain import DomainError
from miro_exact.plugins import PluginError
from miro_exact.raised import raised
from miro_robot.parts.keys import IN, LOW, MOST_PINS, OPEN_DRAIN, RELEASED, STRONG, TWO_WAY
from miro_robot.parts.netlist import MOST_PARTS, PORT_PINS, Netlist, port_pin
from miro_robot.parts.part import Part

MOST_WAVES = 1000
"""On one tick; more are a ring without delay."""
_NEVER = NEVER_TICK
_SHORT = 10_000  # more than there are drivers
_WAVES = MOST_WAVES
# Sizes of the arrays, which the compiler wants as numbers: 288 nets are MOST_NETS and one for each port pin, 64 parts
# have 32 pins each.
_CHANGED, _DUE, _ADVANCE, _OTHER = range(4)  # why a part is called


class Observer:
    """Gets the edges of some nets of a board from `Nets.observe` to `Nets.ignore`; it changes no bit.

        observer = Observer([nets.number("P1.3"), nets.number("eyes.echo"), nets.number("SDA")])
        nets.observe(observer)
        board.run(tick)
        edges = observer.take(tick)          # [(tick, net, level), ..] below that tick, in the order of time
        nets.ignore(observer)

    A net is a number, as `Nets.number` gives it for the name of a net, a port pin, or a part's pin; what a pin behind
    an inverter sees is the other level. `Nets.levels` has the levels now. After `board.run(tick)` all edges below
    `tick` are there, and perhaps later ones, of the instruction that went past it. There is one edge of a net on a
    tick at most: levels that were there for no time are left out.

    A net that only a port pin is on has the level of the port's latch: what a terminal's file puts on such a pin
    goes past the nets (`Device.pin_moves`).
    """

    NOT_STATE = ("*",)

    def __init__(self, nets: Iterable[int]) -> None:
        self.nets = frozenset(nets)
        self.edges: list[tuple[int, int, int]] = []
        self.wanted = [0] * 288
        for net in self.nets:
            self.wanted[net] = 1
        self.last_tick = -1

    def note(self, tick: int, net: int, level: int) -> None:
        if tick > self.last_tick:
            self.last_tick = tick
            self.edges.append((tick, net, level))
            return
        place = len(self.edges)
        while place and self.edges[place - 1][0] == tick:
            place -= 1
            if self.edges[place][1] == net:  # back to what it was before this tick
                del self.edges[place]
                return
        self.edges.append((tick, net, level))

    def take(self, tick: int) -> list[tuple[int, int, int]]:
        """The edges below `tick` that were not taken yet."""
        count = len(self.edges)
        while count and self.edges[count - 1][0] >= tick:
            count -= 1
        taken = self.edges[:count]
        del self.edges[:count]
        return taken


class Nets:
    """Nets of a board, by the numbers of its `netlist`, with its `parts` in the order of their names.

    After the nets of the list comes one for each port pin that is on none of them; it is kept while it is observed.
    `next_tick`, `reach_tick`: of the next event of a part; of the next that may change a port pin, or let two outputs
    meet. `external`: by port, what the outside puts on its pins; `ports_changed`: bit per port, since it was cleared.
    `levels`: by net. `faults`: of the firmware, as parts have found them, until they are taken.
    """

    NOT_STATE = ("*",)

    def __init__(self, netlist: Netlist, parts: Sequence[Part]) -> None:
        self.netlist = netlist
        self.parts = list(parts)
        self.names = netlist.names
        self.count = len(netlist.names)
        self.all_names = list(netlist.names)
        self.part_count = len(self.parts)
        self.powered = 1
        self.lows = [0] * 288  # strong drivers
        self.highs = [0] * 288
        self.downs = [0] * 288
        self.levels = [1] * 288
        self.contended = [0] * 288
        self.observers: list[Observer] = []
        self.observed = [0] * 288
        self.touched = [0] * 288  # nets whose drivers have changed in this wave
        self.is_touched = [0] * 288
        self.touched_count = 0
        self.suspects = [0] * 288  # nets on which contention may have begun or ended
        self.is_suspect = [0] * 288
        self.suspect_count = 0
        self.ports = list(netlist.ports)
        self.shorts = [0] * 32  # by port pin: what a short adds to `lows` of its net, and takes from `highs`
        self.latches = [0xFF] * 4
        self.external = [0xFF] * 4
        self.wired = [0] * 4  # bits of a port that something is on
        self.live = [0] * 4  # .. or that are observed
        self.ports_changed = 0
        self.next_tick = _NEVER
        self.reach_tick = _NEVER
        self.next_ticks = [_NEVER] * 64
        self.reach_ticks = [_NEVER] * 64
        self.waiting = [0] * 64  # parts to be called in the next wave, in order
        self.is_waiting = [0] * 64
        self.waiting_count = 0
        self.moving = [0] * 64  # parts that have driven pins in this one
        self.is_moving = [0] * 64
        self.moving_count = 0
        self.faults: list[tuple[int, int, str, int]] = []
        self.called = -1  # the part that is being called, why, and for which of its pins
        self.called_why = 0
        self.called_pins = 0
        self._connect(netlist)
        self.restart()

    # Wiring

    def _connect(self, netlist: Netlist) -> None:
        """By net: the pins of parts on it, and the port pins."""
        self.port_of = [-1] * 288  # a port pin on the net; others follow by `next_port`
        self.next_port = [-1] * 32
        for number in range(PORT_PINS):
            if self.ports[number] < 0:
                self.ports[number] = len(self.all_names)
                self.all_names.append(port_pin(number))
            else:
                self.wired[number >> 3] |= 1 << (number & 7)
            net = self.ports[number]
            self.next_port[number] = self.port_of[net]
            self.port_of[net] = number
        for port in range(4):
            self.live[port] = self.wired[port]
        pins: list[list[tuple[int, int, int]]] = [[] for _ in self.all_names]
        self.net_of = [-1] * 2048  # by part and pin
        self.inverted = [0] * 2048
        for index, places in enumerate(netlist.parts):
            for pin, place in enumerate(places):
                self.net_of[index * MOST_PINS + pin] = place.net
                self.inverted[index * MOST_PINS + pin] = int(place.inverted)
                if place.net >= 0:
                    pins[place.net].append((index, pin, int(place.inverted)))
        self.first = [0] * 289
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
        self.latch_nets = [net for nets in netlist.latches for net in nets]
        self._connect_kin(netlist)
        reaching = self._reaching(netlist)
        self.reaches = [int(index in reaching) for index in range(MOST_PARTS)]

    def _connect_kin(self, netlist: Netlist) -> None:
        """By part: those on its nets that are continuous, or, if it is, all. The continuous ones come first."""
        self.kin_first = [0] * 65
        self.feeder_end = [0] * 64
        self.kin = [0] * 4096
        end = 0
        for index, part in enumerate(self.parts):
            mine = {place.net for place in netlist.parts[index] if place.net >= 0}
            others = [
                other
                for other, places in enumerate(netlist.parts)
                if other != index and mine.intersection(place.net for place in places)
            ]
            feeders = [other for other in others if self.parts[other].continuous]
            fed = [other for other in others if part.continuous and not self.parts[other].continuous]
            for other in feeders + fed:
                self.kin[end] = other
                end += 1
            self.feeder_end[index] = end - len(fed)
            self.kin_first[index + 1] = end

    def _reaching(self, netlist: Netlist) -> list[int]:
        """Parts whose events may reach a port pin, an input buffer, or a second output, also through other parts."""
        nets = {net for net in netlist.ports if net >= 0}
        nets.update(net for buffer in netlist.buffers for net in buffer)
        nets.update(net for net in range(self.count) if self._may_contend(net, netlist))
        self.cpu_pins = [0] * 64  # by part, those on these nets, as bits
        for index, places in enumerate(netlist.parts):
            for pin, place in enumerate(places):
                if place.net in nets:
                    self.cpu_pins[index] |= 1 << pin
        reaching: list[int] = []
        more = [-1]
        while more:
            more = [
                index
                for index, places in enumerate(netlist.parts)
                if index not in reaching and nets.intersection(place.net for place in places)
            ]
            reaching += more
            nets.update(place.net for index in more for place in netlist.parts[index] if place.net >= 0)
        return reaching

    def is_output(self, net: int) -> bool:
        """True if something else than a port can drive a net."""
        kinds = self._kinds(net)
        tied = (*self.netlist.highs, *self.netlist.lows, *self.netlist.pull_downs, *self.latch_nets)
        return net in tied or kinds.count(IN) < len(kinds)

    def _may_contend(self, net: int, netlist: Netlist) -> bool:
        """True if a strong high and a strong low may meet on a net: then the CPU has to be there when they do."""
        kinds = self._kinds(net)
        both = sum(kind in (STRONG, TWO_WAY) for kind in kinds) + self.latch_nets.count(net)
        lows = kinds.count(OPEN_DRAIN) + netlist.lows.count(net)
        return both + netlist.highs.count(net) > 0 and both + lows + netlist.highs.count(net) > 1

    def _kinds(self, net: int) -> list[int]:
        """Kinds of the pins of parts on a net."""
        return [
            self.parts[self.pin_part[place]].keys.PINS[self.pin_number[place]].kind
            for place in range(self.first[net], self.first[net + 1])
        ]

    # Beginning, and going on from a saved state

    def restart(self) -> None:
        """Levels from scratch: those of the drives of all parts, ports with their latches."""
        for net in range(len(self.all_names)):
            self.lows[net] = self.highs[net] = self.downs[net] = 0
            self.contended[net] = self.is_touched[net] = self.is_suspect[net] = 0
        self.touched_count = self.suspect_count = self.waiting_count = self.moving_count = 0
        netlist = self.netlist
        for net in netlist.lows:
            self.lows[net] += 1
        for net in netlist.highs:
            self.highs[net] += 1
        for net in netlist.pull_downs:
            self.downs[net] += 1
        for number in range(PORT_PINS):
            self.lows[self.ports[number]] += 1 - self._latched(number) + self.shorts[number]
            self.highs[self.ports[number]] -= self.shorts[number]
        for index in range(self.part_count):
            part = self.parts[index]
            part.pending = part.moved = 0
            self.is_waiting[index] = self.is_moving[index] = 0
            for pin in range(MOST_PINS):
                part.wanted[pin] = part.drives[pin]
                self._add_drive(index, pin, part.drives[pin], 1)
        self.show_all()

    def show_all(self) -> None:
        """The levels that all drivers make, to all who look at them, without calling anybody."""
        for net in range(len(self.all_names)):
            self.levels[net] = self._level(net, 0, 0)
            self.contended[net] = 1 if self.lows[net] > 0 and self.highs[net] > 0 else 0
            self.is_touched[net] = 0
            self._show(net)
            self._show_ports(net)
        for index in range(self.part_count):
            self.parts[index].pending = self.is_waiting[index] = 0
            self._look_up(index, self.parts[index])
        self.waiting_count = self.touched_count = 0
        self.ports_changed = 0

    def tie(self, number: int, level: int) -> None:
        """Fault: a port pin is shorted to ground (0), to the supply (1), or to nothing (-1): all drivers lose."""
        net, added = self.ports[number], 0 if level < 0 else _SHORT * (1 - 2 * level)
        self.lows[net] += added - self.shorts[number]
        self.highs[net] -= added - self.shorts[number]
        self.shorts[number] = added
        self._touch(net)

    def note_shorts(self, port: int, low: int, high: int) -> None:
        """Before `restart`: the shorted pins of a port."""
        for bit in range(8):
            self.shorts[8 * port + bit] = _SHORT * ((low >> bit & 1) - (high >> bit & 1))

    def _latched(self, number: int) -> int:
        return self.latches[number >> 3] >> (number & 7) & 1

    # Observers

    def number(self, name: str) -> int:
        """The net of this name, of a port pin (`P1.0`), or of a part's pin (`eyes.echo`). Raises ValueError."""
        if name in self.all_names:
            return self.all_names.index(name)
        for number in range(PORT_PINS):
            if name == port_pin(number):
                return self.ports[number]
        for index, part in enumerate(self.parts):
            for pin, on_part in enumerate(part.keys.PINS):
                net = self.net_of[index * MOST_PINS + pin]
                if name == f"{part.name}.{on_part.name}" and net >= 0:
                    return net
        raise ValueError(f"{name} is not a net")

    def observe(self, observer: Observer) -> None:
        """From now on the observer gets the edges of its nets."""
        self.observers.append(observer)
        self._note_observed()

    def ignore(self, observer: Observer) -> None:
        """Ends `observe`."""
        self.observers.remove(observer)
        self._note_observed()

    def _note_observed(self) -> None:
        for net in range(len(self.all_names)):
            self.observed[net] = int(any(net in observer.nets for observer in self.observers))
        for number in range(PORT_PINS):
            net, port, mask = self.ports[number], number >> 3, 1 << (number & 7)
            if net >= self.count:  # nobody else is on it, so it was not kept
                self.live[port] = self.live[port] & ~mask | (mask if self.observed[net] else 0)
                self.lows[net] = 1 - self._latched(number) + self.shorts[number]
                self.levels[net] = self._level(net, 0, 0)

    def _report(self, tick: int, net: int, level: int) -> None:
        for observer in self.observers:
            if observer.wanted[net]:
                observer.note(tick, net, level)

    # Time

    def due(self, tick: int) -> None:
        """The events of all parts at `tick`, which is `next_tick`, and what follows from them."""
        try:
            for index in range(self.part_count):
                if self.next_ticks[index] <= tick:
                    # All feeders before all events: a part must not see where its motor was earlier.
                    for place in range(self.kin_first[index], self.feeder_end[index]):
                        self._call(self.kin[place], _ADVANCE, tick)
            for index in range(self.part_count):
                if self.next_ticks[index] <= tick:
                    self._call(index, _DUE, tick)
            # After all of them: what they drive on one tick takes effect together, whatever their order.
            self._spread_waves(tick)
        except (Exception, SystemExit) as error:
            # No part was being called: the error is ours, and needs its traceback.
            if self.called < 0:
                raise
            raise self._explained(error, tick) from error

    def _earliest(self) -> None:
        """`next_tick` and `reach_tick` again, after one that was the earliest has become later."""
        tick = reach_tick = _NEVER
        for index in range(self.part_count):
            tick = min(tick, self.next_ticks[index])
            reach_tick = min(reach_tick, self.reach_ticks[index])
        self.next_tick = tick
        self.reach_tick = reach_tick

    # Drivers

    def write_port(self, port: int, latch: int, tick: int) -> None:
        """The latch of a port has changed: all its bits at once, then waves."""
        self.put_latch(port, latch)
        self.settle(tick)

    def put_latch(self, port: int, latch: int) -> None:
        """A port drives other levels; no waves yet."""
        # Only bits that something is on, or that are observed: a bus on P0 writes thousands of others.
        changed = (self.latches[port] ^ latch) & self.live[port]
        self.latches[port] = latch
        number = 8 * port
        while changed:
            if changed & 1:
                net = self.ports[number]
                self.lows[net] += 1 - 2 * (latch >> (number & 7) & 1)
                self._touch(net)
            changed >>= 1
            number += 1

    def write_latch(self, index: int, before: int, after: int) -> None:
        """An output latch of MOVX stores a byte; no waves yet. `before` is -1 where it begins to drive."""
        for bit in range(8):
            net = self.latch_nets[8 * index + bit]
            if net >= 0 and (before < 0 or (before ^ after) >> bit & 1):
                if before >= 0:
                    self._add_level(net, before >> bit & 1, -1)
                self._add_level(net, after >> bit & 1, 1)
                self._touch(net)

    def buffered(self, index: int) -> int:
        """The levels at an input buffer of MOVX; 1 where nothing is connected."""
        levels = 0xFF
        for bit, net in enumerate(self.netlist.buffers[index]):
            if net >= 0 and not self.levels[net]:
                levels &= ~(1 << bit)
        return levels

    def _add_drive(self, index: int, pin: int, drive: int, count: int) -> None:
        """A driver comes (1) or goes (-1)."""
        net = self.net_of[index * MOST_PINS + pin]
        if net >= 0 and drive != RELEASED:
            self._add_level(net, drive ^ self.inverted[index * MOST_PINS + pin], count)

    def _add_level(self, net: int, level: int, count: int) -> None:
        if level:
            self.highs[net] += count
        else:
            self.lows[net] += count

    # Waves

    def settle(self, tick: int) -> None:
        """Waves until nothing changes any more. Raises PluginError for a ring without delay."""
        try:
            self._spread_waves(tick)
        except (Exception, SystemExit) as error:
            if self.called < 0:
                raise
            raise self._explained(error, tick) from error

    def collect(self, index: int, tick: int) -> None:
        """A part was called from outside of a wave: what it drives takes effect with the next one."""
        self.called = index
        self.called_why = _OTHER
        self.called_pins = 0
        try:
            self._after(index, self.parts[index], tick)
        except PluginError as error:
            raise self._explained(error, tick) from error
        self.called = -1

    def _spread_waves(self, tick: int) -> None:
        waves = 0
        while self.moving_count or self.touched_count:
            if waves == _WAVES:
                raise self._ring(tick)
            waves += 1
            if self.moving_count:
                self._take_effect()
            self._spread(tick)
            count = self.waiting_count
            self.waiting_count = 0
            for place in range(count):
                # Before the call, which may make it wait again, for the next wave.
                self.is_waiting[self.waiting[place]] = 0
                self._call(self.waiting[place], _CHANGED, tick)

    def _call(self, index: int, why: int, tick: int) -> None:
        """Calls `changed`, `due` or `advance` of a part."""
        part = self.parts[index]
        self.called = index
        self.called_why = why
        self.called_pins = part.pending
        part.pending = 0
        if why == _CHANGED:
            part.changed(self.called_pins, tick)
        elif why == _DUE:
            part.due(tick)
        else:
            part.advance(tick)
        self._after(index, part, tick)
        self.called = -1

    def _after(self, index: int, part: Part, tick: int) -> None:
        """Applies the changes of the part that was called, and its changes of other parts."""
        if part.next_tick <= tick:
            self._check_next(part, tick)
        if part.moved & self.cpu_pins[index] and self.called_why != _CHANGED:
            self._check_reach(part, tick)
        self._look_up(index, part)
        for place in range(self.kin_first[index], self.kin_first[index + 1]):
            self._look_up(self.kin[place], self.parts[self.kin[place]])

    def _check_next(self, part: Part, tick: int) -> None:
        """An event on this tick that has not been handled yet may stay; else it has to be later."""
        waits = part.next_tick == tick and self.called_why != _DUE
        if not (waits and (self.called_why == _ADVANCE or self.next_ticks[self.called] == tick)):
            reason = f"wants its next event at tick {part.next_tick}, which is past"
            raise PluginError(reason, "set next_tick beyond the tick of the call")

    def _check_reach(self, part: Part, tick: int) -> None:
        """Checks that a part's own event does not reach the CPU before the tick that it announced.

        Events through other parts are covered by those parts' announcements.
        """
        reach_tick = self.reach_ticks[self.called]
        if tick < reach_tick < _NEVER and self.called_why in (_DUE, _ADVANCE):
            self.called_pins = part.moved
            reason = f"drives its pin before its reach_tick {reach_tick}"
            raise PluginError(reason, "set reach_tick to the first tick at which a pin may change, or to 0")

    def _look_up(self, index: int, part: Part) -> None:
        """`next_tick`, `reach_tick` and driven pins of a part."""
        if part.moved and not self.is_moving[index]:
            self.is_moving[index] = 1
            self.moving[self.moving_count] = index
            self.moving_count += 1
        if part.faults:
            self.faults += part.faults
            part.faults = []
        tick = part.next_tick
        # `_NEVER`: what no pin of the CPU hears must not hold the CPU up.
        reach_tick = max(tick, part.reach_tick) if self.reaches[index] else _NEVER
        before = self.next_ticks[index]
        reach_before = self.reach_ticks[index]
        if tick != before or reach_tick != reach_before:
            self.next_ticks[index] = tick
            self.reach_ticks[index] = reach_tick
            # It was the earliest and may be no more: only then are all 64 looked at.
            if before == self.next_tick or reach_before == self.reach_tick:
                self._earliest()
            else:
                self.next_tick = min(self.next_tick, tick)
                self.reach_tick = min(self.reach_tick, reach_tick)

    def _take_effect(self) -> None:
        """Applies all drives of the last wave at once."""
        for place in range(self.moving_count):
            index = self.moving[place]
            self.is_moving[index] = 0
            part = self.parts[index]
            moved = part.moved
            part.moved = 0
            pin = 0
            while moved:
                # A part may have driven a pin there and back in one call: that is no change.
                if moved & 1 and part.wanted[pin] != part.drives[pin]:
                    self._add_drive(index, pin, part.drives[pin], -1)
                    part.drives[pin] = part.wanted[pin]
                    self._add_drive(index, pin, part.drives[pin], 1)
                    if self.net_of[index * MOST_PINS + pin] >= 0:
                        self._touch(self.net_of[index * MOST_PINS + pin])
                moved >>= 1
                pin += 1
        self.moving_count = 0

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
            # `_show` below is called even if not: a second driver changes what a part sees beside its own.
            changed = level != self.levels[net]
            self.levels[net] = level
            self._show(net)
            if changed:
                self._mark(net)
                if self.observed[net]:
                    self._report(tick, net, level)
            both = 1 if self.lows[net] > 0 and self.highs[net] > 0 else 0
            # Noted only: within the tick two drivers may meet for no time, which is no fault (`judge`).
            if both != self.contended[net] and not self.is_suspect[net]:
                self.is_suspect[net] = 1
                self.suspects[self.suspect_count] = net
                self.suspect_count += 1
            if self.port_of[net] >= 0:
                self._show_ports(net)
        self.touched_count = 0

    def _level(self, net: int, low: int, high: int) -> int:
        """The level of a net, leaving out `low` of the drivers to 0 and `high` of those to 1."""
        if self.lows[net] > low:
            return 0
        if self.highs[net] > high:
            return 1
        return 0 if self.downs[net] else 1

    def _show(self, net: int) -> None:
        """Puts the level on the pins of the parts."""
        level = self.levels[net]
        for place in range(self.first[net], self.first[net + 1]):
            part = self.parts[self.pin_part[place]]
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
                self._mark_pin(place)
            part.driven = part.driven & ~bit | strong << pin

    def _mark(self, net: int) -> None:
        """The parts on a net are to be called."""
        for place in range(self.first[net], self.first[net + 1]):
            self._mark_pin(place)

    def _mark_pin(self, place: int) -> None:
        """Schedules a call of a part for one of its pins; without supply only of a continuous part."""
        index = self.pin_part[place]
        part = self.parts[index]
        if self.powered or part.continuous:
            part.pending |= 1 << self.pin_number[place]
            if not self.is_waiting[index]:
                self._wait(index)

    def _wait(self, index: int) -> None:
        """Inserts by index: the order of calls must not depend on that of nets, as parts may read each other."""
        self.is_waiting[index] = 1
        end = self.waiting_count
        while end and self.waiting[end - 1] > index:
            self.waiting[end] = self.waiting[end - 1]
            end -= 1
        self.waiting[end] = index
        self.waiting_count += 1

    def judge(self) -> list[int]:
        """The nets on which contention that is a fault has begun, once the tick is settled."""
        begun = []
        for place in range(self.suspect_count):
            net = self.suspects[place]
            self.is_suspect[net] = 0
            both = 1 if self.lows[net] > 0 and self.highs[net] > 0 else 0
            if both and not self.contended[net] and net not in self.netlist.allow_contention:
                begun.append(net)
            self.contended[net] = both
        self.suspect_count = 0
        # They were noted in the order of events; faults of one tick are in the order of nets.
        return sorted(begun)

    # Ports

    def _show_ports(self, net: int) -> None:
        """Updates the outside level of the port pins on a net: its level without the pin's own drive, or a short."""
        number = self.port_of[net]
        while number >= 0:
            port = number >> 3
            mask = 1 << (number & 7)
            own_low = 0 if self.latches[port] & mask else 1
            levels = self.external[port] & ~mask
            tied = self.shorts[number]
            if self._level(net, own_low + tied, -tied):
                levels |= mask
            if levels != self.external[port]:
                self.external[port] = levels
                self.ports_changed |= 1 << port
            number = self.next_port[number]

    # What is wrong

    def drivers(self, net: int) -> list[str]:
        """Names of the strong drivers of a net."""
        there = [
            port_pin(number)
            for number in range(PORT_PINS)
            if self.ports[number] == net and not self._latched(number)
        ]
        for place in range(self.first[net], self.first[net + 1]):
            part = self.parts[self.pin_part[place]]
            pin = self.pin_number[place]
            if part.drives[pin] != RELEASED:
                there.append(f"{part.name}.{part.keys.PINS[pin].name}")
        there += [f"latch bit {self.all_names[net]}"] * self.latch_nets.count(net)
        there += ["ground"] * (net in self.netlist.lows) + ["VCC"] * (net in self.netlist.highs)
        return there

    def _explained(self, error: BaseException, tick: int) -> PluginError:
        """The error of the part being called, with its name, its pins and the tick."""
        index = self.called
        self.called = -1
        place = self._place(index, self.called_pins if self.called_why != _OTHER else 0, tick)
        if isinstance(error, PluginError):
            return PluginError(f"{place}: {error.what}", error.remedy)
        if isinstance(error, DomainError):
            return PluginError(f"{place}: {error}", "repair the part")
        return PluginError(f"{place}: {raised(error)}", "repair the part")

    def _place(self, index: int, pins: int, tick: int) -> str:
        part = self.parts[index]
        names = [pin.name for number, pin in enumerate(part.keys.PINS) if pins >> number & 1]
        there = f", pin {', '.join(names)}" if names else ""
        return f"part {part.name!r} ({part.keys.name}){there}, tick {tick}"

    def _ring(self, tick: int) -> PluginError:
        moving = sorted(self.moving[place] for place in range(self.moving_count))
        where = "; ".join(self._place(index, self.parts[index].moved, tick) for index in moving)
        return PluginError(
            f"{where}: a ring without delay: no end after {_WAVES} waves", "give one of them a delay"
        )

    def __repr__(self) -> str:
        return f"Nets({self.count} nets, {self.part_count} parts)"
