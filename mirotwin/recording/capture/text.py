"""Text of other programs as lines, in pieces: UTF-8, UTF-16, CP936 or CP1252, ended by LF, CR LF or CR."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator

from miro_exact.inputs import encoding_of
from mirotwin.recording.capture.input import HEAD_BYTES, Input

LINE_CHARACTERS = 1 << 20
"""A longer line is cut."""
_CONTROL = re.compile(r"[\0-\x08\x0e-\x19\x1b-\x1f\x7f]")


def text_of(head: bytes, whole: bool) -> str:
    """`head` as text, without an incomplete last character if it is not the `whole` file."""
    encoding, mark = _encoding(head, whole)
    return codecs.getincrementaldecoder(encoding)("replace").decode(head[mark:])


def is_text(head: bytes, whole: bool) -> bool:
    """True if these bytes are surely text: UTF-8 or marked UTF-16 without control characters."""
    encoding, mark = _encoding(head, whole)
    text = text_of(head, whole)
    known = encoding == "utf-8" or encoding.startswith("utf-16")
    return known and len(head) > mark and not _CONTROL.search(text) and "\ufffd" not in text


def head_lines(head: bytes, whole: bool) -> list[str]:
    """The lines of a beginning; without the last one, which may be cut, if it is not the `whole` file."""
    lines = re.split(r"\r\n|\n|\r", text_of(head, whole))
    return lines if whole or len(lines) == 1 else lines[:-1]


def lines_of(given: Input) -> Iterator[str]:
    """The lines, without their ends."""
    head = given.peek()
    encoding, mark = _encoding(head, len(head) < HEAD_BYTES)
    given.read(mark)
    decoder = codecs.getincrementaldecoder(encoding)("replace")
    rest = ""
    while data := given.read_some():
        text = rest + decoder.decode(data)
        held = "\r" if text.endswith("\r") else ""  # the LF of this end may be in the next piece
        text = text.removesuffix("\r").replace("\r\n", "\n").replace("\r", "\n")
        *lines, rest = text.split("\n")
        yield from lines
        if len(rest) > LINE_CHARACTERS:
            yield rest
            rest = ""
        rest += held
    yield from (rest + decoder.decode(b"", True)).replace("\r", "\n").split("\n")


def _encoding(head: bytes, whole: bool) -> tuple[str, int]:
    """The encoding, and the length of its byte-order mark; UTF-16 is also detected by the zeros between ASCII
    characters.
    """
    sample = head[: len(head) & ~1]
    for first, encoding in ((0, "utf-16-be"), (1, "utf-16-le")):
        if len(sample) >= 4 and not any(sample[first::2]) and all(sample[1 - first :: 2]):
            return encoding, 0
    return encoding_of(head, whole)
