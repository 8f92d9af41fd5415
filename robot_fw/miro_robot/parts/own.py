"""Checks of a part that may come from another author: its type, and that it keeps to its STATE."""

from __future__ import annotations

from typing import Any

from miro_exact.plugins import PluginError
from miro_exact.raised import described
from miro_exact.state import kind_of, table
from miro_robot.parts.keys import PartKeys, Place
from miro_robot.parts.part import Part

_CODES = 'of a number it is "q" (whole), "d", or one of these with limits: ("d", 0.0, 9.0)'


def check_made(made: Any, keys: PartKeys, place: Place) -> Part:
    """Checks the result of `make`: a new part with these keys at this place. Raises PluginError."""
    who = f"part {place.name!r} ({keys.name}): `make` returned"
    if not isinstance(made, Part):
        raise PluginError(f"{who} {made!r:.40}", "return a Part, as return FanPart(self, place)")
    if getattr(made, "keys", None) is not keys or getattr(made, "place", None) is not place:
        remedy = "make a new one at each call, whose `__init__` calls super().__init__(keys, place)"
        raise PluginError(f"{who} a part of other keys, or of another place", remedy)
    return made


def check_state(part: Part, tick: int) -> None:
    """Checks that all attributes of the part are declared, with values as in STATE. Raises PluginError."""
    try:
        _check(part)
    except Exception as error:
        problem = f"{error}" if isinstance(error, ValueError) else described(error)
        place = f"part {part.name!r} ({part.keys.name}), tick {tick}"
        raise PluginError(f"{place}: {problem}", "mend its STATE or NOT_STATE, or what it sets") from error


def _check(part: Part) -> None:
    state = table(type(part))
    fixed = {name for base in type(part).__mro__ for name in base.__dict__.get("NOT_STATE", ())}
    own = part.__dict__
    for name in own:
        if name not in state and name not in fixed:
            raise ValueError(f"attribute {name!r} is neither in STATE nor in NOT_STATE")
    for name, declared in state.items():
        if isinstance(declared, type | list):  # it has a table of its own
            if isinstance(declared, type) and not table(declared):
                raise ValueError(f"STATE[{name!r}] = {declared.__name__}, which has no STATE; {_CODES}")
            continue
        try:
            kind = kind_of(declared)
            value = kind.read(part, name) if name in own else getattr(part, name)
        except Exception as error:
            raise ValueError(f"STATE[{name!r}] = {declared!r:.60}: {described(error)}") from error
        if kind.form.endswith(("e", "f")):  # would come back rounded
            raise ValueError(f"STATE[{name!r}] = {declared!r:.60}; {_CODES}")
        if name not in own and not isinstance(value, (int, float)):  # an array of C
            continue
        try:
            kind.decode(kind.encode(value), 0)
        except Exception as error:
            problem = f"{error}" if isinstance(error, ValueError) else described(error)
            raise ValueError(f"attribute {name!r} is {value!r:.40}: {problem}") from error
