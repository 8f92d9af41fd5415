"""Resolves the nets of a board file: the pins that share each net.

    "P1.0" a port pin · "SDA" a net · "bridge.out1" another part's pin · "CTRL.3" a bit of an output latch
    "0", "1" ground and VCC · "!.." the same behind an inverter

A part's pin leads to what it is wired to, which may be a part's pin again; where that ends is the net. Pins behind an
inverter hang on the same net and see it inverted. All is in the order of the names, as `BoardSpec` is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import msgspec

from miro_exact.bad_input import BadInput, amount, did_you_mean
from miro_robot.board_spec import BoardSpec, PartSpec
from miro_robot.parts.keys import IN, OPEN_DRAIN, STRONG, TWO_WAY
from miro_robot.parts.netlist import MOST_NETS, MOST_PARTS, PORT_PINS, Netlist, PartPin

MOST_LATCHES = MOST_BUFFERS = 8
GROUND, VCC = "0", "1"
_SUPPLIES = {"GND": GROUND, "GROUND": GROUND, "VSS": GROUND, "VCC": VCC, "VDD": VCC}
LONGEST_WAY = 64
"""Largest number of pins between a pin and its net."""
NAME = re.compile(r"[A-Za-z_]\w{0,63}", re.ASCII)
_PORT_PIN = re.compile(r"P[0-3]\.[0-7]")
_PORT = re.compile(r"P[0-9]")
_LIKE_A_PORT = re.compile(r"[Pp][0-9]")
_PORT_LIKE = re.compile(r"P[0-9]+\.[0-9]+|P[0-9]")
_BITS = "01234567"


class BoardError(BadInput):
    """A board that cannot be built: file, key, what, remedy."""


class _Wire(msgspec.Struct):
    """The pins on a net. `pins`: part, number of its pin, and True if it is behind an inverter."""

    ports: list[int] = []
    pins: list[tuple[str, int, bool]] = []
    latches: list[tuple[str, int]] = []
    buffers: list[tuple[str, int]] = []
    place: str = ""
    pulled_up: bool = False
    pulled_down: bool = False
    may_contend: bool = False
    strap: str = ""
    level: int = -1


def resolve(spec: BoardSpec) -> Netlist:
    """The nets of a board, numbered in the order of their names. Raises BoardError."""
    return _Resolver(spec).netlist()


class _Resolver:
    NOT_STATE = ("*",)

    def __init__(self, spec: BoardSpec) -> None:
        self.spec = spec
        self.wires: dict[str, _Wire] = {}
        self.named: dict[str, str] = {}  # port pin -> the name of its net
        self.numbers = {
            name: {pin.name: number for number, pin in enumerate(part.keys.PINS)}
            for name, part in spec.parts.items()
        }
        self.used = {
            target.removeprefix("!"): None for part in spec.parts.values() for target in part.pins.values()
        }  # words of the file
        self.check_counts()
        self.check_names()
        self.connect()
        self.check_wires()

    # Names

    def check_counts(self) -> None:
        spec = self.spec
        for key, there, most in (
            ("parts", spec.parts, MOST_PARTS),
            ("latches", spec.latches, MOST_LATCHES),
            ("buffers", spec.buffers, MOST_BUFFERS),
        ):
            if len(there) > most:
                raise BoardError("", key, f"{len(there)} {key}, at most {most} fit", "leave some out")

    def check_names(self) -> None:
        spec = self.spec
        taken: dict[str, str] = {}
        for table in ("parts", "latches", "nets"):
            for name in getattr(spec, table):
                place = f"{table}.{name}"
                self.check_name(name, place)
                if name in taken:
                    raise BoardError("", place, f"{taken[name]} has this name, too", "give one another name")
                taken[name] = place
        for table in ("straps", "buffers"):
            for name in getattr(spec, table):
                self.check_name(name, f"{table}.{name}")
        for name, pins in spec.nets.items():
            for pin in pins:
                place = f"nets.{name}"
                if not _PORT_PIN.fullmatch(pin):
                    raise BoardError("", place, f"{pin!r} is no port pin", "give a port pin, as P1.0")
                if pin in self.named:
                    raise BoardError("", place, f"{pin} is net {self.named[pin]}, too", "use one name")
                self.named[pin] = name

    def check_name(self, name: str, place: str) -> None:
        if not NAME.fullmatch(name):
            remedy = "use letters, digits and _, not a digit first, at most 64 characters"
            raise BoardError("", place, f"{name!r} is not a name", remedy)
        if _PORT.fullmatch(name):
            raise BoardError("", place, f"{name} is a port", "give it another name")

    # Wires

    def connect(self) -> None:
        spec = self.spec
        for name, pins in spec.nets.items():
            for pin in pins:
                self.wire(pin, f"nets.{name}")
        for name, part in spec.parts.items():
            self.check_pins(name, part)
            for pin, target in part.pins.items():
                place = f"parts.{name}.pins.{pin}"
                net, inverted = self.target(target, place, ((name, pin),))
                self.check_serial(name, pin, net, inverted)
                self.wire(net, place).pins.append((name, self.numbers[name][pin], inverted))
        for name, buffer in spec.buffers.items():
            if len(buffer.pins) != 8:
                problem = f"has {amount(len(buffer.pins), 'pin')}"
                raise BoardError("", f"buffers.{name}.pins", problem, "list eight, bit 0 first")
            for bit, target in enumerate(buffer.pins):
                place = f"buffers.{name}.pins[{bit}]"
                net, inverted = self.target(target, place)
                if inverted:
                    raise BoardError("", place, f"{target!r} is inverted", "a buffer has no inverters")
                self.wire(net, place).buffers.append((name, bit))
        for name, strap in spec.straps.items():
            self.strap(name, strap.pin, strap.level)
        self.pull(spec.pull_downs, "pull_downs")
        self.pull(spec.pull_ups, "pull_ups")
        self.allow_contention(spec.allow_contention)

    def check_pins(self, name: str, part: PartSpec) -> None:
        """Checks that every pin that needs it is connected, and that no unknown pin is named."""
        numbers = self.numbers[name]
        for pin in part.pins:
            if pin not in numbers:
                place, problem = f"parts.{name}.pins.{pin}", f"{part.keys.name} has no such pin"
                raise BoardError(
                    "", place, problem, did_you_mean(pin, numbers, f"it has {', '.join(numbers)}")
                )
        for needed in part.keys.PINS:
            if (
                not needed.optional
                and needed.name not in part.pins
                and f"{name}.{needed.name}" not in self.used
            ):
                place = f"parts.{name}.pins"
                raise BoardError(
                    "", place, f"pin {needed.name} is not connected", f'add {needed.name} = ".."'
                )

    def target(self, text: str, place: str, way: tuple[tuple[str, str], ...] = ()) -> tuple[str, bool]:
        """The name of the net for a word of the file, and True if it is inverted. `way`: the pins so far."""
        inverted = text.startswith("!")
        word = text.removeprefix("!")
        owner, dot, pin = word.partition(".")
        if _PORT_LIKE.fullmatch(word):
            if not _PORT_PIN.fullmatch(word):
                raise BoardError("", place, f"there is no port pin {word}", "use P0.0 to P3.7")
            return self.named.get(word, word), inverted
        if word in (GROUND, VCC):
            if inverted:
                other = VCC if word == GROUND else GROUND
                raise BoardError("", place, f"{text!r} is a constant", f'write "{other}"')
            return word, False
        if word.upper() in _SUPPLIES and word not in self.spec.nets:
            raise BoardError("", place, f"{word} is no net", f'write "{_SUPPLIES[word.upper()]}"')
        if owner in self.spec.latches and dot:
            if len(pin) != 1 or pin not in _BITS:
                raise BoardError(
                    "", place, f"latch {owner} has no bit {pin!r}", f"use {owner}.0 to {owner}.7"
                )
            return word, inverted
        if not dot and NAME.fullmatch(word):
            for table in ("parts", "latches"):
                if word in getattr(self.spec, table):
                    problem = f"{word} is a {'part' if table == 'parts' else 'latch'}, not a net"
                    raise BoardError(
                        "", place, problem, f"name one of its pins, as {word}.{self.first_pin(word)}"
                    )
            return word, inverted
        if not NAME.fullmatch(owner):
            remedy = (
                "use a port pin (P1.0), a net, a part's pin (bridge.out1), 0 or 1, perhaps with ! before it"
            )
            raise BoardError("", place, f"{text!r} names no pin and no net", remedy)
        net, again = self.pin_of_part(owner, pin, place, way)
        return net, inverted != again

    def first_pin(self, name: str) -> str:
        return next(iter(self.numbers.get(name, "0")), "0")

    def pin_of_part(
        self, owner: str, pin: str, place: str, way: tuple[tuple[str, str], ...]
    ) -> tuple[str, bool]:
        """The net of another part's pin; a pin without an entry is a net of its own."""
        if owner not in self.spec.parts:
            if _LIKE_A_PORT.fullmatch(owner):
                raise BoardError("", place, f"there is no port pin {f'{owner}.{pin}'!r}", "use P0.0 to P3.7")
            known = [*self.spec.parts, *self.spec.latches]
            remedy = did_you_mean(owner, known, f"add [parts.{owner}]")
            raise BoardError("", place, f"there is no part {owner!r}", remedy)
        if pin not in self.numbers[owner]:
            numbers = self.numbers[owner]
            remedy = did_you_mean(pin, numbers, f"it has {', '.join(numbers)}")
            raise BoardError(
                "", place, f"{owner} ({self.spec.parts[owner].keys.name}) has no pin {pin!r}", remedy
            )
        if (owner, pin) in way:
            ring = " and ".join(f"{part}.{name}" for part, name in way)
            raise BoardError("", place, f"{ring} name each other", "leave one of them out")
        if len(way) >= LONGEST_WAY:
            raise BoardError("", place, f"leads over {len(way)} pins", "give the net a name")
        text = self.spec.parts[owner].pins.get(pin)
        if text is None:
            wire = self.wire(f"{owner}.{pin}", place)
            if (owner, self.numbers[owner][pin], False) not in wire.pins:
                wire.pins.append((owner, self.numbers[owner][pin], False))
            return f"{owner}.{pin}", False
        return self.target(text, f"parts.{owner}.pins.{pin}", (*way, (owner, pin)))

    def wire(self, net: str, place: str) -> _Wire:
        """The net of this name, or of a port pin's."""
        net = self.named.get(net, net)
        if net not in self.wires:
            wire = _Wire(place=place)
            wire.ports = [
                8 * int(pin[1]) + int(pin[3])
                for pin in self.spec.nets.get(net, (net,))
                if _PORT_PIN.fullmatch(pin)
            ]
            owner, _, bit = net.partition(".")
            if owner in self.spec.latches:
                wire.latches.append((owner, int(bit)))
            self.wires[net] = wire
        return self.wires[net]

    def check_serial(self, name: str, pin: str, net: str, inverted: bool) -> None:
        """Checks that a part of the serial line is at the serial port, and the only one there."""
        port = self.spec.parts[name].keys.AT.get(pin)
        if port is None:
            return
        place = f"parts.{name}.pins.{pin}"
        if inverted or net != self.named.get(port, port):
            problem = f"{name} carries the serial line, and {pin} is not on {port}"
            raise BoardError("", place, problem, f'write {pin} = "{port}"')
        for other, part in self.spec.parts.items():
            if other < name and part.keys.AT:
                raise BoardError("", place, f"{other} carries the serial line, too", "leave one of them out")

    # Constants and resistors

    def strap(self, name: str, pin: str, level: int) -> None:
        place = f"straps.{name}.pin"
        net, inverted = self.target(pin, place)
        if inverted or net in (GROUND, VCC):
            raise BoardError("", place, f"{pin!r} cannot be strapped", "give a port pin or a net")
        wire = self.wire(net, place)
        if wire.strap:
            raise BoardError("", place, f"strap {wire.strap} is on {pin}, too", "leave one of them out")
        wire.strap, wire.level = name, level

    def pull(self, names: tuple[str, ...], key: str) -> None:
        for index, name in enumerate(names):
            for net in self.listed(name, f"{key}[{index}]"):
                if key == "pull_downs":
                    self.wire(net, f"{key}[{index}]").pulled_down = True
                elif net in self.wires:  # else it does nothing
                    self.wires[net].pulled_up = True

    def allow_contention(self, names: tuple[str, ...]) -> None:
        for index, name in enumerate(names):
            for net in self.listed(name, f"allow_contention[{index}]"):
                if net in self.wires:  # else it does nothing
                    self.wires[net].may_contend = True

    def listed(self, name: str, place: str) -> Iterator[str]:
        """A net of a list, or one for each pin of a port."""
        if re.fullmatch(r"P[0-3]", name):
            for bit in range(8):
                yield self.named.get(f"{name}.{bit}", f"{name}.{bit}")
            return
        net, inverted = self.target(name, place)
        if inverted or net in (GROUND, VCC):
            raise BoardError("", place, f"{name!r} is no net by itself", "give a net, a port pin or a port")
        if net not in self.wires and not _PORT_PIN.fullmatch(net):
            remedy = did_you_mean(name, self.wires, "nothing is wired to it")
            raise BoardError("", place, f"there is no net {name!r}", remedy)
        yield net

    # What cannot work

    def check_wires(self) -> None:
        if len(self.wires) > MOST_NETS:
            raise BoardError(
                "", "parts", f"{len(self.wires)} nets, at most {MOST_NETS} fit", "leave some out"
            )
        for name, wire in self.wires.items():
            self.check_inverters(wire)
            if name in (GROUND, VCC):
                self.check_constant(name, wire)
                continue
            if len(wire.pins) + len(wire.buffers) < 2 and not (wire.ports or wire.latches):
                remedy = did_you_mean(name, self.choices(name), "wire another pin to it, or leave it out")
                raise BoardError("", wire.place, f"net {name} has one pin only", remedy)
            self.check_high(name, wire)
            self.check_low(name, wire)

    def choices(self, name: str) -> list[str]:
        return [other for other in (*self.wires, *self.spec.parts, *self.spec.latches) if other != name]

    def place_of(self, part: str, number: int) -> str:
        return f"parts.{part}.pins.{self.spec.parts[part].keys.PINS[number].name}"

    def kind(self, part: str, number: int) -> int:
        return self.spec.parts[part].keys.pin_kind(number)

    def check_inverters(self, wire: _Wire) -> None:
        for part, number, inverted in wire.pins:
            if inverted and self.kind(part, number) in (OPEN_DRAIN, TWO_WAY):
                problem = "an inverter goes one way, this pin both"
                raise BoardError("", self.place_of(part, number), problem, "leave out the !")

    def check_constant(self, name: str, wire: _Wire) -> None:
        for part, number, _ in wire.pins:
            if self.kind(part, number) == STRONG:
                problem = f'an output cannot be tied to "{name}"'
                raise BoardError("", self.place_of(part, number), problem, "leave the pin out, or name a net")

    def check_high(self, name: str, wire: _Wire) -> None:
        """Checks that a listener on the net can read high: P0 and open-drain pins cannot drive it."""
        if wire.strap or wire.pulled_up or wire.latches or any(number >= 8 for number in wire.ports):
            return
        # What P0 says to a two-way pin must come there, so the other two-way pins are of no help beside P0.
        strong = (STRONG,) if wire.ports else (STRONG, TWO_WAY)
        for part, number, _ in wire.pins:
            keys = self.spec.parts[part].keys
            if keys.pin_kind(number) in strong or keys.PINS[number].name in keys.pulled_up:
                return
        if wire.pins or wire.buffers:
            place = self.place_of(*wire.pins[0][:2]) if wire.pins else wire.place
            kinds = [self.kind(part, number) for part, number, _ in wire.pins]
            why = ": P0 is open drain" if wire.ports else ": it is open drain" if OPEN_DRAIN in kinds else ""
            problem = f"nothing can drive {name} high{why}"
            raise BoardError("", place, problem, f'add pull_ups = ["{name}"], or "{name}" to it')

    def check_low(self, name: str, wire: _Wire) -> None:
        """Checks that a contact to VCC has an effect at the processor, which reads an undriven net as high."""
        if wire.strap or wire.pulled_down or wire.latches or not (wire.ports or wire.buffers):
            return
        outputs = [pin for pin in wire.pins if self.kind(*pin[:2]) != IN]
        idle = [pin for pin in outputs if self.spec.parts[pin[0]].keys.never_low]
        if idle and len(idle) == len(outputs):
            problem = f"the processor reads {name} as high, closed or open"
            raise BoardError(
                "", self.place_of(*idle[0][:2]), problem, f'add pull_downs = ["{name}"], or "{name}" to it'
            )

    # The list

    def netlist(self) -> Netlist:
        names = sorted(self.wires)
        number = {name: index for index, name in enumerate(names)}
        ports = [-1] * PORT_PINS
        pins: dict[tuple[str, int], PartPin] = {}
        latches = {(latch, bit): -1 for latch in self.spec.latches for bit in range(8)}
        buffers = {(buffer, bit): -1 for buffer in self.spec.buffers for bit in range(8)}
        for name, wire in self.wires.items():
            net = number[name]
            for port in wire.ports:
                ports[port] = net
            for part, pin, inverted in wire.pins:
                pins[part, pin] = PartPin(net, inverted)
            latches.update(dict.fromkeys(wire.latches, net))
            buffers.update(dict.fromkeys(wire.buffers, net))
        nets = [(number[name], self.wires[name]) for name in names]
        return Netlist(
            names=tuple(names),
            ports=tuple(ports),
            parts=tuple(
                tuple(pins.get((name, pin), PartPin()) for pin in range(len(part.keys.PINS)))
                for name, part in self.spec.parts.items()
            ),
            pull_ups=tuple(net for net, wire in nets if wire.pulled_up),
            pull_downs=tuple(net for net, wire in nets if wire.pulled_down),
            allow_contention=tuple(net for net, wire in nets if wire.may_contend),
            highs=tuple(net for net, wire in nets if wire.level == 1 or names[net] == VCC),
            lows=tuple(net for net, wire in nets if wire.level == 0 or names[net] == GROUND),
            latches=tuple(tuple(latches[name, bit] for bit in range(8)) for name in self.spec.latches),
            buffers=tuple(tuple(buffers[name, bit] for bit in range(8)) for name in self.spec.buffers),
        )
