"""Tables of a scenario whose keys depend on the part that they name: `law = "yang_kim"` and the keys of that law."""

import re
from typing import Any

import msgspec

from miro_host.estimators.registry import ESTIMATORS, AnyEstimator
from miro_host.laws.registry import LAWS, Controller
from miro_host.parts import PartError, Registry
from miro_host.raised import raised
from miro_host.references.registry import REFERENCES, AnyReference

REGISTRIES: dict[type, Registry[Any]] = {
    AnyReference: REFERENCES,
    AnyEstimator: ESTIMATORS,
    Controller: LAWS,
}
"""By the type that a field of the scenario has."""


class PartTableError(ValueError):
    """What is wrong in a part's table, in msgspec's form: what, and the path below the table."""


def part_of(kind: type, table: object) -> object:
    """A table of a part as its struct of parameters: the hook for `msgspec.convert`. Raises PartTableError."""
    registry = REGISTRIES[kind]
    try:
        keys = msgspec.convert(table, dict[str, Any])
        return msgspec.convert(keys, struct_of(registry, keys), dec_hook=part_of)
    except msgspec.ValidationError as error:
        raise PartTableError(full_message(error)) from None
    except PartError as error:
        raise PartTableError(f"{error} - at `$.{registry.key}`") from error
    except (Exception, SystemExit) as error:  # from the part's own check of its parameters
        what = f"{registry.word} {keys.get(registry.key)!r} cannot check its parameters: {raised(error)}"
        raise PartTableError(what) from error


def struct_of(registry: Registry[Any], keys: dict[str, Any]) -> type[msgspec.Struct]:
    """The struct of parameters that a table names. Raises PartError, and ValidationError when it names none."""
    if registry.key not in keys and registry.default is None:
        raise msgspec.ValidationError(f"Object missing required field `{registry.key}`")
    try:
        name = msgspec.convert(keys.get(registry.key, registry.default), str)
    except msgspec.ValidationError as error:
        raise msgspec.ValidationError(f"{error} - at `$.{registry.key}`") from None
    found: type[msgspec.Struct] = registry.find(name)
    return found


def cause_of(error: msgspec.ValidationError) -> BaseException | None:
    """What a part raised while its table was read, if one did."""
    return error.__cause__.__cause__ if isinstance(error.__cause__, PartTableError) else None


def full_message(error: msgspec.ValidationError) -> str:
    """The message with one path, from the top down to the fault: msgspec knows only that of the part's table."""
    message, cause = str(error), error.__cause__
    if not isinstance(cause, PartTableError):
        return message
    below = str(cause)
    what, _, path = (
        below.rpartition(" - at `$") if re.search(r" - at `\$[^`]*`\Z", below) else (below, "", "`")
    )
    above = message[len(below) :]
    outer = above[len(" - at `") : -1] if above else "$"
    return f"{what} - at `{outer}{path}"
