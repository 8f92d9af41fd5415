"""Which format a file is in, by its first bytes.

| the file begins with | it is |
|---|---|
| the four bytes that a pcapng or an old pcap file begins with | pcapng |
| at least four of the bytes that an MCAP file begins with | recording |
| comments or none, then `TICK >`, `TICK <` or `TICK *`; or `# mirotwin stream` | stream |
| nothing but pairs of hexadecimal digits, separators and comments | hex |
| anything else, nothing included | raw |

Any bytes may be a raw capture, so the first four rules can be wrong about one; the format is therefore always
printed, and can be forced.
"""

from __future__ import annotations

import re
import string

from miro_protocol.pcapng_reader import CLASSIC_PCAP
from miro_protocol.pcapng_reader import MAGIC as PCAPNG
from mirotwin.recording.capture.hextext import BOM, HexText
from mirotwin.recording.capture.input import HEAD_BYTES
from mirotwin.recording.writer import MAGIC as MCAP

TIMED = ("pcapng", "recording", "stream")
FORMATS = ("hex", "raw", *TIMED)
NAMES = {
    "hex": "hex text",
    "raw": "raw bytes",
    "pcapng": "pcapng capture",
    "recording": "recording",
    "stream": "stream file",
}

_ENOUGH = 4
_PACKED = {b"\x1f\x8b\x08": "gzip", b"PK\x03\x04": "zip", b"\xfd7zXZ\0": "xz", b"\x28\xb5\x2f\xfd": "zstd"}
_STREAM = re.compile(
    rb"(?:\xef\xbb\xbf)?(?:#\s*mirotwin stream\b|(?:\s|#[^\n]*+\n)*+[0-9.]+[a-z]*[ \t]+[<>*])"
)
_TEXT = bytes(string.printable, "ascii")


def detect(head: bytes) -> tuple[str, str]:
    """(format, a note for the user or the empty string) of a file that begins with `head`.

    `head` is the whole file, or its first `input.HEAD_BYTES`.
    """
    if head.startswith((PCAPNG, *CLASSIC_PCAP)):
        return "pcapng", ""
    if len(head) >= _ENOUGH and (head.startswith(MCAP) or MCAP.startswith(head)):
        return "recording", ""
    if _STREAM.match(head):
        return "stream", ""
    if HexText.begins(head, len(head) < HEAD_BYTES):
        return "hex", ""
    for magic, packer in _PACKED.items():
        if head.startswith(magic):
            return "raw", f"looks packed by {packer}, unpack it first; read as raw bytes"
    if head.removeprefix(BOM) and not head.removeprefix(BOM).translate(None, _TEXT):
        return "raw", "is text, but neither pairs of hex digits nor a stream file; read as raw bytes"
    return "raw", ""
