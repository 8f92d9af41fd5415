"""Transmissions as a capture that Wireshark opens: pcapng, link type 250 (RTAC serial).

One packet is one transmission; one interface is one radio network. A packet has
the 12-byte RTAC header (tcpdump.org/linktypes/LINKTYPE_RTAC_SERIAL.html), big-endian: seconds,
microseconds, event type, control lines, footer. Event type DATA_TX_START is host to robot, DATA_RX_START
robot to host, as a capture on the PC's port would have it; EPB flags say the same. Times are ticks in
nanoseconds, rounded down, from which the tick comes back exactly; tick 0 is shown as 1970-01-01. Nothing
else goes in, so the same transmissions are the same bytes. A capture does not hold stop bits: `bad_stop` is lost.

Written by hand: three kinds of block (draft-ietf-opsawg-pcapng, section 4) are less than a dependency.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator

from miro_protocol.table import TICKS_PER_MS
from miro_protocol.transmission import DIRECTIONS, DOWN, UP, Transmission

LINK_TYPE = 250
BAUD = 9600

SECTION, INTERFACE, ENHANCED = 0x0A0D0D0A, 1, 6  # kinds of block
BYTE_ORDER = 0x1A2B3C4D
IF_NAME, IF_SPEED, IF_TSRESOL, IF_TSOFFSET = 2, 8, 9, 14  # options
EPB_FLAGS = 2
NANOSECONDS = 9  # exponent of if_tsresol
RTAC = struct.Struct(">IIBBH")
EVENTS = {DOWN: 1, UP: 2}  # DATA_TX_START, DATA_RX_START
FLAGS = {DOWN: 2, UP: 1}  # outbound, inbound
TICKS_PER_SECOND = 1000 * TICKS_PER_MS

MAX_TICK = (1 << 32) * TICKS_PER_SECOND - 1  # the RTAC header has 32 bits for seconds
MAX_NETWORK = 0xFFFF
MAX_DATA = 0x40000 - RTAC.size  # Wireshark refuses packets of more than 262 144 bytes


def render(packets: Iterable[Transmission]) -> bytes:
    """The whole file; ValueError naming field, value and limits when a packet cannot be written."""
    return b"".join(blocks(packets))


def blocks(packets: Iterable[Transmission]) -> Iterator[bytes]:
    """The file block by block."""
    yield _block(SECTION, struct.pack("<IHHq", BYTE_ORDER, 1, 0, -1))
    interfaces = 0
    for packet in packets:
        _check(packet)
        while interfaces <= packet.network:
            yield _interface(interfaces)
            interfaces += 1
        yield _packet(packet)


def _check(packet: Transmission) -> None:
    if not 0 <= packet.tick <= MAX_TICK:
        raise ValueError(f"tick = {packet.tick}: must be 0..{MAX_TICK}")
    if packet.direction not in DIRECTIONS:
        raise ValueError(f"direction = {packet.direction!r}: must be {DOWN!r} or {UP!r}")
    if not 0 <= packet.network <= MAX_NETWORK:
        raise ValueError(f"network = {packet.network}: must be 0..{MAX_NETWORK}")
    if not 1 <= len(packet.data) <= MAX_DATA:
        raise ValueError(f"data of {len(packet.data)} characters: a packet has 1..{MAX_DATA}")


def _block(kind: int, body: bytes) -> bytes:
    size = len(body) + 12
    return struct.pack("<II", kind, size) + body + struct.pack("<I", size)


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


def _option(code: int, value: bytes) -> bytes:
    return struct.pack("<HH", code, len(value)) + _padded(value)


def _interface(number: int) -> bytes:
    options = (
        _option(IF_NAME, f"network {number}".encode()),
        _option(IF_SPEED, struct.pack("<Q", BAUD)),
        _option(IF_TSRESOL, bytes([NANOSECONDS])),
        _option(0, b""),
    )
    return _block(INTERFACE, struct.pack("<HHI", LINK_TYPE, 0, 0) + b"".join(options))


def _packet(packet: Transmission) -> bytes:
    time = packet.tick * 125 // 3
    seconds, rest = divmod(time, 10**9)
    data = RTAC.pack(seconds, rest // 1000, EVENTS[packet.direction], 0, 0) + packet.data
    head = struct.pack("<IIIII", packet.network, time >> 32, time & 0xFFFF_FFFF, len(data), len(data))
    options = _option(EPB_FLAGS, struct.pack("<I", FLAGS[packet.direction])) + _option(0, b"")
    return _block(ENHANCED, head + _padded(data) + options)
