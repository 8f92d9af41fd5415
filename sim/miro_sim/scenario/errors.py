"""Error messages about a scenario, in one line: file, key path, reason, and remedy."""

import re
from functools import cache
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput, did_you_mean
from miro_exact.plugins import PluginError, use_one_of
from miro_protocol import toml_text
from miro_sim.scenario.keys import Scenario
from miro_sim.scenario.plugins import REGISTRIES, struct_of

UNITS = {
    "s": "seconds",
    "ms": "milliseconds",
    "cm": "centimetres",
    "m": "metres",
    "rad": "radians",
    "deg": "degrees",
    "hz": "hertz",
    "db": "decibels",
    "ppm": "parts per million",
    "m_s": "metres per second",
    "rad_s": "radians per second",
    "m_s2": "metres per second squared",
    "rad_s2": "radians per second squared",
    "per_s": "1/s",
    "per_m": "1/m",
    "kg": "kilograms",
    "kg_m2": "kilogram square metres",
    "v": "volts",
    "ohm": "ohms",
    "h": "henries",
    "nm": "newton metres",
}
MORE_UNITS = (
    "us", "ns", "min", "mm", "km", "turns", "khz", "mhz", "ticks", "cm_s", "deg_s", "g", "gcm2",
    "mv", "uh", "mnm",
)  # fmt: skip
TYPE_NAMES = {**toml_text.TYPE_NAMES, "array": "an array of tables"}
PARTS_OF_A_ROBOT = ("reference", "controller")
"""Tables that every robot of a scenario needs."""
FILE_KEYS = ("scenario", "set", "variant")
"""Further top-level keys of a file (`base`, `variants`)."""
SCENARIO_IS_MEANT = ("base", "based_on", "extends", "from", "inherits", "parent")


class ScenarioError(BadInput):
    """A scenario that cannot be used: file or built-in name, key path or line, what, remedy."""


class Refused(BadInput):
    """A key or a value that cannot be used, of which the caller knows the place: what, and what to write instead."""

    def __init__(self, problem: str, remedy: str = "") -> None:
        super().__init__("", "", problem, remedy)


def value_error(origin: str, raw: dict[str, Any], message: str) -> ScenarioError:
    """msgspec's error in the words of the file: path without `$`, and a remedy."""
    problem, path = toml_text.what_and_path(message)
    unknown = re.fullmatch(r"(?s)Object contains unknown field `(.*)`", problem)
    if unknown:
        known = _keys_at(raw, path)
        place = f"{path}.{unknown[1]}" if path else unknown[1]
        remedy = _other_plugin(raw, path, unknown[1]) or ("" if path else _of_a_file(unknown[1]))
        remedy = remedy or remedy_for_key(unknown[1], known if path else [*known, *FILE_KEYS])
        if not path and remedy.startswith("keys here"):
            remedy += "; `mirotwin scenarios show fig6` has those of their tables, too"
        return ScenarioError(origin, place, "unknown key", remedy)
    missing = re.fullmatch(r"Object missing required field `(.*)`", problem)
    if missing:
        place = f"{path}.{missing[1]}" if path else missing[1]
        shown = "add it, as in `mirotwin scenarios show fig6`" if missing[1] in PARTS_OF_A_ROBOT else "add it"
        return ScenarioError(origin, place, "this key is missing", _choices_at(raw, place) or shown)
    inner = re.fullmatch(r"(?s)([a-z0-9_.]+(?:\[\d+\])?(?:\.[a-z0-9_]+)*): (.*)", problem)
    if inner:  # a rule between keys (`Network.__post_init__`) names the place below its own table
        path = f"{path}.{inner[1]}" if path else inner[1]
        problem = inner[2]
    limit = re.fullmatch(r"(\w+) must be (.*), got (.*)", problem)
    if limit:  # a parameter of the drive or of the radio
        path = f"{path}.{limit[1]}"
        remedy = f"must be {limit[2]}{_unit_of(path)}"
        return ScenarioError(origin, path, f"{limit[3]} is out of range", remedy)
    problem, _, remedy = problem.partition("; ")
    value = value_at(raw, path)
    return ScenarioError(origin, path, *explained(problem, path, value, remedy or _choices_at(raw, path)))


