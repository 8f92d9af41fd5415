"""The JSON schemas of a recording's messages, which viewers read."""

from functools import cache
from typing import Any

import msgspec

from mirotwin.recording import images
from mirotwin.recording.channels import ControlMessage


def schema_text(message: msgspec.Struct) -> bytes:
    """The JSON schema of a message, as text."""
    return _text(type(message), tuple(message.inner) if isinstance(message, ControlMessage) else None)


@cache
def _text(kind: type[msgspec.Struct], inner: tuple[str, ...] | None) -> bytes:
    """Made once: it takes longer than some control periods, and many robots have the same channels."""
    return msgspec.json.encode(images.SCHEMA if kind is images.ImageMessage else _schema(kind, inner))


def _schema(kind: type[msgspec.Struct], inner: tuple[str, ...] | None) -> dict[str, object]:
    """The schema with references resolved: viewers want one plain tree.

    The keys of a map, `inner`, become properties, because viewers offer nothing else to choose from.
    """
    (tree,), parts = msgspec.json.schema_components([kind], ref_template="{name}")
    resolved: dict[str, object] = _resolved(tree, parts)
    if inner is not None:
        names = {name: {"type": "number"} for name in inner}
        named = {"type": "object", "properties": names, "required": list(names)}
        resolved["properties"] = {**resolved["properties"], "inner": named}  # type: ignore[dict-item]
    return resolved


def _resolved(node: Any, parts: dict[str, Any]) -> Any:
    if isinstance(node, dict):
        if "$ref" in node:
            return _resolved(parts[node["$ref"]], parts)
        return {key: _resolved(value, parts) for key, value in node.items()}
    return [_resolved(item, parts) for item in node] if isinstance(node, list) else node


def schema_name(message: msgspec.Struct) -> str:
    """What its schema is called."""
    if isinstance(message, images.ImageMessage):
        return images.SCHEMA_NAME
    return f"mirotwin.{type(message).__name__.removesuffix('Message')}"
