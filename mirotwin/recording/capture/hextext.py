"""Characters written as hexadecimal digits: `55 55 ff 2d d4`, `0x55,0xff`, `5555ff2dd4`, comments after `#`.

UTF-8's byte-order mark, which some editors put first (and `cat` into the middle), separates and counts in no column.
"""

from __future__ import annotations

import re

from miro_exact.bad_input import BadInput

BOM = b"\xef\xbb\xbf"
_SEPARATORS = rb"(?:[\s,;:]|\xef\xbb\xbf)"
_PIECES = re.compile(rb"(?:" + _SEPARATORS + rb"|0[xX]|[0-9a-fA-F]{2}|#[^\n]*+)*+")
_NOT_DIGITS = re.compile(rb"#[^\n]*|0[xX]|" + _SEPARATORS)
_DIGIT = re.compile(rb"[0-9a-fA-F]")


class HexError(BadInput):
    """Text that is no pair of hex digits: path, line and column (from 1), reason, remedy."""

    def __init__(self, path: str, line: int, column: int, reason: str) -> None:
        remedy = "write two hex digits a character, or name another form with --from-form"
        super().__init__(path, (line, column), reason, remedy)


class HexText:
    """Takes text in pieces, cut anywhere; gives the bytes of each. HexError once all before it was given."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.line = 1
        self.column = 1
        self._rest = b""
        self._comment = False

    @staticmethod
    def begins(text: bytes, whole: bool) -> bool:
        """True if `text` holds at least one pair and nothing else but separators and comments.

        If it is not the `whole` text it may end in half a pair.
        """
        match = _PIECES.match(text)
        assert match is not None
        rest = text[match.end() :]
        complete = not rest or (not whole and len(rest) == 1 and _DIGIT.match(rest) is not None)
        return complete and bool(_NOT_DIGITS.sub(b"", match.group()))

    def feed(self, text: bytes) -> bytes:
        """The bytes of the pairs that are complete; an error waits until the next call."""
        if self._rest and not self._pending():
            self.finish()
        if self._comment:
            end = text.find(b"\n")
            self._advance(text if end < 0 else text[:end])
            if end < 0:
                return b""
            text, self._comment = text[end:], False
        text = self._rest + text
        match = _PIECES.match(text)
        assert match is not None
        done, self._rest = match.group(), text[match.end() :]
        self._advance(done)
        self._comment = not self._rest and done.rfind(b"#") > done.rfind(b"\n")
        return bytes.fromhex(_NOT_DIGITS.sub(b"", done).decode("ascii"))

    def finish(self) -> None:
        """Ends the text. Raises HexError if a part of a pair is left over."""
        if not self._rest:
            return
        shown = self._rest[:1].decode("ascii", "backslashreplace")
        alone = _DIGIT.match(self._rest) is not None
        reason = f"the digit {shown!r} stands alone" if alone else f"{shown!r} is no hex digit"
        raise HexError(self.path, self.line, self.column, reason)

    @property
    def failed(self) -> bool:
        """True if there is something that no more text can mend."""
        return bool(self._rest) and not self._pending()

    def _pending(self) -> bool:
        """True if the remaining text is the first half of a pair or comment."""
        return BOM.startswith(self._rest) or (len(self._rest) == 1 and _DIGIT.match(self._rest) is not None)

    def _advance(self, text: bytes) -> None:
        text = text.replace(BOM, b"")
        lines = text.count(b"\n")
        self.line += lines
        self.column = len(text) - text.rfind(b"\n") if lines else self.column + len(text)
