"""TOML files of the eye: calibrations and colour classes, with errors that name file, place and remedy.

What belongs here: from a path or a text to a frozen struct, and back. What does not: what the structs mean.
"""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from miro_exact.bad_input import BadInput

T = TypeVar("T", bound=msgspec.Struct)


class EyeError(BadInput):
    """A calibration, colours or points that cannot be used."""


def read(path: str | Path, kind: type[T]) -> T:
    """The struct in a TOML file. Raises EyeError for one that cannot be read, and as `parse` does."""
    return parse(text_of(path), kind, f"{path}")


def text_of(path: str | Path) -> str:
    """A file's text. Raises EyeError."""
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise EyeError(path, "", f"cannot be read: {error.strerror}", "check path and permissions") from None
    except ValueError:
        raise EyeError(path, "", "not UTF-8 text", "give a text file") from None


def parse(text: str, kind: type[T], origin: str) -> T:
    """The struct in TOML text. Raises EyeError with the key for unknown keys, wrong types and values out of range."""
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise EyeError(origin, "", f"not TOML: {error}", "mend the text") from None
    return of_table(table, kind, origin)


def of_table(table: dict[str, Any], kind: type[T], origin: str) -> T:
    """The struct in a table that TOML text gave. Raises EyeError as `parse` does."""
    _check_finite(table, "", origin)
    try:
        return msgspec.convert(table, kind)
    except msgspec.ValidationError as error:
        raise _explained(f"{error}", kind, origin) from None


def text(struct: msgspec.Struct) -> str:
    """The struct as TOML text that `parse` reads back as the same struct. What is None is left out."""
    import tomli_w  # only who writes a file needs it

    return tomli_w.dumps(_without_none(msgspec.to_builtins(struct)))


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return value


def _check_finite(value: Any, path: str, origin: str) -> None:
    if isinstance(value, dict):
        for key, item in value.items():
            _check_finite(item, f"{path}.{key}" if path else key, origin)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            _check_finite(item, f"{path}[{index}]", origin)
    elif isinstance(value, float) and not math.isfinite(value):
        raise EyeError(origin, path, f"{value} is not a number that can be used", "give a finite number")


def _explained(message: str, kind: type[msgspec.Struct], origin: str) -> EyeError:
    """What msgspec found, as an error that names key and remedy."""
    match = re.fullmatch(r"(?s)(.*?)(?: - at `(?:\$|key in )?\.?(.*)`)?", message)
    assert match is not None
    what, path = match[1], match[2] or ""
    inner = re.fullmatch(r"(?s)Object (contains unknown|missing required) field `(.*)`", what)
    if inner is None:
        what, _, remedy = what.partition("; ")
        return EyeError(origin, path, what.replace("`", ""), remedy or "mend the value")
    place = f"{path}.{inner[2]}" if path else inner[2]
    if inner[1] == "missing required":
        return EyeError(origin, place, "this key is missing", "add it")
    keys = "" if path else f"; the keys are {', '.join(kind.__struct_fields__)}"
    return EyeError(origin, place, "unknown key", f"remove or correct it{keys}")
