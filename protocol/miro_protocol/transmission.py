"""Characters without a pause between them: the one record for them, from the host's station to a capture file."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import msgspec

from miro_protocol.table import (
    BITS_PER_CHARACTER,
    HOST_BIT_TICKS,
    ROBOT_BIT_TICKS,
    SPACING_TICKS,
    SPACING_TOLERANCE_TICKS,
)

if TYPE_CHECKING:
    from miro_protocol.decoder import Symbol

DOWN = ">"
UP = "<"
DIRECTIONS = (DOWN, UP)
_FOLLOWS_FROM = SPACING_TICKS - SPACING_TOLERANCE_TICKS
_FOLLOWS_TO = SPACING_TICKS + SPACING_TOLERANCE_TICKS


class Transmission(msgspec.Struct, frozen=True, gc=False):
    """`data` on the wire of `network`, the first start bit at `tick` (24 MHz), without a pause.

    `direction` is `>` (host to robot) or `<` (robot to host). `bad_stop`: indices into `data`, ascending, of the
    characters whose stop bit is space.
    """

    tick: int
    direction: str
    data: bytes
    network: int = 0
    bad_stop: tuple[int, ...] = ()

    @property
    def end_tick(self) -> int:
        """Tick at which the last stop bit is over."""
        return self.tick + len(self.data) * character_ticks(self.direction)

    def symbols(self) -> list[Symbol]:
        """The characters one by one, as decoders take them: byte, stop bit good, tick of the start bit."""
        step, bad = character_ticks(self.direction), set(self.bad_stop)
        return [(byte, index not in bad, self.tick + index * step) for index, byte in enumerate(self.data)]


def character_ticks(direction: str) -> int:
    """Length of a character as the sender in that direction sends it."""
    return BITS_PER_CHARACTER * (ROBOT_BIT_TICKS if direction == UP else HOST_BIT_TICKS)


def check_bad_stop(bad_stop: tuple[int, ...], count: int) -> None:
    """Raises ValueError unless these are indices of `count` characters, ascending."""
    before = -1
    for index in bad_stop:
        if not before < index < count:
            problem = f"bad_stop holds {index} behind {before}" if before >= 0 else f"bad_stop holds {index}"
            raise ValueError(f"{problem}: must be ascending indices of {count} characters")
        before = index


def follows(last_tick: int, tick: int) -> bool:
    """True if characters that begin at these ticks follow each other without a pause, as receivers judge it."""
    return _FOLLOWS_FROM <= tick - last_tick <= _FOLLOWS_TO


def of_symbols(
    symbols: Iterable[Symbol], direction: str, network: int = 0, spacing_ticks: int = SPACING_TICKS
) -> list[Transmission]:
    """Received characters as transmissions; a pause begins a new one.

    `spacing_ticks`: from one start bit to the next without a pause.
    """
    tolerance_ticks = SPACING_TOLERANCE_TICKS * spacing_ticks // SPACING_TICKS
    transmissions: list[Transmission] = []
    data = bytearray()
    bad_stop: list[int] = []
    start_tick = last_tick = 0
    for byte, stop_good, tick in symbols:
        if data and abs(tick - last_tick - spacing_ticks) > tolerance_ticks:
            transmissions.append(Transmission(start_tick, direction, bytes(data), network, tuple(bad_stop)))
            data, bad_stop = bytearray(), []
        if not data:
            start_tick = tick
        if not stop_good:
            bad_stop.append(len(data))
        data.append(byte)
        last_tick = tick
    if data:
        transmissions.append(Transmission(start_tick, direction, bytes(data), network, tuple(bad_stop)))
    return transmissions


def joined(first: Transmission, other: Transmission) -> Transmission | None:
    """Both as one transmission; None unless `other` begins where `first` ends."""
    step = character_ticks(first.direction)
    if (first.network, first.direction) != (other.network, other.direction):
        return None
    if not follows(first.end_tick - step, other.tick):
        return None
    shifted = tuple(len(first.data) + index for index in other.bad_stop)
    return msgspec.structs.replace(first, data=first.data + other.data, bad_stop=first.bad_stop + shifted)
