"""The frames of Modbus RTU: a body and its CRC, low byte first ("Modbus over Serial Line", V1.02, 2.5.1)."""

from __future__ import annotations

from miro_protocol.protocol import Damage, Frame, Protocol


def crc(data: bytes) -> bytes:
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ 0xA001 if value & 1 else value >> 1
    return value.to_bytes(2, "little")


class ModbusRtu(Protocol, frozen=True, tag="modbus_rtu"):
    """A frame is what comes without a pause."""

    def encode(self, body: bytes) -> bytes:
        return body + crc(body)

    def repair(self, body: bytes, number: int | None = None) -> bytes:
        return self.encode(bytes(body))

    def decode(self, wire: bytes) -> list[Frame | Damage]:
        body, end = wire[:-2], len(wire)
        if len(wire) > 2 and crc(body) == wire[-2:]:
            return [Frame(body, 0, end)]
        return [Damage(0, end, "bad CRC")] if wire else []

    def samples(self) -> list[bytes]:
        return [bytes.fromhex("01 03 00 00 00 01"), bytes.fromhex("01 05 00 00 ff 00")]
