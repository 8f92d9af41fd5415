"""Values as TOML writes them on one line: what stands after `KEY=` in a setting."""

from __future__ import annotations

import re
from typing import Any

import tomli_w

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def inline(value: Any) -> str:
    """The value as TOML on one line; a table as `{key = value}`."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {inline(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(inline(inner) for inner in value) + "]"
    return tomli_w.dumps({"x": value}).removeprefix("x = ").rstrip("\n")


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else inline(key)
