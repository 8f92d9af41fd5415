"""Reads pcapng and pcap captures of serial lines, our own and other people's.

Packets are those of link type 250 (RTAC serial), or of 147 to 162 (private use), which are taken for characters as they
are: pcapng may say their direction, pcap does not.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO

from miro_exact.bad_input import BadInput, amount
from miro_protocol.pcapng import (
    BYTE_ORDER,
    ENHANCED,
    EPB_FLAGS,
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
_OLD_PACKETS = {2: "in obsolete blocks", 3: "in simple blocks, without a time"}
PRIVATE = range(147, 163)  # link types
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
_PCAP_HEAD, _PCAP_PACKET = "IHHiIII", "IIII"
_NANOSECONDS = 0xA1B23C4D
_FLAG_DIRECTIONS = {1: UP, 2: DOWN}  # inbound, outbound


class CaptureError(BadInput):
    """A capture that cannot be read on: file, offset of the block, the reason, and what to do about it."""

    def __init__(self, source: str, offset: int, reason: str, remedy: str) -> None:
        super().__init__(source, f"offset {offset}", reason, remedy)
        self.offset = offset


def iterate(
    data: bytes | Callable[[int], bytes], source: str = "<capture>", passed_over: Counter[str] | None = None
) -> Iterator[Transmission]:
    """Reads packet by packet; CaptureError at the first place that makes no sense, after all before it.

    From bytes, or by the `read` of a file or a pipe, of which one block at a time is kept. Captures by others are
    read too: both byte orders, any time resolution, several sections. `network` is the number of the interface among
    those of serial lines in its section. `direction` is "" where the capture does not say. Packets of other events than
    characters sent or received and of other links are passed over; `passed_over` counts them by what they are, see
    `events_line`. A capture that holds no other packets than those of other links ends in a CaptureError.
    """
    return _only_serial(_BlockReader, data, source, passed_over)


def iterate_pcap(
    data: bytes | Callable[[int], bytes], source: str = "<capture>", passed_over: Counter[str] | None = None
) -> Iterator[Transmission]:
    """Like `iterate`, for a capture in the old pcap format, with times in micro- or nanoseconds."""
    return _only_serial(_PcapReader, data, source, passed_over)


def _only_serial(
    kind: type[_BlockReader] | type[_PcapReader],
    data: bytes | Callable[[int], bytes],
    source: str,
    passed_over: Counter[str] | None,
) -> Iterator[Transmission]:
    passed_over = Counter() if passed_over is None else passed_over
    reader = kind(BytesIO(data).read if isinstance(data, bytes) else data, source, passed_over)
    empty = True
    for packet in reader.packets():
        empty = False
        yield packet
    links = [name for name in passed_over if name.startswith("of link type")]
    if empty and links:
        count = amount(sum(passed_over[name] for name in links), "packet")
        reason = f"no packet of a serial line, but {count} {links[0]}"
        raise CaptureError(source, 0, reason, f"give a capture of a serial line (link type {LINK_TYPE})")


def events_line(passed_over: Counter[str]) -> str:
    """For people: how many packets were passed over, and what they were."""
    kinds = [f"{count} {name}" for name, count in passed_over.most_common(MOST_EVENTS)]
    total = passed_over.total()
    if rest := total - sum(count for _, count in passed_over.most_common(MOST_EVENTS)):
        kinds.append(f"{rest} more")
    return f"passed over {amount(total, 'packet')} other than data sent or received: {', '.join(kinds)}"


def _characters(
    link_type: int, packet: bytes, direction: str, passed_over: Counter[str]
) -> tuple[str, bytes] | None:
    """Direction and characters of a packet; None for another one, which is counted. Raises ValueError."""
    if link_type in PRIVATE:
        return (direction, packet) if packet else None
    if link_type != LINK_TYPE:
        passed_over[f"of link type {link_type}"] += 1
        return None
    if len(packet) < RTAC.size:
        raise ValueError("packet without RTAC header")
    event = RTAC.unpack_from(packet)[2]
    if event not in _DIRECTIONS:
        passed_over[_OTHER_EVENTS.get(event, f"of unknown event type {event:02x}h")] += 1
        return None
    data = packet[RTAC.size :]
    return (_DIRECTIONS[event], data) if data else None


@dataclass(frozen=True, slots=True)
class _Interface:
    link_type: int
    units: int  # of time, a second
    offset: int  # seconds
    number: int  # among those of serial lines


class _BlockReader:
    def __init__(self, read: Callable[[int], bytes], source: str, passed_over: Counter[str]) -> None:
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
                self.passed_over[_OLD_PACKETS[kind]] += 1
            self.offset += len(body) + 12

    def error(self, reason: str, remedy: str) -> CaptureError:
        return CaptureError(self.source, self.offset, reason, remedy)

    def cut(self) -> CaptureError:
        return self.error(
            "the file ends in the middle of a block", "it was cut short; capture or copy it again"
        )

    def malformed(self, problem: str) -> CaptureError:
        return self.error(f"damaged block: {problem}", "copy the file again")

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
        number = sum(_is_serial(interface.link_type) for interface in self.interfaces)
        return _Interface(link_type, units, struct.unpack(self.order + "q", offset)[0], number)

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
        if size > len(body) - 20:
            raise self.malformed("packet beyond the end of its block")
        if size < original and _is_serial(interface.link_type):
            raise self.error(
                f"only {size} of {original} bytes were captured", "capture without a snap length"
            )
        direction = ""
        if interface.link_type in PRIVATE:
            options = dict(self._options(body[20 + size + -size % 4 :]))
            flags = options.get(EPB_FLAGS, b"")
            if len(flags) == 4:
                direction = _FLAG_DIRECTIONS.get(struct.unpack(self.order + "I", flags)[0] & 3, "")
        try:
            characters = _characters(interface.link_type, body[20 : 20 + size], direction, self.passed_over)
        except ValueError as error:
            raise self.malformed(f"{error}") from None
        if characters is None:
            return None
        tick = -(-(high << 32 | low) * TICKS_PER_SECOND // interface.units)
        tick += interface.offset * TICKS_PER_SECOND
        if not 0 <= tick <= MAX_TICK:
            raise self.malformed(f"tick {tick} is not in 0..{MAX_TICK}")
        return Transmission(tick, *characters, interface.number)


class _PcapReader:
    def __init__(self, read: Callable[[int], bytes], source: str, passed_over: Counter[str]) -> None:
        self.read = read
        self.source = source
        self.passed_over = passed_over
        self.offset = 0

    def packets(self) -> Iterator[Transmission]:
        head = self.read(24)
        if head[:4] not in CLASSIC_PCAP:
            raise self.error("not a pcap file", "give a capture that was saved as pcap or pcapng")
        order = "<" if head[:4] in CLASSIC_PCAP[::2] else ">"
        if len(head) < 24:
            raise self.cut()
        magic, *_, link_type = struct.unpack(order + _PCAP_HEAD, head)
        link_type &= 0xFFFF  # above it stands the length of a check sum
        units = 10**9 if magic == _NANOSECONDS else 10**6
        self.offset = 24
        while head := self.read(16):
            if len(head) < 16:
                raise self.cut()
            seconds, part, size, original = struct.unpack(order + _PCAP_PACKET, head)
            if size > MAX_BLOCK:
                raise self.error(f"damaged packet: length {size}", "copy the file again")
            packet = self.read(size)
            if len(packet) < size:
                raise self.cut()
            if size < original and _is_serial(link_type):
                raise self.error(
                    f"only {size} of {original} bytes were captured", "capture without a snap length"
                )
            try:
                characters = _characters(link_type, packet, "", self.passed_over)
            except ValueError as error:
                raise self.error(f"damaged packet: {error}", "copy the file again") from None
            if characters is not None:
                tick = -(-(seconds * units + part) * TICKS_PER_SECOND // units)
                yield Transmission(tick, *characters)
            self.offset += 16 + size

    def error(self, reason: str, remedy: str) -> CaptureError:
        return CaptureError(self.source, self.offset, reason, remedy)

    def cut(self) -> CaptureError:
        return self.error(
            "the file ends in the middle of a packet", "it was cut short; capture or copy it again"
        )


def _is_serial(link_type: int) -> bool:
    return link_type == LINK_TYPE or link_type in PRIVATE


def _foreign(head: bytes) -> tuple[str, str]:
    """The kind of a file with this beginning, and a remedy."""
    if not head:
        return "empty file", "give a pcapng capture"
    if head[:4] in CLASSIC_PCAP:
        return "a capture in the old pcap format", "read it as pcap"
    return "not a pcapng file", "give a capture that was saved as pcapng"
