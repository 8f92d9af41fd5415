"""The schemas that Foxglove published, as text.

Where they come from: `schemas/LICENSE.txt`.
"""

from __future__ import annotations

from functools import cache
from importlib import resources

import msgspec

from mirotwin.recording import schemas
from mirotwin.report.foxglove import messages

PREFIX = "foxglove."


def schema_of(message: msgspec.Struct) -> tuple[str, bytes]:
    """Name and text of a message's schema: Foxglove's for its messages, ours for all others."""
    if type(message).__module__ != messages.__name__:
        return schemas.schema_name(message), msgspec.json.encode(schemas.schema(message))
    name = type(message).__name__
    return PREFIX + name, _published(name)


@cache
def _published(name: str) -> bytes:
    return (resources.files("mirotwin.report.foxglove") / "schemas" / f"{name}.json").read_bytes()
