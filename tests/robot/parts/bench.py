"""Parts on nets without a processor: a test drives nets and looks at them, at ticks that it names."""

from miro_exact.rng import Stream
from miro_exact.state import Flat
from miro_robot.parts.keys import RELEASED, STRONG, PartKeys, Pin, Place
from miro_robot.parts.netlist import Netlist, PartPin
from miro_robot.parts.nets import Nets
from miro_robot.parts.part import Part


class Hand(PartKeys, frozen=True, kw_only=True, tag="hand"):
    """Drives a net as the test says."""

    PINS = (Pin("out", STRONG),)

    def make(self, place):
        return HandPart(self, place)


class HandPart(Part):
    def put(self, name, value, tick):
        self.drive(0, value)


class Probe(PartKeys, frozen=True, kw_only=True, tag="probe"):
    """Keeps the edges of a net."""

    PINS = (Pin("in"),)

    def make(self, place):
        return ProbePart(self, place)


class ProbePart(Part):
    def __init__(self, keys, place):
        Part.__init__(self, keys, place)
        self.edges = []

    def changed(self, pins, tick):
        self.edges.append((tick, self.level(0)))


class Bench:
    """`parts`: name -> (keys, {pin: net}). Nets that `drives` names are driven by the test, all are looked at."""

    STATE = {"parts": [Part]}

    def __init__(self, parts, drives=(), crystal_hz=12_000_000, seed=0):
        nets = sorted({net for _, pins in parts.values() for net in pins.values()})
        wanted = {**parts, **{f"~{net}": (Hand(), {"out": net}) for net in drives}}
        wanted |= {f"?{net}": (Probe(), {"in": net}) for net in nets}
        self.order = sorted(wanted)
        self.number = {net: index for index, net in enumerate(nets)}
        self.parts = []
        for name in self.order:
            keys, pins = wanted[name]
            there = frozenset(index for index, pin in enumerate(keys.PINS) if pin.name in pins)
            place = Place(name, crystal_hz, Stream(seed, f"part {name}"), there, {})
            self.parts.append(keys.make(place))
        self.named = dict(zip(self.order, self.parts, strict=True))
        for name in self.order:
            keys, pins = wanted[name]
            for index, pin in enumerate(keys.PINS):
                self.named[name].place.peers[index] = [
                    (self.named[other], number)
                    for other in self.order
                    for number, its in enumerate(wanted[other][0].PINS)
                    if other != name and pins.get(pin.name, "") == wanted[other][1].get(its.name, "-")
                ]
        wires = tuple(
            tuple(
                PartPin(self.number.get(wanted[name][1].get(pin.name, ""), -1))
                for pin in wanted[name][0].PINS
            )
            for name in self.order
        )
        self.nets = Nets(Netlist(names=tuple(nets), parts=wires), self.parts)
        self.tick = 0
        self._supply(1)

    def _supply(self, on):
        self.nets.powered = on
        self.nets.show_all()
        for index, part in enumerate(self.parts):
            part.supply(on, self.tick)
            self.nets.collect(index, self.tick)
        self.nets.settle(self.tick)

    def power(self, on):
        """The supply, now."""
        self.run(self.tick)
        self._supply(on)

    def run(self, tick):
        """Does what happens before `tick`."""
        while (due := min(part.next_tick for part in self.parts)) < tick:
            self.nets.due(due)
        self.tick = tick

    def put(self, path, value, tick=None):
        """`path`: PART.KEY."""
        self.run(self.tick if tick is None else tick)
        name, key = path.split(".", 1)
        self.named[name].put(key, value, self.tick)
        self.nets.collect(self.order.index(name), self.tick)
        self.nets.settle(self.tick)

    def drive(self, net, level, tick=None):
        """Drives a net from a tick on; None lets it go."""
        self.drive_all({net: level}, tick)

    def drive_all(self, levels, tick=None):
        """The same for several nets at once, as the processor does it: after the events of that tick."""
        tick = self.tick if tick is None else tick
        self.run(tick + 1)
        self.tick = tick
        for net, level in levels.items():
            hand = self.order.index(f"~{net}")
            self.parts[hand].put("out", RELEASED if level is None else level, self.tick)
            self.nets.collect(hand, self.tick)
        self.nets.settle(self.tick)

    def read(self, path):
        name, key = path.split(".", 1)
        part = self.named[name]
        return part.read(key, min(self.tick, part.next_tick))

    def level(self, net):
        return self.nets.levels[self.number[net]]

    def driven(self, net):
        """The level that somebody drives a net to, None while it floats."""
        return self.level(net) if self.named[f"?{net}"].driven & 1 else None

    def edges_of(self, net):
        """(tick, level) of every change of a net so far."""
        return self.named[f"?{net}"].edges

    def save(self):
        return Flat(self).save()

    def load(self, data):
        """The state of another bench of the same parts."""
        Flat(self).load(data)
        self.nets.restart()
