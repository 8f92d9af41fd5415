"""Reads pcapng captures of serial lines (link type 250), our own and other people's."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO

from miro_exact.bad_input import BadInput
from miro_protocol.pcapng import (
    BYTE_ORDER,
    ENHANCED,
    IF_TSOFFSET,
    IF_TSRESOL,
    INTERFACE,
    LINK_TYPE,
    MAX_TICK,
    RTAC,
    SECTION,
    TICKS_PER_SECOND,
)
from miro_protocol.transmission import DOWN, UP, Transmission

MAGIC = b"\x0a\x0d\x0d\x0a"
MAX_BLOCK = 64 << 20  # a longer block is no packet of a serial line: its length is damaged
CLASSIC_PCAP = (b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x4d\x3c\xb2\xa1", b"\xa1\xb2\x3c\x4d")
_HEAD = 12  # kind, length, and what may be a section's byte order mark
_OLD_PACKETS = {2: "obsolete packet", 3: "simple packet"}
_DIRECTIONS = {1: DOWN, 2: UP, 3: DOWN, 4: UP}  # DATA_TX_START, _RX_START, _TX_END, _RX_END
_OTHER_EVENTS = {
    0: "STATUS_CHANGE",
    5: "CAPTURE_DATA_LOST",
    6: "CAPTURE_COMPLETE",
    7: "FRAMING_ERROR",
    8: "PARITY_ERROR",
    9: "SERIAL_BREAK_EVENT",
    10: "SERIAL_OVERFLOW_EVENT",
}
MOST_EVENTS = 4  # that are named


class CaptureError(BadInput):
    """A capture that cannot be read on: file, offset of the block, the reason, and what to do about it."""

    def __init__(self, source: str, offset: int, reason: str, remedy: str) -> None:
        super().__init__(source, f"offset {offset}", reason, remedy)
        self.offset = offset


def iterate(
    data: bytes | Callable[[int], bytes], source: str = "<capture>", passed_over: Counter[int] | None = None
) -> Iterator[Transmission]:
    """Reads packet by packet; CaptureError at the first place that makes no sense, after all before it.

    From bytes, or by the `read` of a file or a pipe, of which one block at a time is kept. Captures by others are
    read too: both byte orders, any time resolution, several sections. `network` is the interface's number in its
    section. Packets of other events than characters sent or received are passed over; `passed_over` counts them by
    event type, see `events_line`.
    """
    read = BytesIO(data).read if isinstance(data, bytes) else data
    return _BlockReader(read, source, Counter() if passed_over is None else passed_over).packets()


def events_line(passed_over: Counter[int]) -> str:
    """For people: how many packets were passed over, and what they were."""
    kinds = [
        f"{count} {_OTHER_EVENTS.get(event, f'of unknown event type {event:02x}h')}"
        for event, count in passed_over.most_common(MOST_EVENTS)
    ]
    total = passed_over.total()
    if rest := total - sum(count for _, count in passed_over.most_common(MOST_EVENTS)):
        kinds.append(f"{rest} more")
    packets = f"{total} packet{'s' if total > 1 else ''}"
    return f"passed over {packets} of other events than data sent or received: {', '.join(kinds)}"


@dataclass(frozen=True, slots=True)
class _Interface:
    link_type: int
    units: int  # of time, a second
    offset: int  # seconds


class _BlockReader:
    def __init__(self, read: Callable[[int], bytes], source: str, passed_over: Counter[int]) -> None:
        self.read = read
        self.source = source
        self.passed_over = passed_over
        self.offset = 0  # of the block under way
        self.order = "<"
        self.interfaces: list[_Interface] = []

    def packets(self) -> Iterator[Transmission]:
        while (head := self.read(_HEAD)) or self.offset == 0:
            kind, body = self._block(head)
            if kind == SECTION:
                self._section(body)
                self.interfaces = []
            elif kind == INTERFACE:
                self.interfaces.append(self._interface(body))
            elif kind == ENHANCED:
                packet = self._enhanced(body)
                if packet is not None:
                    yield packet
            elif kind in _OLD_PACKETS:
                reason = f"{_OLD_PACKETS[kind]} block, which this program does not read"
                raise self.error(reason, "save the capture again with Wireshark")
            self.offset += len(body) + 12

    def error(self, reason: str, remedy: str) -> CaptureError:
        return CaptureError(self.source, self.offset, reason, remedy)

    def cut(self) -> CaptureError:
        return self.error(
            "the file ends in the middle of a block", "it was cut short; capture or copy it again"
        )

    def malformed(self, what: str) -> CaptureError:
        return self.error(f"damaged block: {what}", "copy the file again")

    def _block(self, head: bytes) -> tuple[int, bytes]:
        """Kind and body of the block at `offset` which begins with `head`, its lengths checked."""
        if self.offset == 0 and not head.startswith(MAGIC):
            raise self.error(*_foreign(head))
        if len(head) < _HEAD:
            raise self.cut()
        if head.startswith(MAGIC):
            self._byte_order(head[8:])
        kind, size = struct.unpack_from(self.order + "II", head)
        if size < 12 or size % 4 or size > MAX_BLOCK:
            raise self.malformed(f"length {size}")
        block = head + self.read(size - _HEAD)
        if len(block) < size:
            raise self.cut()
        (again,) = struct.unpack_from(self.order + "I", block, size - 4)
        if again != size:
            raise self.malformed(f"lengths {size} and {again} differ")
        return kind, block[8:-4]

    def _byte_order(self, mark: bytes) -> None:
        for order in "<>":
            if struct.unpack(order + "I", mark) == (BYTE_ORDER,):
                self.order = order
                return
        raise self.malformed(f"byte order mark {mark.hex()}")

    def _section(self, body: bytes) -> None:
        if len(body) < 8:
            raise self.malformed("section header too short")
        (major,) = struct.unpack_from(self.order + "H", body, 4)
        if major != 1:
            raise self.error(f"pcapng version {major}", "this program reads version 1")

    def _interface(self, body: bytes) -> _Interface:
        if len(body) < 8:
            raise self.malformed("interface description too short")
        (link_type,) = struct.unpack_from(self.order + "H", body)
        options = dict(self._options(body[8:]))
        resolution = options.get(IF_TSRESOL, b"\6")[:1] or b"\6"
        units = 1
        for _ in range(resolution[0] & 0x7F):
            units *= 2 if resolution[0] & 0x80 else 10
        offset = options.get(IF_TSOFFSET, bytes(8))
        if len(offset) != 8:
            raise self.malformed("time offset of wrong length")
        return _Interface(link_type, units, struct.unpack(self.order + "q", offset)[0])

    def _options(self, data: bytes) -> Iterator[tuple[int, bytes]]:
        offset = 0
        while offset + 4 <= len(data):
            code, size = struct.unpack_from(self.order + "HH", data, offset)
            if code == 0:
                return
            if offset + 4 + size > len(data):
                raise self.malformed("option beyond the end of its block")
            yield code, data[offset + 4 : offset + 4 + size]
            offset += 4 + size + -size % 4

    def _enhanced(self, body: bytes) -> Transmission | None:
        """The packet, or None when it carries no characters."""
        if len(body) < 20:
            raise self.malformed("packet block too short")
        number, high, low, size, original = struct.unpack_from(self.order + "IIIII", body)
        if number >= len(self.interfaces):
            raise self.malformed(f"interface {number} was not described")
        interface = self.interfaces[number]
        if interface.link_type != LINK_TYPE:
            reason = f"link type {interface.link_type}, not {LINK_TYPE} (RTAC serial)"
            raise self.error(reason, "give a capture of a serial line")
        if size > len(body) - 20:
            raise self.malformed("packet beyond the end of its block")
        if size < original:
            raise self.error(
                f"only {size} of {original} bytes were captured", "capture without a snap length"
            )
        if size < RTAC.size:
            raise self.malformed("packet without RTAC header")
        event = RTAC.unpack_from(body, 20)[2]
        data = body[20 + RTAC.size : 20 + size]
        if event not in _DIRECTIONS:
            self.passed_over[event] += 1
            return None
        if not data:
            return None
        tick = -(-(high << 32 | low) * TICKS_PER_SECOND // interface.units)
        tick += interface.offset * TICKS_PER_SECOND
        if not 0 <= tick <= MAX_TICK:
            raise self.malformed(f"tick {tick} is not in 0..{MAX_TICK}")
        return Transmission(tick, _DIRECTIONS[event], data, number)


def _foreign(head: bytes) -> tuple[str, str]:
    """What a file that begins so is, and what to do about it."""
    if not head:
        return "empty file", "give a pcapng capture"
    if head[:4] in CLASSIC_PCAP:
        return "a capture in the old pcap format", "convert it with `editcap -F pcapng OLD NEW`"
    return "not a pcapng file", "give a capture that was saved as pcapng"
