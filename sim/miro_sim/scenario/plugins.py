"""Tables of a scenario whose keys depend on the plug-in that they name: `law = "yang_kim"` and the keys of that law."""

import re
from collections.abc import Callable, Iterator
from typing import Any

import msgspec

from miro_exact.installed import described
from miro_exact.plugins import PluginError, Registry
from miro_exact.raised import raised
from miro_host.registries import ESTIMATORS, LAWS, REFERENCES, AnyEstimator, AnyReference, Controller
from miro_robot.parts.keys import PartKeys
from miro_sim.scenario.parts import PARTS

REGISTRIES: dict[type, Registry[Any]] = {
    AnyReference: REFERENCES,
    AnyEstimator: ESTIMATORS,
    Controller: LAWS,
    PartKeys: PARTS,
}
"""By the type that a field of the scenario has."""


class PluginTableError(ValueError):
    """An error in a plug-in's table, in msgspec's form: reason, and the path below the table."""


def plugin_of(kind: type, table: object) -> object:
    """A table of a plug-in as its struct of parameters: the hook for `msgspec.convert`. Raises PluginTableError."""
    registry = REGISTRIES[kind]
    try:
        keys = msgspec.convert(table, dict[str, Any])
        return msgspec.convert(keys, struct_of(registry, keys), dec_hook=plugin_of)
    except msgspec.ValidationError as error:
        raise PluginTableError(full_message(error)) from None
    except PluginError as error:
        raise PluginTableError(f"{error} - at `$.{registry.key}`") from error
    except (Exception, SystemExit) as error:  # from the plug-in's own check of its parameters
        problem = f"{registry.word} {keys.get(registry.key)!r} cannot check its parameters: {raised(error)}"
        raise PluginTableError(problem) from error


def struct_of(registry: Registry[Any], keys: dict[str, Any]) -> type[msgspec.Struct]:
    """The struct of parameters that a table names. Raises PluginError, and ValidationError when it names none."""
    if registry.key not in keys and registry.default is None:
        raise msgspec.ValidationError(f"Object missing required field `{registry.key}`")
    try:
        name = msgspec.convert(keys.get(registry.key, registry.default), str)
    except msgspec.ValidationError as error:
        raise msgspec.ValidationError(f"{error} - at `$.{registry.key}`") from None
    struct: type[msgspec.Struct] = registry.find(name)
    return struct


def plugins_used(
    scenario: msgspec.Struct, describe: Callable[[str, str], str] = described
) -> tuple[str, ...]:
    """The plug-ins of other distributions that a scenario names, as `described`: in order, each once."""
    return tuple(sorted({text for kind, name in _named(scenario) if (text := describe(kind, name))}))


def _named(value: Any) -> Iterator[tuple[str, str]]:
    """Kind and name of each plug-in: by the struct of its parameters, and of checks by the keys of their tables."""
    if isinstance(value, msgspec.Struct):
        for kind, registry in REGISTRIES.items():
            if isinstance(value, kind):
                yield registry.word, str(value.__struct_config__.tag)
        for name in value.__struct_fields__:
            field = getattr(value, name)
            if name == "expect":
                yield from (("check", key) for key in field)
            elif name == "step":
                yield from (("check", key) for step in field for key in table_of(step.get("check")))
            else:
                yield from _named(field)
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from _named(inner)
    elif isinstance(value, dict):
        yield from _named(tuple(value.values()))


def table_of(value: Any) -> dict[str, Any]:
    """The value, if it is a table; what has another shape is left to whoever checks the scenario."""
    return value if isinstance(value, dict) else {}


def cause_of(error: msgspec.ValidationError) -> BaseException | None:
    """The exception that a plug-in raised while its table was read; None if there was none."""
    return error.__cause__.__cause__ if isinstance(error.__cause__, PluginTableError) else None


def full_message(error: msgspec.ValidationError) -> str:
    """The message with one path, from the top down to the fault: msgspec knows only that of the plug-in's table."""
    message, cause = str(error), error.__cause__
    if not isinstance(cause, PluginTableError):
        return message
    below = str(cause)
    problem, _, path = (
        below.rpartition(" - at `$") if re.search(r" - at `\$[^`]*`\Z", below) else (below, "", "`")
    )
    above = message[len(below) :]
    outer = above[len(" - at `") : -1] if above else "$"
    return f"{problem} - at `{outer}{path}"
