"""SLIP frames (RFC 1055) with a Fletcher-16 behind the body, as a wire format for `mirotwin fuzz`."""

from miro_protocol.protocol import Damage, Frame, Protocol

END, ESC, ESC_END, ESC_ESC = 0xC0, 0xDB, 0xDC, 0xDD
_ESCAPED = {END: bytes([ESC, ESC_END]), ESC: bytes([ESC, ESC_ESC])}
_MEANS = {ESC_END: END, ESC_ESC: ESC}


def fletcher16(data: bytes) -> bytes:
    """Both sums modulo 255, low one first."""
    low = high = 0
    for value in data:
        low = (low + value) % 255
        high = (high + low) % 255
    return bytes([low, high])


class Slip(Protocol, frozen=True, tag="slip"):
    """Bodies of one byte or more. Frames begin and end with END, so that garbage before one is no part of it."""

    def encode(self, body: bytes) -> bytes:
        if not body:
            raise ValueError("the body is empty: a frame has at least a command")
        inner = b"".join(_ESCAPED.get(value, bytes([value])) for value in body + fletcher16(body))
        return bytes([END]) + inner + bytes([END])

    def repair(self, body: bytes, number: int | None = None) -> bytes:
        """There is no sequence number."""
        return self.encode(body or b"\0")

    def decode(self, wire: bytes) -> list[Frame | Damage]:
        """END is the end of what came before it; an empty frame is none, and its END belongs to what follows."""
        found: list[Frame | Damage] = []
        start, inner, escaped = 0, bytearray(), False
        for at, value in enumerate(wire):
            if value == END:
                if inner or escaped:
                    found.append(_judged(bytes(inner), escaped, start, at + 1))
                    start = at + 1
                inner, escaped = bytearray(), False
            elif escaped:
                inner.append(_MEANS.get(value, value))
                escaped = False
            elif value == ESC:
                escaped = True
            else:
                inner.append(value)
        if start < len(wire):
            found.append(Damage(start, len(wire), "no end"))
        return found

    def samples(self) -> tuple[bytes, ...]:
        return (b"\x01\x00\x32", b"\x01\x02\x00", b"\x02\x01", b"\x03lamp", b"\x04")


def _judged(inner: bytes, escaped: bool, start: int, end: int) -> Frame | Damage:
    if escaped:
        return Damage(start, end, "escape before the end")
    if len(inner) < 3:
        return Damage(start, end, "too short")
    if fletcher16(inner[:-2]) != inner[-2:]:
        return Damage(start, end, "bad checksum")
    return Frame(inner[:-2], start, end)
