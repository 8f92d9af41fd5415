"""Parts on nets without a processor: a test drives nets and looks at them, at ticks that it names."""

from miro_exact.clock import NEVER_TICK
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


class Bench:
    """`parts`: name -> (keys, {pin: net}). Every net that `drives` names is driven by the test, else it is released."""

    STATE = {"parts": [Part]}

    def __init__(self, parts, drives=(), crystal_hz=12_000_000, seed=0):
        wanted = {**parts, **{f"~{net}": (Hand(), {"out": net}) for net in drives}}
        self.order = sorted(wanted)
        nets = sorted({net for _, pins in wanted.values() for net in pins.values()})
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
        self.edges = self.nets.edges = []
        for net in range(len(nets)):
            self.nets.watch(net, 1)
        self.tick = 0
        self._supply(1)

    def _supply(self, on):
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
        while (due := self.nets.next_tick()) < tick and due < NEVER_TICK:
            self.nets.due(due)
        self.tick = tick

    def put(self, path, value, tick=None):
        """`path`: PART.KEY."""
        self.run(self.tick if tick is None else tick)
        name, key = path.split(".", 1)
        self.named[name].put(key, value, self.tick)
        self.nets.call(self.order.index(name), self.tick)

    def drive(self, net, level, tick=None):
        """Drives a net from a tick on; None lets it go."""
        self.put(f"~{net}.out", RELEASED if level is None else level, tick)

    def read(self, path):
        name, key = path.split(".", 1)
        part = self.named[name]
        return part.read(key, min(self.tick, part.next_tick))

    def level(self, net):
        return self.nets.levels[self.number[net]]

    def edges_of(self, net):
        """(tick, level) of every change of a net so far."""
        return [(tick, level) for tick, number, level in self.edges if number == self.number[net]]

    def save(self):
        return Flat(self).save()

    def load(self, data):
        """The state of another bench of the same parts."""
        Flat(self).load(data)
        self.nets.restart()
