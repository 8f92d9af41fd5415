"""The verbs that move: by line and by instruction, to breakpoints, to a time, to a place, to an event."""

from __future__ import annotations

import re
import shlex
from contextlib import suppress
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput
from miro_protocol.toml_text import TomlError, struct_of
from miro_sim.world.conditions import CONDITIONS
from mirotwin.debug.debugger import STEPPED
from mirotwin.debug.session import Session
from mirotwin.shell.times import TimeType

_HEX = re.compile("0[xX][0-9a-fA-F]+")
_REPEATED = ("step", "next", "stepi", "nexti")
_MOST_TIMES = 1_000_000


def move(name: str, session: Session, rest: str) -> None:
    """`step`, `rnexti`, ..: N times, and no further than to the first stop for another reason."""
    forward = name.removeprefix("r")
    takes = forward in (*_REPEATED, "continue")
    if rest and not (takes and rest.isdecimal() and 0 < int(rest[:9]) <= _MOST_TIMES):
        if takes:
            raise BadInput("", name, f"{rest} is no number of times", f"give 1 to {_MOST_TIMES}")
        raise BadInput("", rest, f"is more than {name} takes", "repeat it by an empty line")
    by_instruction = forward in ("stepi", "nexti")
    verb = name.removesuffix("i") if forward == "nexti" else name
    why = ""
    for _ in range(int(rest or 1)):
        why = session.debugger.move(verb, by_instruction)
        if why != STEPPED and not (forward == "continue" and why.startswith("breakpoint")):
            break
    session.say(why, by_instruction)


def go_to(session: Session, rest: str) -> None:
    try:
        tick = TimeType().read(rest).ticks(session.timeline.run.tick_hz)
    except ValueError as error:
        raise BadInput("", "goto", f"{error}") from None
    session.say(session.debugger.go_to(tick))


def until(session: Session, rest: str) -> None:
    """On to a later line, a place, an event, or where an expression is true."""
    word = rest.partition(" ")[0]
    if not rest:
        session.say(session.debugger.move("until"))
    elif word in CONDITIONS:
        session.say(_event(session, rest))
    elif (addresses := _addresses(session, rest)) is not None:
        session.say(session.debugger.run_to(addresses))
    elif word in session.symbols.known or not word.isidentifier():
        session.say(session.debugger.until_true(rest))
    else:
        remedy = f"give a place, an expression, or one of {', '.join(CONDITIONS)}"
        raise BadInput("until", word, "is no condition and no name", remedy)


def _addresses(session: Session, rest: str) -> list[int] | None:
    """The addresses of a line or a function; None for other text."""
    symbol = session.symbols.image.symbols.find(rest)
    if rest.isdecimal() or rest[:1] == "*" or (symbol is not None and symbol.space == "code"):
        return session.symbols.at(session.place(rest))[0]
    file, _, line = rest.rpartition(":")
    return session.symbols.at(rest)[0] if "." in file and line.isdecimal() else None


def _event(session: Session, rest: str) -> str:
    try:
        name, *keys = shlex.split(rest)
    except ValueError as error:
        raise BadInput("", rest, f"{error}") from None
    device, kind = session.timeline.core.device, CONDITIONS[name]
    fields = kind.__struct_fields__
    given: dict[str, Any] = {"network": device.network}
    if "slot" in fields:
        given["slot"] = device.slot
    for key, _, value in (word.partition("=") for word in keys):
        given[key] = (
            int(value, 16) if _HEX.fullmatch(value) else _literal(value) if key == "equals" else value
        )
    try:
        return session.debugger.until(struct_of(given, kind, strict=False))
    except TomlError as error:
        raise BadInput(f"until {name}", error.place, error.what, error.remedy) from None
    except ValueError as error:
        raise BadInput("", rest, str(error), f"its keys are {', '.join(fields)}") from None


def _literal(text: str) -> bool | float | str:
    """Parses a number, true or false as in a scenario file; other text and quoted text is a string."""
    with suppress(msgspec.DecodeError):
        value = msgspec.json.decode(text)
        return value if isinstance(value, bool | int | float | str) else text
    return text
