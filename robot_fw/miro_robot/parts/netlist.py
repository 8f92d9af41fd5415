"""Which pins share a net, as the board builds it."""

from __future__ import annotations

import msgspec

PORT_PINS = 32
SERIAL_PINS = (24, 25)
"""P3.0 and P3.1."""
MOST_NETS = 256
MOST_PARTS = 64


def port_pin(number: int) -> str:
    """Port pin `8 * port + bit`, as `P1.0`."""
    return f"P{number >> 3}.{number & 7}"


class PartPin(msgspec.Struct, frozen=True):
    """A pin of a part on net `net`, -1 if it is not connected; `inverted`: behind an inverter."""

    net: int = -1
    inverted: bool = False


class Netlist(msgspec.Struct, frozen=True, kw_only=True):
    """The nets of a board. `names`: by number, for people.

    `ports`: by port pin (8 * port + bit), its net, -1 if nothing else is there. `parts`: by part, in the order of their
    names, and pin. `pull_ups`, `pull_downs`: nets with a resistor; `highs`, `lows`: tied to VCC, to ground.
    `allow_contention`: nets on which it is no fault.
    `latches`: by output latch of MOVX and bit; `buffers`: by input buffer and bit; -1 where nothing is connected.
    """

    names: tuple[str, ...] = ()
    ports: tuple[int, ...] = (-1,) * PORT_PINS
    parts: tuple[tuple[PartPin, ...], ...] = ()
    pull_ups: tuple[int, ...] = ()
    pull_downs: tuple[int, ...] = ()
    allow_contention: tuple[int, ...] = ()
    highs: tuple[int, ...] = ()
    lows: tuple[int, ...] = ()
    latches: tuple[tuple[int, ...], ...] = ()
    buffers: tuple[tuple[int, ...], ...] = ()

    def free_pins(self) -> list[str]:
        """Port pins that nothing but a pull-up is on, without those of the serial port."""
        taken = {place.net for places in self.parts for place in places}
        taken.update((*self.pull_downs, *self.highs, *self.lows))
        taken.update(net for nets in (*self.latches, *self.buffers) for net in nets)
        taken.discard(-1)
        return [
            port_pin(number)
            for number, net in enumerate(self.ports)
            if net not in taken and number not in SERIAL_PINS
        ]
