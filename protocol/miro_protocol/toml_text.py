"""TOML where it and our structs part: text that takes `tomllib` minutes, numbers no key takes, keys that are None."""

import math
import re
from typing import Any

TEXT_KIB = 512
"""Most KiB of a document: a built-in scenario has 4."""
KEY_PARTS = 16
"""Most parts of a dotted key: the deepest key of a scenario has 6. The time of `tomllib` grows with their square; a
whole file of such keys takes it 2.5 s.
"""

_KEY_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_KEY_PART}(?:[ \t]*+\.[ \t]*+{_KEY_PART}){{{KEY_PARTS}}}")


def too_long(text: str) -> bool:
    """Whether `text` holds more than `TEXT_KIB`."""
    return len(text) > TEXT_KIB << 10


def long_key_line(text: str) -> int | None:
    """The line, from 1, of the first key with more than `KEY_PARTS` parts; None if there is none."""
    found = _LONG_KEY.search(text)
    return None if found is None else text.count("\n", 0, found.start()) + 1


def not_finite(value: Any, path: str = "") -> tuple[str, float] | None:
    """Key path and value of the first NaN or infinity in tables that were read; None if there is none."""
    if isinstance(value, float):
        return None if math.isfinite(value) else (path, value)
    if isinstance(value, dict):
        inner = [(f"{path}.{key}" if path else key, item) for key, item in value.items()]
    elif isinstance(value, list):
        inner = [(f"{path}[{index}]", item) for index, item in enumerate(value)]
    else:
        return None
    return next((found for place, item in inner if (found := not_finite(item, place))), None)


def without_none(value: Any) -> Any:
    """Tables as TOML can have them: a key that is None is left out."""
    if isinstance(value, dict):
        return {key: without_none(item) for key, item in value.items() if item is not None}
    return [without_none(item) for item in value] if isinstance(value, list | tuple) else value
