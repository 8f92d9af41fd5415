"""What is done to robots, radios and pins at a tick; a script has transmissions and these."""

from __future__ import annotations

from typing import Literal

import msgspec

from miro_protocol.transmission import Transmission


class Reset(msgspec.Struct, frozen=True):
    """`TICK *@N/SLOT reset 0|1`: the level of a robot's reset, 1 holds its processor in reset."""

    tick: int
    network: int
    slot: int
    level: int


class Power(msgspec.Struct, frozen=True):
    """`TICK *@N/SLOT power 0|1`: a robot's supply is switched off or on."""

    tick: int
    network: int
    slot: int
    on: int


class RadioState(msgspec.Struct, frozen=True):
    """`TICK *@N radio up|down|noise`: from then on the radio of a network works, is off, or gives noise."""

    tick: int
    network: int
    state: Literal["up", "down", "noise"]


class PinLevel(msgspec.Struct, frozen=True):
    """`TICK * P1.0 0|1`: the level that is put on a port pin of a board alone."""

    tick: int
    pin: str
    level: int


Action = Reset | Power | RadioState
"""What somebody does to a robot or a radio in a world."""
ScriptItem = Transmission | Action
"""What goes into a world from outside."""

WHO_CAN = {
    Reset: "`mirotwin replay` resets robots",
    Power: "`mirotwin replay` switches robots off and on",
    RadioState: "`mirotwin replay` switches radios off and on",
    PinLevel: "`mirotwin fw run --pins FILE` puts levels on the pins of a bare processor",
}
"""For a reader that cannot do an action: who can."""