def explained(problem: str, path: str, value: Any, remedy: str) -> tuple[str, str]:
    """Reason and remedy for msgspec's error at a key path, in the words of the file."""
    wrong_type = re.fullmatch(r"Expected `([\w |]+)`, got `(\w+)`", problem)
    if wrong_type:
        want = " or ".join(
            TYPE_NAMES.get(name, name) for name in wrong_type[1].split(" | ") if name != "null"
        )
        if want == TYPE_NAMES["array"] and not isinstance(value, dict):
            want = toml_text.TYPE_NAMES["array"]
        got = TYPE_NAMES.get(wrong_type[2], f"a {wrong_type[2]}")
        problem = f"expected {want}{_unit_of(path)}, got {got}{_shown(value)}"
        if wrong_type[1] == "array" and isinstance(value, dict):
            return problem, "write its header in double brackets"
        return problem, _quoted_number(wrong_type[1], value) or remedy
    limit = re.fullmatch(r"Expected `\w+` (>=|>|<=|<) (\S+)", problem)
    if limit:
        return f"{value} is out of range", f"must be {limit[1]} {limit[2]}{_unit_of(path)}"
    if problem.startswith(("Invalid enum value", "Invalid value")):
        return f"{value!r} is not one of the choices", remedy
    if "0-9A-Fa-f" in problem:
        return f"{value!r} is not bytes in hex digits", "use two digits a byte, as 0a ff"
    if "matching regex" in problem:
        return f"{value!r} is not a name", "use a-z, 0-9, - and _, at most 64 characters"
    problem = problem.replace("`array`", "a list")
    return problem[:1].lower() + problem[1:], remedy


def _of_a_file(key: str) -> str:
    """The remedy for a key that only the top of a file may have, or that is meant as one."""
    if key in SCENARIO_IS_MEANT:
        return "did you mean scenario?"
    if key == "set":
        return 'it goes with scenario = "NAME", the one whose keys it changes'
    return "it goes at the top of a file" if key == "scenario" else ""


def remedy_for_key(key: str, known: list[str]) -> str:
    """The remedy for an unknown key: the same quantity in its own unit, or the nearest spelling."""
    stem = _stem(key)
    for candidate in known:
        if _stem(candidate) == stem and candidate != key and unit_name(candidate):
            return f"use {candidate}, in {unit_name(candidate)}"
    others = f"keys here: {', '.join(known)}" if known else "remove it"
    return did_you_mean(key, known) or others


def unit_name(key: str) -> str:
    """The unit that ends a key, in words, or the empty string."""
    return UNITS.get(_unit(key), "")


def _unit(key: str) -> str:
    """The longest unit that ends a key."""
    return max((unit for unit in (*UNITS, *MORE_UNITS) if key.endswith(f"_{unit}")), key=len, default="")


def _stem(key: str) -> str:
    return key.removesuffix(f"_{_unit(key)}")


def _unit_of(path: str) -> str:
    unit = unit_name(path)
    return f" in {unit}" if unit else ""


def _shown(value: Any) -> str:
    return f" ({value!r})" if isinstance(value, (str, int, float)) else ""


def _quoted_number(want: str, value: Any) -> str:
    """The commonest slip has a remedy of its own: a number, perhaps with its unit, inside quotes."""
    if want not in ("float", "int") or not isinstance(value, str):
        return ""
    number = re.match(r"\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?", value)
    return "write the number without quotes; the unit stands in the key" if number else ""


def value_at(raw: Any, path: str) -> Any:
    """The value at a key path like `network[0].radio.keyup_s`, or None."""
    for key, index in re.findall(r"([^.\[\]]+)|\[(\d+)\]", path):
        try:
            raw = raw[int(index)] if index else raw[key]
        except (KeyError, IndexError, TypeError):
            return None
    return raw


@cache
def _type_of(struct: type) -> msgspec.inspect.Type:
    """The type of the struct with everything in it.

    Cached: 15 ms of work for a scenario, needed up to four times per error.
    """
    return msgspec.inspect.type_info(struct)


