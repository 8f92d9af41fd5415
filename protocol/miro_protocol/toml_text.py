"""Reading TOML: a document that cannot be used is one error, whatever `tomllib` makes of it."""

import copy
import math
import re
import tomllib
from collections.abc import Sequence
from typing import Any, TypeVar

import msgspec

from miro_exact.bad_input import BadInput, did_you_mean

TEXT_KIB = 512
"""Most KiB of a document: a built-in scenario has 4."""
KEY_PARTS = 16
"""Most parts of a dotted key: the deepest key of a scenario has 6. The time of `tomllib` grows with their square; a
whole file of such keys takes it 2.5 s.
"""
LONGEST_BITS = 1024
"""Beyond it an integer is beyond every float, too. `tomllib` reads longer ones in hex, which Python does not show."""

T = TypeVar("T")
TYPE_NAMES = {
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
    "str": "a string",
    "array": "a list",
    "object": "a table",
}
"""Names of types in msgspec -> in the words of TOML."""
_KEY_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_KEY_PART}(?:[ \t]*+\.[ \t]*+{_KEY_PART}){{{KEY_PARTS}}}")
_NAMED = "[...]"
_STEP = re.compile(r"\.?[^.\[\]]+|\[(?:\d+|\.\.\.)\]")
_PLACE = re.compile(r"(.*?) \(at (?:line (\d+), column (\d+)|end of document)\)$", re.DOTALL)


class TomlError(BadInput):
    """A document, which its reader names, that cannot be used. `line`, `column`: where, from 1; 0: not known."""

    def __init__(
        self, problem: str, remedy: str = "", place: str = "", line: int = 0, column: int = 0
    ) -> None:
        self.line = line
        self.column = column
        at = [f"line {line}"] * bool(line) + [f"column {column}"] * bool(column)
        super().__init__("", place or ", ".join(at), problem, remedy)


def tables(text: str) -> dict[str, Any]:
    """The tables of a document, which may begin with a byte-order mark. Raises TomlError."""
    text = text.removeprefix("\ufeff")  # editors of Windows write it, and TOML 1.0 does not say
    check_size(text)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        match = _PLACE.match(f"{error}")
        problem, line, column = match.groups() if match else (f"{error}", None, None)
        end = text.count("\n") + 1
        raise TomlError(f"not TOML: {problem}", line=int(line or end), column=int(column or 0)) from None
    except RecursionError:
        raise TomlError("nested too deeply", "tables have at most 5 levels") from None
    except ValueError:  # more digits than Python converts
        raise TomlError("an integer of thousands of digits", "give a smaller one") from None


def check_size(text: str) -> None:
    """Refuses what would take `tomllib` minutes. Raises TomlError."""
    if len(text) > TEXT_KIB << 10:
        raise TomlError(f"holds more than {TEXT_KIB} KiB", "is this the right file?")
    match = _LONG_KEY.search(text)
    if match is not None:
        line = text.count("\n", 0, match.start()) + 1
        problem, remedy = f"a key of more than {KEY_PARTS} parts", "remove it; no key has more than 6"
        raise TomlError(problem, remedy, line=line)


def value_of(text: str, path: str) -> Any:
    """The value of a text for the key at `path`: parsed as TOML, or the text itself if it is not TOML.

    Raises TomlError.
    """
    check_size(f"{path} = {text}")
    try:
        parsed = tomllib.loads(f"value = {text}")
    except ValueError:  # no TOML, or an integer with more digits than Python converts
        return text
    if len(parsed) > 1:
        return text
    check_numbers(parsed["value"], path)
    return parsed["value"]


def check_numbers(value: Any, path: str = "") -> None:
    """Refuses NaN, infinities and integers that no key takes. Raises TomlError with the path of the key."""
    if isinstance(value, float) and not math.isfinite(value):
        raise TomlError(f"{value} is not a number that can be used", "give a finite number", path)
    if isinstance(value, int) and value.bit_length() > LONGEST_BITS:
        raise TomlError(f"an integer of {value.bit_length()} bits", "give a smaller one", path)
    if isinstance(value, dict):
        for key, inner in value.items():
            check_numbers(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            check_numbers(inner, f"{path}[{index}]")


def struct_of(table: Any, kind: type[T], strict: bool = True) -> T:
    """The struct that a table says. Raises TomlError with the key. `strict`: 1 is not true, and "1" not 1."""
    try:
        return msgspec.convert(table, kind, strict=strict)
    except msgspec.ValidationError as error:
        message = f"{error}"
    problem, path = what_and_path(message)
    keys = () if path else getattr(kind, "__struct_encode_fields__", ())
    raise _misfit(problem, _with_names(path, table, kind, message), keys)


def what_and_path(message: str) -> tuple[str, str]:
    """msgspec's message, and the path of the key without its `$`."""
    match = re.fullmatch(r"(?s)(.*?)(?: - at `(?:\$|key in )?\.?(.*)`)?", message)
    assert match is not None
    return match[1], match[2] or ""


def _with_names(path: str, table: Any, kind: type, message: str) -> str:
    """The path with the keys that are names: msgspec writes [...] for each. One alone has the same fault."""
    if _NAMED not in path:
        return path
    at = whole = copy.deepcopy(table)
    for step in _STEP.findall(path):
        key: Any = int(step[1:-1]) if step[1:-1].isdigit() and step[0] == "[" else step.lstrip(".")
        if step == _NAMED:
            inside = dict(at)
            for key, value in inside.items():
                at.clear()
                at[key] = value
                if _fault(whole, kind) == message:
                    break
            path = path.replace(_NAMED, f".{key}", 1).lstrip(".")
        at = at[key]
    return path


def _fault(table: Any, kind: type) -> str:
    try:
        msgspec.convert(table, kind)
    except msgspec.ValidationError as error:
        return f"{error}"
    return ""


def _misfit(problem: str, path: str, keys: Sequence[str]) -> TomlError:
    """msgspec's message in the words of the file. `keys`: the keys of the table, if they are known."""
    field = re.fullmatch(r"(?s)Object (contains unknown|missing required) field `(.*)`", problem)
    if field is not None:
        place = f"{path}.{field[2]}" if path else field[2]
        if field[1] == "missing required":
            return TomlError("this key is missing", "add it", place)
        known = f"keys here: {', '.join(keys)}" if keys else "remove or correct it"
        return TomlError("unknown key", did_you_mean(field[2], keys) or known, place)
    limit = re.fullmatch(r"Expected `\w+` (>=|>|<=|<) (\S+)", problem)
    if limit is not None:
        return TomlError("is out of range", f"must be {limit[1]} {limit[2]}", path)
    wrong = re.fullmatch(r"Expected `([\w |]+)`, got `(\w+)`", problem)
    if wrong is not None:
        wanted = " or ".join(TYPE_NAMES.get(name, name) for name in wrong[1].split(" | ") if name != "null")
        problem = f"expected {wanted}, got {TYPE_NAMES.get(wrong[2], wrong[2])}"
    problem, _, remedy = problem.replace("`", "").partition("; ")
    return TomlError(problem[:1].lower() + problem[1:], remedy or "mend the value", path)


def without_none(value: Any) -> Any:
    """Tables as TOML can have them: a key that is None is left out."""
    if isinstance(value, dict):
        return {key: without_none(item) for key, item in value.items() if item is not None}
    return [without_none(item) for item in value] if isinstance(value, list | tuple) else value
