"""The memory of a part, such as a law, as plain values: by a table of attributes, checked both ways.

What belongs here: taking, putting back, and the types that a table may name:

    d    a finite float
    q    an int of 64 bits with sign
    ?    True or False
    3d   a list of three of them; any other number likewise

What does not: the digest (`miro_exact.canonical`) and when a memory is taken (`pilot`).
"""

import math
import re
from collections.abc import Mapping, Sequence
from typing import ClassVar

LARGEST = (1 << 63) - 1
TYPES = {"d": "a finite float", "q": "an int of 64 bits", "?": "True or False"}
LONGEST = 65536
"""Items of one list. A part with more would make each period's digest slow."""


class Remembering:
    """A part with a memory: `STATE` declares it, attribute to type; `NOT_STATE` names what stays as it was made."""

    STATE: ClassVar[Mapping[str, str]] = {}
    NOT_STATE: ClassVar[tuple[str, ...]] = ("parameters",)

    def snapshot(self) -> dict[str, object]:
        """The memory as plain values. Raises ValueError naming an attribute that is not as declared."""
        return taken(self, self.STATE, self.NOT_STATE)

    def restore(self, state: dict[str, object]) -> None:
        """Puts back what `snapshot` gave. Raises ValueError for anything else, and changes nothing then."""
        put_back(self, self.STATE, state)


def taken(owner: object, table: Mapping[str, str], constant: Sequence[str]) -> dict[str, object]:
    """The attributes that `table` declares. `constant` names those that are no memory.

    Raises ValueError for an attribute that is missing, declared nowhere, or not of its type.
    """
    attributes = vars(owner)
    for name in attributes:
        if name not in table and name not in constant:
            raise ValueError(f"attribute {name!r} is neither in STATE nor in NOT_STATE")
    state: dict[str, object] = {}
    for name, code in table.items():
        if name not in attributes:
            raise ValueError(f"attribute {name!r} is in STATE and was never set")
        state[name] = checked(name, code, attributes[name])
    return state


def put_back(owner: object, table: Mapping[str, str], state: Mapping[str, object]) -> None:
    """Sets the attributes from what `taken` gave; ValueError for anything else, before the first is set."""
    if sorted(state) != sorted(table):
        raise ValueError(f"a memory of {', '.join(sorted(state)) or 'nothing'} where {sorted(table)} belong")
    values = {name: checked(name, code, state[name]) for name, code in table.items()}
    for name, value in values.items():
        setattr(owner, name, value)


def checked(name: str, code: str, value: object) -> object:
    """`value` if it is of the type that `code` names, a list as a copy. ValueError names the attribute."""
    match = re.fullmatch(r"([1-9]\d{0,5})?([dq?])", code)
    if match is None or int(match[1] or 1) > LONGEST:
        raise ValueError(
            f"STATE[{name!r}] = {code!r}: must be d, q or ?, or a number up to {LONGEST} before it"
        )
    if match[1] is None:
        _check(name, match[2], value)
        return value
    count = int(match[1])
    if not isinstance(value, list) or len(value) != count:
        raise ValueError(f"attribute {name!r} is not a list of {count} items")
    for index, item in enumerate(value):
        _check(f"{name}[{index}]", match[2], item)
    return list(value)


def _check(name: str, code: str, value: object) -> None:
    if code == "d":
        good = type(value) is float and math.isfinite(value)
    elif code == "q":
        good = type(value) is int and -LARGEST - 1 <= value <= LARGEST
    else:
        good = type(value) is bool
    if not good:
        raise ValueError(f"attribute {name!r} is {str(value)[:40]}, not {TYPES[code]}")
