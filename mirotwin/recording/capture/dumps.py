"""Characters without times: dumps of `hexdump`, `xxd` and `od`, and annotations of sigrok's UART decoder.

00000000  55 55 ff 2d  |UU.-|       00000000: 5555 ff2d  UU.-       000000 55 55 ff 2d  >UU.-<       uart-1: 55
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from miro_exact.bad_input import amount
from miro_exact.inputs import InputError
from mirotwin.recording.capture.pieces import Facts, Piece, direction_in

REPEATED_BYTES = 64 << 20
"""More than this behind a `*` is a damaged offset."""
_ROW = re.compile(r"\s*(?P<offset>[0-9A-Fa-f]{4,16})(?P<colon>:?)(?:\s+(?P<body>.*))?")
_GROUP = re.compile(r"(?:[0-9A-Fa-f]{2}){1,8}")
_ANNOTATION = re.compile(
    r"\s*(?:[0-9]+-[0-9]+\s+)?(?P<source>[A-Za-z][\w /\[\]]*?(?:-[0-9]+)?):\s+(?:(?P<kind>[A-Za-z][\w -]*):\s+)?"
    r"\"?(?P<value>[0-9A-Fa-f]{2})\"?\s*"
)
_OF_UART = re.compile(r"\s*(?:[0-9]+-[0-9]+\s+)?[\w /\[\]-]*(?:uart|serial)[\w /\[\]-]*:\s", re.IGNORECASE)
BASES = (16, 8, 10)


class _Row(NamedTuple):
    offset: str
    data: bytes


def _row(line: str) -> _Row | None:
    match = _ROW.fullmatch(line)
    if match is None:
        return None
    body = match["body"] or ""
    if match["colon"]:
        body = re.split(r"\s\s", body, maxsplit=1)[0]
    data, width = bytearray(), 0
    for word in re.sub(r"\s[|>].*", "", f" {body}").split():
        if not _GROUP.fullmatch(word) or (width and len(word) > width):
            break
        width = width or len(word)
        group = bytes.fromhex(word)
        data += group if match["colon"] else group[::-1]  # words of hexdump and od have their low byte first
    return _Row(match["offset"], bytes(data))


def base_of(lines: Sequence[str]) -> int:
    """Base of the offsets with which they agree with the bytes between; 0 for no dump."""
    rows: list[tuple[_Row, bool]] = []  # and whether repeated rows are left out before it
    star = False
    for line in lines:
        row = _row(line)
        if row is not None:
            rows.append((row, star))
        star = line.strip() == "*"
    pairs = [(row, after, left_out) for (row, _), (after, left_out) in pairwise(rows)]
    for base in BASES:
        good = sum(_follows(row, after, base, left_out) for row, after, left_out in pairs)
        if good and good * 10 >= 9 * len(pairs) - 10:
            return base
    row = rows[0][0] if len(rows) == 1 else None
    alone = row is not None and row.data and not row.offset.strip("0") and len(row.offset) > 4
    return 16 if alone and any(mark in lines[0] for mark in (": ", "|", ">")) else 0


def _follows(row: _Row, after: _Row, base: int, left_out: bool) -> bool:
    try:
        count = int(after.offset, base) - int(row.offset, base)
    except ValueError:
        return False
    size = len(row.data)
    return (left_out and size > 0 and count > size) or 0 < count <= size <= count + 1


def kind_of(lines: Sequence[str]) -> str:
    """The program that most likely wrote a dump."""
    if any(":" in line.partition(" ")[0] for line in lines):
        return "xxd"
    return "hexdump" if any(line.rstrip().endswith("|") for line in lines) else "od"


def read(lines: Iterator[str], facts: Facts, base: int) -> Iterator[Piece]:
    """The bytes of a dump.

    The number of bytes in a line, and the meaning of `*`, follow from the offset of the next line.
    """
    held: _Row | None = None
    repeats = False
    missing = first_gap = 0
    for number, line in enumerate(lines, 1):
        if line.strip() == "*":
            repeats = held is not None
            continue
        row = _row(line)
        if row is None:
            if line.strip():
                facts.pass_over("line", f"line {number}")
            continue
        if held is not None:
            try:
                count = int(row.offset, base) - int(held.offset, base)
            except ValueError:
                count = len(held.data)
            if held.data and not repeats and count > len(held.data):
                missing += count - len(held.data)
                first_gap = first_gap or number
            yield from _held_pieces(held.data, count, repeats, facts.label, number)
        held, repeats = row, False
    if held is not None and held.data:
        yield Piece(None, "", held.data)
    if missing:
        reason = f"by the offsets {amount(missing, 'character')} missing, first before line {first_gap}"
        facts.tell(f"{facts.label}: {reason}; copy the whole dump")


def _held_pieces(data: bytes, count: int, repeats: bool, label: str, number: int) -> Iterator[Piece]:
    if not repeats or not data or count <= len(data):
        if data[: count if count > 0 else None]:
            yield Piece(None, "", data[: count if count > 0 else None])
        return
    if count > REPEATED_BYTES:
        reason = f"line {number}: the offset is {count} bytes behind the last"
        raise InputError(label, reason, "copy the whole dump")
    whole, rest = divmod(count, len(data))
    for _ in range(whole):
        yield Piece(None, "", data)
    if rest:
        yield Piece(None, "", data[:rest])


def fits_annotations(lines: Sequence[str]) -> int:
    """Number of lines that are annotations of a serial decoder."""
    if not any(map(_ANNOTATION.fullmatch, lines)):
        return 0
    return sum(bool(_OF_UART.match(line)) for line in lines)


def read_annotations(lines: Iterator[str], facts: Facts) -> Iterator[Piece]:
    """A character a line; annotations of bits and of other decoders are passed over."""
    for number, line in enumerate(lines, 1):
        match = _ANNOTATION.fullmatch(line)
        if match is not None:
            yield Piece(
                None, direction_in(f"{match['source']} {match['kind'] or ''}"), bytes.fromhex(match["value"])
            )
        elif line.strip():
            facts.pass_over("line", f"line {number}")
