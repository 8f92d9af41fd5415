"""Actions on robots, radios, pins and parts at a tick; a script consists of transmissions and these."""

from __future__ import annotations

import json
import math
import re
from typing import Literal

import msgspec

from miro_protocol.toml_text import TomlError, tables
from miro_protocol.transmission import Transmission

PutValue = float | int | str | bool
PUT_PATH = re.compile(r"[A-Za-z0-9_-]{1,64}(?:\.[A-Za-z0-9_-]{1,64}){1,7}", re.ASCII)
"""`PART.KEY`; a key may have dots itself."""
PUT_BYTES = 4096
"""Longest text of a put."""
_HOW_TO_PUT = 'write PART.KEY = VALUE, such as eyes.distance_cm = 60 or eyes.echo = "none"'


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


class Reseed(msgspec.Struct, frozen=True):
    """`TICK *@N reseed SEED`: from then on a line has the noise of this seed; what is drawn once a seed is kept."""

    tick: int
    network: int
    seed: int


class PinLevel(msgspec.Struct, frozen=True):
    """`TICK * P1.0 0|1`: the level that is put on a port pin of a board alone; the same as `TICK * P1.0 = 0`."""

    tick: int
    pin: str
    level: int


class Put(msgspec.Struct, frozen=True):
    """`TICK * eyes.distance_cm = 60`: a test puts a value of a part of a board; `path` is PART.KEY."""

    tick: int
    network: int
    slot: int
    path: str
    value: PutValue

    @property
    def text(self) -> str:
        """`PATH = VALUE`, as TOML in one line without #. Raises ValueError for what cannot be read back."""
        return f"{self.path} = {_written(self.value)}"


class Fault(msgspec.Struct, frozen=True):
    """`TICK *@N/SLOT encoder left lost`: hardware breaks, or is mended; `what` is a text of `fault_text`."""

    tick: int
    network: int
    slot: int
    what: str


FAULTS = {
    "flip": "ADDR.BIT",
    "encoder": "left|right lost|a0|a1|b0|b1|ok",
    "lm629": "left|right busy|dead|ok",
    "motor": "left|right open|ok",
    "wheel": "left|right blocked|ok",
    "pin": "PIN 0|1|ok",
    "power": "dip",
    "rxd": "inverted|0|1|ok",
}
"""Word -> the words that follow it, places apart by blanks. ADDR.BIT is of internal RAM: 2Ah.3; PIN of a port: P1.3."""
OF_BOARDS = ("flip", "pin", "power", "rxd")
"""Words of the faults that boards of files have, too."""
_PLACES = {
    "ADDR.BIT": re.compile(r"[0-9a-fA-F]{2}h\.[0-7]"),
    "PIN": re.compile(r"P(?:[0-2]\.[0-7]|3\.[2-7])"),  # P3.0 and P3.1 are the serial port's
}


def fault_text(text: str) -> str:
    """The fault in its one spelling. Raises ValueError: reason; remedy."""
    word, *values = text.split() or [""]
    places = FAULTS.get(word, "").split()
    if len(values) == len(places) > 0 and all(map(_fits, places, values)):
        return (
            f"{word} {values[0][:2].upper()}{values[0][2:]}" if word == "flip" else " ".join([word, *values])
        )
    ways = ", ".join(f"{word} {places}" for word, places in FAULTS.items())
    raise ValueError(
        f"{text[:40]!r} is no hardware fault; write one of: {ways}, with ADDR.BIT as 2Ah.3, PIN as P1.3"
    )


def _fits(place: str, value: str) -> bool:
    return bool(_PLACES[place].fullmatch(value)) if place in _PLACES else value in place.split("|")


def put_of(tick: int, network: int, slot: int, text: str) -> Put:
    """The put that this text says. Raises ValueError: reason; remedy."""
    path, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not PUT_PATH.fullmatch(path):
        raise ValueError(f"{text[:40]!r} is not PART.KEY = VALUE; {_HOW_TO_PUT}")
    try:
        parsed = tables(f"value = {value}")
    except TomlError:
        parsed = {}
    if list(parsed) != ["value"] or not isinstance(parsed["value"], PutValue):
        raise ValueError(f"{value[:40]!r} is no number, text or boolean; {_HOW_TO_PUT}")
    put = Put(tick, network, slot, path, parsed["value"])
    put.text  # noqa: B018 - raises for a number that cannot be used
    return put


def _written(value: PutValue) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        text = json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        text = text.replace("#", "\\u0023")  # which begins a comment in a stream file
        if any("\ud800" <= char <= "\udfff" for char in value):
            raise ValueError("a text with half a character cannot be put; give text in UTF-8")
        if len(text.encode()) > PUT_BYTES // 2:
            raise ValueError(
                f"a text of {len(value)} characters cannot be put; give {PUT_BYTES // 16} at most"
            )
        return text
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{value} cannot be put; give a finite number")
    if isinstance(value, int) and value.bit_length() > 63:
        raise ValueError(f"an integer of {value.bit_length()} bits cannot be put; give one of 63 at most")
    return repr(value)


Action = Reset | Power | RadioState | Put | Reseed | Fault
"""An action on a robot, a radio, a part or the noise in a world."""
ScriptItem = Transmission | Action
"""The external input of a world."""


def put_on_pin(item: ScriptItem | PinLevel) -> ScriptItem:
    """A level on a pin as the put that it is, on a board with parts."""
    return Put(item.tick, 0, 0, item.pin, item.level) if isinstance(item, PinLevel) else item


WHO_CAN = {
    Reset: "`mirotwin replay` resets robots",
    Power: "`mirotwin replay` switches robots off and on",
    RadioState: "`mirotwin replay` switches radios off and on",
    Reseed: "`mirotwin replay` gives lines the noise of another seed",
    Put: "`mirotwin replay` puts values of the parts of a board",
    Fault: "`mirotwin replay` breaks the hardware of robots",
    PinLevel: "`mirotwin fw run --pins FILE` puts levels on the pins of a bare processor",
}
"""For a reader that cannot do an action: who can."""
