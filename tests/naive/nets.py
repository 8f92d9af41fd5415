"""Nets of a board, slow and obvious: every tick is stepped, all levels are worked out again, nothing is cached.

Written from the order on one tick in `nets.py`'s head and the table of drivers there, for parts of `scripted.py`.
"""

from miro_robot.parts.keys import PartKeys

MOST_WAVES = 1000


class Ring(Exception):
    """Nothing comes to rest on a tick."""


class NaivePart:
    def __init__(self, keys: PartKeys):
        self.keys = keys
        self.events = list(keys.events)
        self.drives = dict.fromkeys(range(6), 2)
        self.wanted = dict(self.drives)
        self.heard = []


class NaiveNets:
    """`pins`: (part, pin) -> (net, inverted); `ports`: (port, bit) -> net."""

    def __init__(self, nets, ports, pins, parts, pull_downs=()):
        self.nets, self.ports, self.pins, self.pull_downs = nets, ports, pins, pull_downs
        self.parts = [NaivePart(keys) for keys in parts]
        self.latches = {(port, bit): 1 for port in range(4) for bit in range(8)}
        self.levels = {net: self.level(net) for net in nets}
        self.contended = set()
        self.faults, self.edges, self.outside = [], [], []
        self.shown = [255] * 4

    def drivers(self, net, without=None):
        """Who drives the net strongly, with the level; `without`: one of them."""
        there = [(pin, 0) for pin, on in self.ports.items() if on == net and not self.latches[pin]]
        for (index, pin), (on, inverted) in self.pins.items():
            drive = self.parts[index].drives[pin]
            if on == net and drive != 2:
                there.append(((f"part{index}", pin), drive ^ inverted))
        return [(who, level) for who, level in there if who != without]

    def level(self, net, without=None):
        levels = [level for _, level in self.drivers(net, without)]
        if levels:
            return min(levels)
        return 0 if net in self.pull_downs else 1

    def hear(self, index, tick, what, pins):
        seen = [[], [], []]
        for pin in range(6):
            net, inverted = self.pins.get((index, pin), (None, 0))
            own = (f"part{index}", pin)
            seen[0].append(1 if net is None else self.level(net) ^ inverted)
            seen[1].append(1 if net is None else self.level(net, own) ^ inverted)
            seen[2].append(0 if net is None else int(bool(self.drivers(net, own))))
        self.parts[index].heard.append((tick, what, sum(1 << pin for pin in pins), *seen))
        return seen[1]

    def waves(self, tick):
        for _ in range(MOST_WAVES):
            for part in self.parts:
                part.drives = dict(part.wanted)
            levels = {net: self.level(net) for net in self.nets}
            changed = {net for net in self.nets if levels[net] != self.levels[net]}
            self.levels = levels
            for index, part in enumerate(self.parts):
                pins = sorted(
                    pin for (owner, pin), (net, _) in self.pins.items() if owner == index and net in changed
                )
                if pins:
                    others = self.hear(index, tick, "changed", pins)
                    self.answer(part, pins, others, tick)
            if all(part.drives == part.wanted for part in self.parts):
                return
        raise Ring

    def answer(self, part, pins, others, tick):
        for pin, output, level, inverted, delay in part.keys.answers:
            if pin in pins:
                level = others[pin] ^ inverted if level is None else level
                level = 2 if output == 4 and level else level
                if delay:
                    part.events.append((tick + delay, output, level))
                else:
                    part.wanted[output] = level

    def step(self, tick, writes):
        """A tick: what is due, then what the CPU writes: ((port, latch), ..)."""
        before = dict(self.levels)
        due = [
            (index, part)
            for index, part in enumerate(self.parts)
            if any(event[0] == tick for event in part.events)
        ]
        for index, part in due:
            self.hear(index, tick, "due", [])
            for _, pin, level in [event for event in part.events if event[0] == tick]:
                part.wanted[pin] = level
            part.events = [event for event in part.events if event[0] != tick]
        self.waves(tick)
        for port, latch in writes:
            self.latches.update({(port, bit): latch >> bit & 1 for bit in range(8)})
            self.waves(tick)
        self.edges += [(tick, net, self.levels[net]) for net in self.nets if self.levels[net] != before[net]]
        now = {net for net in self.nets if {level for _, level in self.drivers(net)} == {0, 1}}
        self.faults += [(tick, net) for net in sorted(now - self.contended)]
        self.contended = now
        shown = [
            sum(
                (self.level(self.ports[port, bit], (port, bit)) if (port, bit) in self.ports else 1) << bit
                for bit in range(8)
            )
            for port in range(4)
        ]
        self.outside += [(tick, port, shown[port]) for port in range(4) if shown[port] != self.shown[port]]
        self.shown = shown
