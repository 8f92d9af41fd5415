"""Values as text: numbers in the bases of gdb's letters, bytes of a text as a text."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from miro_exact.bad_input import BadInput
from mirotwin.debug.expression import NoValue, Value, children, content, pointed

FORMS = {
    "x": "hexadecimal", "d": "decimal", "u": "unsigned", "o": "octal", "t": "binary", "c": "character", "a": "address",
    "s": "text", "i": "instruction",
}  # fmt: skip
_LONGEST_TEXT = 200
_SHORTEST_TEXT = 2


def lines_of(name: str, value: Value, form: str = "") -> Iterator[str]:
    """A value as text: groups a line a member. Raises NoValue for a form that is none."""
    if value.members is None:
        note = f"   ({value.note})" if value.note else ""
        yield f"{name} = {shown(value, form)}{note}"
    else:
        for part, get in children(value):
            yield from lines_of(f"{name}.{part}", get(), form)


def shown(value: Value, form: str = "") -> str:
    """The content of a value as text: the bytes of a string as a string; `form`: the format letter."""
    if form not in ("", *FORMS) or form == "i":
        raise NoValue(f"/{form} is no form", f"give one of {', '.join(FORMS)}")
    text = text_in(value, always=form == "s")
    whole = content(value)
    if form not in ("", "s"):
        return in_form(whole, form, _size(value, whole))
    if text is None:
        return quoted(whole) if isinstance(whole, str) else shown_value(whole)
    return f"{shown_value(whole)} {quoted(text)}" if isinstance(whole, int) else quoted(text)


def shown_value(whole: Any) -> str:
    """A number as one reads it: small ones alone, larger ones in hex too."""
    if isinstance(whole, bool) or not isinstance(whole, int) or -10 < whole < 10:
        return str(whole)
    return f"{whole} ({whole:#x})"


def in_form(whole: Any, form: str, size: int) -> str:
    """A number of `size` bytes, or each of a list or of a group."""
    if isinstance(whole, list):
        return f"[{', '.join(in_form(part, form, size) for part in whole)}]"
    if isinstance(whole, dict):
        return f"{{{', '.join(f'{name}: {in_form(part, form, size)}' for name, part in whole.items())}}}"
    if not isinstance(whole, int):
        return str(whole)
    bits = whole & (1 << 8 * size) - 1
    if form == "c":
        return f"{whole} {chr(bits & 0xFF)!r}"
    if form == "d":
        return str(bits - (1 << 8 * size) if bits >> 8 * size - 1 else bits)
    return {"u": f"{bits}", "o": f"{bits:#o}", "t": f"0b{bits:0{8 * size}b}"}.get(
        form, f"{bits:#0{2 + 2 * size}x}"
    )


def quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def text_in(value: Value, always: bool = False) -> str | None:
    """The text in an array of bytes, or where a pointer to bytes points; None where the bytes do not look like one."""
    kind = value.kind
    if kind is None or kind.element is None or (kind.element.kind, kind.element.size) != ("int", 1):
        return None
    if kind.kind == "array":
        return as_text(bytes(byte & 0xFF for byte in content(value)), always)
    with suppress(BadInput):
        return text_at(pointed(value, 0, "it"), always)
    return None


def text_at(value: Value, always: bool = True) -> str | None:
    """The text from a byte on, up to its NUL."""
    data = bytearray()
    with suppress(BadInput):  # the memory ends there
        while value.moment is not None and len(data) < _LONGEST_TEXT and data[-1:] != b"\0":
            data += value.moment.read(value.space, value.address + len(data), 1)
    return as_text(bytes(data), always)


def as_text(data: bytes, always: bool) -> str | None:
    """Up to the first NUL. `always`: whatever the bytes are; else two or more that can be read, then only NUL."""
    text, _, rest = data.partition(b"\0")
    readable = all(0x20 <= byte < 0x7F or byte in b"\t\r\n" for byte in text)
    if always or (len(text) >= _SHORTEST_TEXT and readable and not rest.strip(b"\0")):
        return text.decode("latin-1")
    return None


def _size(value: Value, whole: Any) -> int:
    """Size of a number, or of the elements of a value, in bytes; without a type as many bytes as the number needs."""
    kind = value.kind
    while kind is not None and kind.kind == "array" and kind.element is not None:
        kind = kind.element
    if kind is not None:
        return kind.size
    return 4 if not isinstance(whole, int) or whole < 0 else max(1, (whole.bit_length() + 7) // 8)
