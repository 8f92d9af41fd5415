"""JSON of data with paths: the bytes of a file's name may be no UTF-8, which JSON cannot express."""

from typing import Any

import click
import msgspec

from miro_exact.bad_input import encodable


def json_bytes(document: Any, indent: int = -1) -> bytes:
    """The document in one line, or indented. Characters that UTF-8 does not have are escaped, as in an error's line."""
    try:
        data = msgspec.json.encode(document)
    except UnicodeEncodeError:
        data = msgspec.json.encode(_encodable(msgspec.to_builtins(document)))
    return data if indent < 0 else msgspec.json.format(data, indent=indent)


def print_json(document: Any) -> None:
    click.echo(json_bytes(document, indent=2))


def _encodable(value: Any) -> Any:
    if isinstance(value, str):
        return encodable(value)
    if isinstance(value, dict):
        return {_encodable(key): _encodable(inner) for key, inner in value.items()}
    return [_encodable(inner) for inner in value] if isinstance(value, list | tuple) else value
