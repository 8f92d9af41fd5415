"""The form of a saved world: what it belongs to, its state, and a checksum over both.

    magic               8 bytes
    version             16 bytes, of the program that saved it: ASCII, filled up with zeros
    tables              32 bytes, SHA-256 over names and forms of all fields of the state
    scenario, firmware  32 bytes each, SHA-256
    seed                8 bytes
    state               as its tables say
    checksum            32 bytes, SHA-256 over all before

All numbers are little-endian. A version of this program whose worlds have other fields writes another hash of tables:
its worlds are refused, and so are those of before this form. It is data: nothing in it is ever executed.
"""

from __future__ import annotations

import hashlib
import struct
from functools import cache
from typing import NamedTuple

from miro_exact.bad_input import one_line

MAGIC = b"mirowrl2"
_HEAD = struct.Struct("<8s16s32s32s32sq")
_CHECKSUM_BYTES = 32


class Identity(NamedTuple):
    """The identity of a saved world; hashes in hex."""

    tables: str
    scenario: str
    firmware: str
    seed: int


@cache
def version() -> str:
    """Version of this program, as it is installed."""
    from importlib import metadata  # slow to import

    try:
        return metadata.version("mirotwin")
    except metadata.PackageNotFoundError:
        return "unknown"


def sealed(identity: Identity, state: bytes) -> bytes:
    """A saved world."""
    hashes = (bytes.fromhex(text) for text in identity[:3])
    content = _HEAD.pack(MAGIC, version().encode("ascii")[:16], *hashes, identity.seed) + state
    return content + hashlib.sha256(content).digest()


def opened(saved: bytes, own: Identity) -> bytes:
    """The state in a saved world. Raises ValueError unless it is whole and belongs to `own`."""
    content = saved[:-_CHECKSUM_BYTES]
    if not saved.startswith(MAGIC) or len(content) < _HEAD.size:
        raise ValueError("not a saved world, or one of a version of this program that wrote another form")
    if hashlib.sha256(content).digest() != saved[-_CHECKSUM_BYTES:]:
        raise ValueError("the saved world is damaged: its checksum is wrong")
    _, saver, *hashes, seed = _HEAD.unpack_from(content)
    tables, scenario, firmware = (value.hex() for value in hashes)
    identity = Identity(tables, scenario, firmware, seed)
    if identity.tables != own.tables:
        by = one_line(saver.rstrip(b"\0").decode("ascii", "backslashreplace"))
        raise ValueError(
            f"the saved world has other fields: another version of this program saved it ({by}; this is {version()})"
        )
    for key, here, there in zip(Identity._fields, own, identity, strict=True):
        if here != there:
            raise ValueError(f"the saved world has {key} {there}, this world has {here}")
    return content[_HEAD.size :]
