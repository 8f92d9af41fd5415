"""The memory of a plug-in, such as a law: declared in a table of attributes, checked after every step.

    d    a finite float
    q    an int of 64 bits with sign
    ?    True or False
    3d   a list of three of them; any other number likewise

What does not: saving and hashing it (`miro_exact.state`, which reads the same table), and when it is checked (`pilot`).
"""

import math
import re
from collections.abc import Mapping
from functools import cache
from typing import Any, ClassVar

NOTHING: Mapping[str, float] = {}
LARGEST = (1 << 63) - 1
TYPES = {"d": "a finite float", "q": "an int of 64 bits", "?": "True or False"}
LONGEST = 65536
"""Items of one list. A plug-in with more would make each period's digest slow."""


class Remembering:
    """A plug-in with parameters and a memory. `STATE` declares the memory, attribute to type; `NOT_STATE` names what
    stays as it was made.
    """

    STATE: ClassVar[Mapping[str, Any]] = {}
    NOT_STATE: ClassVar[tuple[str, ...]] = ("parameters",)

    def __init__(self, parameters: Any) -> None:
        self.parameters = parameters

    def __repr__(self) -> str:
        memory = {name: getattr(self, name) for name in self.STATE}
        return f"{type(self).__name__}({self.parameters!r}, memory={memory!r})"

    def check_memory(self) -> None:
        """Raises ValueError for an attribute that is missing, declared nowhere, or not of its type."""
        attributes, state, fixed = self.__dict__, self.STATE, self.NOT_STATE
        for name in attributes:
            if name not in fixed and name not in state:
                raise ValueError(f"attribute {name!r} is neither in STATE nor in NOT_STATE")
        for name, code in state.items():
            if name not in attributes:
                raise ValueError(f"attribute {name!r} is in STATE and was never set")
            check(name, code, attributes[name])

    def after_load(self) -> None:
        """Raises ValueError for a memory that no step leaves."""
        self.check_memory()


def check(name: str, code: str, value: object) -> None:
    """Raises ValueError, which names the attribute, unless `value` is of the type that `code` names."""
    count, kind = _parsed(code)
    if not kind:
        raise ValueError(
            f"STATE[{name!r}] = {code!r}: must be d, q or ?, or a number up to {LONGEST} before it"
        )
    if count is None:
        _check(name, kind, value)
        return
    if not isinstance(value, list) or len(value) != count:
        raise ValueError(f"attribute {name!r} is not a list of {count} items")
    for index, item in enumerate(value):
        _check(f"{name}[{index}]", kind, item)


@cache
def _parsed(code: str) -> tuple[int | None, str]:
    """The number and the type that a code names; no type if it is none."""
    match = re.fullmatch(r"([1-9]\d{0,5})?([dq?])", code)
    if match is None or int(match[1] or 1) > LONGEST:
        return None, ""
    return (None if match[1] is None else int(match[1])), match[2]


def _check(name: str, code: str, value: object) -> None:
    if code == "d":
        good = type(value) is float and math.isfinite(value)
    elif code == "q":
        good = type(value) is int and -LARGEST - 1 <= value <= LARGEST
    else:
        good = type(value) is bool
    if not good:
        raise ValueError(f"attribute {name!r} is {str(value)[:40]}, not {TYPES[code]}")