def _type_at(raw: Any, path: str) -> msgspec.inspect.Type | None:
    """The type allowed at a key path; below tagged tables, of these tables."""
    kind = _type_of(Scenario)
    for key, index in re.findall(r"([^.\[\]]+)|\[(\d+)\]", path):
        kind = _chosen(kind, raw)
        raw = value_at(raw, key or f"[{index}]")
        if key and isinstance(kind, msgspec.inspect.StructType):
            fields = {field.encode_name: field.type for field in kind.fields}
            if key not in fields:
                return None
            kind = fields[key]
        if isinstance(kind, msgspec.inspect.Metadata):
            kind = kind.type
        if not key and isinstance(kind, msgspec.inspect.VarTupleType):
            kind = kind.item_type
    return kind


def _chosen(kind: msgspec.inspect.Type, table: Any) -> msgspec.inspect.Type:
    """The type itself; of a plug-in's table, or of several kinds, the one that the table names."""
    if isinstance(kind, msgspec.inspect.UnionType) and isinstance(table, dict):
        structs = [option for option in kind.types if isinstance(option, msgspec.inspect.StructType)]
        named = [
            struct for struct in structs if not struct.tag_field or table.get(struct.tag_field) == struct.tag
        ]
        return named[0] if len(named) == 1 else kind
    if not isinstance(kind, msgspec.inspect.CustomType):
        return kind
    try:
        return _type_of(struct_of(REGISTRIES[kind.cls], table))
    except (ValueError, TypeError, AttributeError):  # no plug-in is named, or none can be used
        return kind


def _structs_at(raw: Any, path: str) -> list[msgspec.inspect.StructType]:
    """The kinds of table that there may be at a key path: several where a key says which."""
    kind = _type_at(raw, path)
    if kind is not None:
        kind = _chosen(kind, value_at(raw, path))
    return [option for option in _options(kind) if isinstance(option, msgspec.inspect.StructType)]


def _options(kind: msgspec.inspect.Type | None) -> tuple[msgspec.inspect.Type | None, ...]:
    return kind.types if isinstance(kind, msgspec.inspect.UnionType) else (kind,)


def _keys_at(raw: Any, path: str) -> list[str]:
    """The keys of the table at a key path, which has chosen its kind."""
    value = value_at(raw, path)
    for struct in _structs_at(raw, path):
        tag = struct.tag_field
        if tag is None or value.get(tag, struct.tag) == struct.tag:
            return [*([tag] if tag else []), *struct.cls.__struct_encode_fields__]
    return []


def _other_plugin(raw: Any, path: str, key: str) -> str:
    """The remedy for a key that belongs to another plug-in than the one which the table at `path` names."""
    table = _type_at(raw, path)
    if not isinstance(table, msgspec.inspect.CustomType):
        return ""
    registry = REGISTRIES[table.cls]
    for name in registry.names():
        try:
            keys = registry.find(name).__struct_encode_fields__
        except PluginError:
            continue
        if key in keys:
            return f'it belongs to the {registry.word} {name!r}, which {registry.key} = "{name}" chooses'
    return ""


def _choices_at(raw: Any, path: str) -> str:
    """The possible values of a key, if there are few: words, numbers, or kinds of its table."""
    above, _, key = path.rpartition(".")
    kind, table = _type_at(raw, path), _type_at(raw, above)
    if isinstance(table, msgspec.inspect.CustomType) and REGISTRIES[table.cls].key == key:
        choices = REGISTRIES[table.cls].names()
    elif not (choices := _literals(kind)):
        choices = [str(struct.tag) for struct in _structs_at(raw, above) if struct.tag_field == key]
    note = ": slots of a frame; each [[network.robot]] is a robot" if key == "robots" else ""
    return use_one_of(choices) + note if choices else ""


def _literals(kind: msgspec.inspect.Type | None) -> list[str]:
    literals = [option for option in _options(kind) if isinstance(option, msgspec.inspect.LiteralType)]
    return [str(value) for literal in literals for value in literal.values]


def choices_of(struct: type[msgspec.Struct], key: str) -> str:
    """The possible values of a struct's key, if they are a few words or numbers."""
    fields = msgspec.structs.fields(struct)
    literals = [_literals(_type_of(field.type)) for field in fields if field.encode_name == key]
    return use_one_of(literals[0]) if literals and literals[0] else ""
