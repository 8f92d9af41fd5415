"""The JSON schemas of a recording's messages, which viewers read."""

from typing import Any

import msgspec

from mirotwin.recording import images
from mirotwin.recording.channels import ControlMessage


def schema(message: msgspec.Struct) -> dict[str, object]:
    """The JSON schema of a message, with references resolved: viewers want one plain tree.

    The keys of a map become properties, because viewers offer nothing else to choose from.
    """
    if isinstance(message, images.ImageMessage):
        return images.SCHEMA
    (tree,), parts = msgspec.json.schema_components([type(message)], ref_template="{name}")
    resolved: dict[str, object] = _resolved(tree, parts)
    if isinstance(message, ControlMessage):
        names = {name: {"type": "number"} for name in message.inner}
        inner = {"type": "object", "properties": names, "required": list(names)}
        resolved["properties"] = {**resolved["properties"], "inner": inner}  # type: ignore[dict-item]
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
