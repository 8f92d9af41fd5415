"""Usual mistakes in CRC and whitening: how a frame looks to a robot that makes one of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from itertools import product, zip_longest

import msgspec
from crcmod import mkCrcFun

from miro_protocol.crc import INITIAL, POLYNOMIAL, POLYNOMIAL_REFLECTED, XOR_OUT
from miro_protocol.table import LAYOUT_TEAM, SYNC, TELEMETRY, Format
from miro_protocol.whitening import LENGTH, STRING, pn9


class Sealing(msgspec.Struct, frozen=True, kw_only=True):
    """A way to seal a frame. `layout`: None is the right byte, -1 leaves it out. `over_sent`: the CRC covers whitened
    bytes. `plain_crc`: it is not whitened itself.
    """

    polynomial: int = POLYNOMIAL
    start: int = INITIAL
    end: int = XOR_OUT
    reflected: bool = True
    layout: int | None = None
    high_first: bool = False
    over_sent: bool = False
    plain_crc: bool = False
    string: bytes = STRING
    sync: bytes = SYNC

    def seal(self, form: Format, body: bytes) -> bytes:
        """All characters of the frame around `body` (HDR and payload in clear)."""
        sent = self._whitened(body, 0)
        layout = form.layout if self.layout is None else self.layout
        covered = (b"" if layout < 0 else bytes([layout])) + (sent if self.over_sent else body)
        check = self._crc(covered).to_bytes(2, "big" if self.high_first else "little")
        return form.lead + self.sync + sent + (check if self.plain_crc else self._whitened(check, len(body)))

    def opened(self, form: Format, characters: bytes) -> bytes | None:
        """HDR and payload in clear of the characters from the sync on; None where this way does not seal so."""
        body = self._whitened(characters[len(form.sync) : -2], 0)
        return body if self.seal(form, body) == form.lead + characters else None

    def _whitened(self, data: bytes, place: int) -> bytes:
        string = self.string[place : place + len(data)]
        return bytes(first ^ other for first, other in zip_longest(data, string, fillvalue=0))

    def _crc(self, data: bytes) -> int:
        return _crc_of(self.polynomial, self.start, self.end, self.reflected)(data)


@cache
def _crc_of(polynomial: int, start: int, end: int, reflected: bool) -> Callable[[bytes], int]:
    return mkCrcFun(0x10000 | polynomial, start ^ end, reflected, end)


def _turned(value: int, bits: int) -> int:
    """The last bit first."""
    return int(f"{value:0{bits}b}"[::-1], 2)


_CRC: dict[str, dict[object, str]] = {
    "polynomial": {
        POLYNOMIAL: "",
        POLYNOMIAL_REFLECTED: "polynomial AC9Ah and not 5935h turned over",
        **{other: f"polynomial {other:04X}h" for other in (0x1021, 0x8005, 0x3D65)},
    },
    "reflected": {True: "", False: "the high bit first"},
    "start": {INITIAL: "", 0: "0000h and not FFFFh at the start"},
    "end": {XOR_OUT: "", 0: "no XOR with FFFFh at the end"},
    "layout": {None: "", -1: "no layout byte"},
    "high_first": {False: "", True: "high byte sent first"},
}
"""Usual mistakes in a CRC: a field of `Sealing`, and a name for each wrong value."""


def _checks() -> Iterator[tuple[str, Sealing]]:
    """Every mixture of them, those with one mistake first."""
    mixtures = [dict(zip(_CRC, values, strict=True)) for values in product(*_CRC.values())]
    mistakes = [[_CRC[key][value] for key, value in each.items() if _CRC[key][value]] for each in mixtures]
    for named, mixture in sorted(zip(mistakes, mixtures, strict=True), key=lambda pair: len(pair[0])):
        if named:
            yield f"another CRC ({', '.join(named)})", msgspec.convert(mixture, Sealing)


MISTAKES = {
    "no whitening": Sealing(string=b""),
    "whitening that begins with the second byte of its string": Sealing(string=STRING[1:]),
    "whitening that begins with the sync": Sealing(string=STRING[2:]),
    "whitening with the high bit of each byte first": Sealing(
        string=bytes(_turned(byte, 8) for byte in STRING)
    ),
    "whitening that repeats its first byte FFh": Sealing(string=STRING[:1] * LENGTH),
    "whitening with x^9 + x^4 + 1": Sealing(string=pn9(LENGTH, tap=4)),
    **{
        f"whitening that begins with register {seed:03X}h and not 1FFh": Sealing(string=pn9(LENGTH, seed))
        for seed in (0x001, 0x100, 0x0FF, 0x1FE, 0x055, 0x0AA, 0x155, 0x1AA)
    },
    **{
        f"sync {sync.hex(' ').upper()}": Sealing(sync=sync)
        for sync in (b"\xd4\x2d", b"\x2d\x2d", b"\xd4\xd4")
    },
    **{
        f"a CRC that begins with layout byte {byte:02X}h": Sealing(layout=byte)
        for byte in (TELEMETRY.layout, LAYOUT_TEAM, LAYOUT_TEAM | 3, LAYOUT_TEAM | 5, 3, 5)
    },
    "a CRC that covers the whitened bytes": Sealing(over_sent=True),
    "a CRC that covers the whitened bytes and is not whitened": Sealing(over_sent=True, plain_crc=True),
    "a CRC that is not whitened": Sealing(plain_crc=True),
    **dict(_checks()),
}
"""Mistake, in words that follow `a frame with ..`, -> how to seal such a frame.

Whitening first: a robot that accepts a wrong HDR refuses the following numbers.
"""


def mistake_in(form: Format, characters: bytes, begins: int) -> str:
    """The mistake with which these characters, from the sync on, are a frame with the HDR `begins`; "" if none fits."""
    for mistake, sealing in MISTAKES.items():
        body = sealing.opened(form, characters)
        if body is not None and body[0] == begins:
            return mistake
    return ""
