"""Detects the form of a file by its first 64 KiB.

| the file begins with | it is |
|---|---|
| the four bytes that a pcapng file begins with | pcapng |
| the four bytes that a pcap file begins with | pcap |
| at least four of the bytes that an MCAP file begins with | recording |
| comments or none, then `TICK >`, `TICK <` or `TICK *`; or `# mirotwin stream` | stream |
| a zip file with a sigrok session's parts | sigrok |
| `<SALEAE>` | logic2 |
| `$date`, `$version`, `$comment` or `$timescale` | vcd |
| a line of names with a time and a value | saleae, table |
| a line of names with a time, and levels 0 and 1 | edges |
| sigrok's comments with a sample rate, and levels 0 and 1 | samples |
| lines such as `uart-1: 55` | annotations |
| offsets that agree with the bytes between them | hexdump, xxd, od |
| lines with a time and pairs of hexadecimal digits | stamped |
| nothing but pairs of hexadecimal digits, separators and comments | hex |
| the first line of a PuTTY log | putty |
| a colon and pairs of hexadecimal digits: a firmware image | refused |
| anything else that is no text, nothing included | raw |

Any bytes may be a raw capture, so the other rules can be wrong about one; the form is therefore always printed, and can
be forced.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from miro_protocol.pcapng_reader import CLASSIC_PCAP
from miro_protocol.pcapng_reader import MAGIC as PCAPNG
from mirotwin.recording.capture import dumps, hexlines
from mirotwin.recording.capture.forms import TERMINAL
from mirotwin.recording.capture.hextext import HexText
from mirotwin.recording.capture.input import HEAD_BYTES
from mirotwin.recording.capture.tables import table_of
from mirotwin.recording.capture.text import head_lines, is_text, text_of
from mirotwin.recording.writer import MAGIC as MCAP

_ENOUGH = 4
_SAMPLE_LINES = 200
_PACKED = {b"\x1f\x8b\x08": "gzip", b"PK\x03\x04": "zip", b"\xfd7zXZ\0": "xz", b"\x28\xb5\x2f\xfd": "zstd"}
_STREAM = re.compile(
    r"#\s*mirotwin stream\b|(?:\s|#[^\n]*+\n)*+(?:[0-9]+|[0-9.]+(?:h|min|s|ms|us))[ \t]+[<>*]", re.ASCII
)
_INTEL_HEX = re.compile(rb"\s*:(?:[0-9A-Fa-f]{2}){5,}\s")
_VCD = re.compile(rb"(?:\xef\xbb\xbf)?\s*\$(?:date|version|comment|timescale|scope)\s")
_SIGROK = (b"metadata", b"logic-1")


class Detected(NamedTuple):
    """`form`: of `FORMS`, "" for none. `why`: the evidence, or for no form what the file is instead, and a remedy."""

    form: str
    why: str
    remedy: str = ""


def detect(head: bytes) -> Detected:
    """The form of a file that begins with `head`: the whole file, or its first `input.HEAD_BYTES`."""
    whole = len(head) < HEAD_BYTES
    if not head:
        return Detected("raw", "it is empty")
    if kind := _by_first_bytes(head):
        return kind
    if _STREAM.match(text_of(head, whole)):
        return Detected("stream", "its first line is one of ticks")
    if _INTEL_HEX.match(head):
        return Detected("", "is a firmware image (Intel HEX)", "give a capture, or --from-form hex")
    if kind := _by_lines(_lines(head, whole)):
        return kind
    if HexText.begins(head, whole):
        return Detected("hex", "nothing but pairs of hex digits")
    if kind := _stamped(_lines(head, whole), loose=True):
        return kind
    if TERMINAL.match(head):
        return Detected("putty", "its first line is PuTTY's")
    if is_text(head, whole):
        return Detected(
            "",
            "is text in no form that is known",
            "name it with --from-form, or give --from-form raw",
        )
    return Detected("raw", "no form fits")


def _by_first_bytes(head: bytes) -> Detected | None:
    if head.startswith(PCAPNG):
        return Detected("pcapng", "its first bytes are those of one")
    if head.startswith(CLASSIC_PCAP):
        return Detected("pcap", "its first bytes are those of one")
    if len(head) >= _ENOUGH and (head.startswith(MCAP) or MCAP.startswith(head)):
        return Detected("recording", "its first bytes are those of one")
    if head.startswith(b"<SALEAE>"):
        return Detected("logic2", "its first bytes are those of one")
    if _VCD.match(head):
        return Detected("vcd", "its first word is of one")
    for magic, packer in _PACKED.items():
        if head.startswith(magic):
            if packer == "zip" and any(name in head for name in _SIGROK):
                return Detected("sigrok", "a zip file with its parts")
            if b"digital-0.bin" in head or b"meta.json" in head:
                return Detected("", "is a Logic 2 session", "export its data as CSV (File, Export)")
            return Detected("", f"is packed by {packer}", "unpack it first, or give --from-form raw")
    return None


def _lines(head: bytes, whole: bool) -> list[str]:
    """The first non-empty lines, without a line that is cut off."""
    lines = head_lines(head, whole)
    if "\0" in lines[0][:_ENOUGH]:
        return []
    return [line for line in lines if line.strip()][:_SAMPLE_LINES]


def _by_lines(lines: list[str]) -> Detected | None:
    if table := table_of(lines):
        return Detected(table.form, table.described)
    if 2 * (count := dumps.fits_annotations(lines)) > len(lines):
        return Detected("annotations", f"{count} of the first {len(lines)} lines are of a UART decoder")
    if base := dumps.base_of(lines):
        return Detected(dumps.kind_of(lines), f"its offsets, to base {base}, agree with the bytes between")
    return _stamped(lines)


def _stamped(lines: list[str], loose: bool = False) -> Detected | None:
    if 2 * (count := hexlines.fits(lines, loose)) > len(lines):
        return Detected("stamped", f"{count} of the first {len(lines)} lines are of times and hex digits")
    return None
