"""Modbus RTU for fuzzers, and a check of what the module answers: docs/howto/own-protocol.md uses them."""

from typing import ClassVar

from miro_protocol.protocol import Damage, Frame, Protocol
from mirotwin.verify.checks.interface import Check
from mirotwin.verify.checks.serial import SerialMonitor


def sealed(body):
    """`body` with its CRC."""
    crc = 0xFFFF
    for value in body:
        crc ^= value
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return body + crc.to_bytes(2, "little")


class Modbus(Protocol, frozen=True, tag="modbus"):
    """Bodies are an address, a function and its data. Frames end in silence, so characters in a row are one."""

    def encode(self, body):
        if not 2 <= len(body) <= 254:
            raise ValueError("a body has 2 to 254 bytes")
        return sealed(body)

    def repair(self, body, number=None):
        return sealed(body[:254].ljust(2, b"\0"))

    def decode(self, wire):
        return [Frame(wire[:-2], 0, len(wire)) if good(wire) else Damage(0, len(wire), "bad CRC")]

    def samples(self):
        return tuple(map(bytes.fromhex, ("010500020000", "010100000008", "010300000002", "010600010060")))


class ModbusRules(Check, frozen=True, kw_only=True, tag="modbus_rules"):
    """Good frames to the module are answered, and nothing else is. Frames before 20 ms of silence are not judged."""

    KIND: ClassVar[str] = "safety"
    SUBJECTS: ClassVar[tuple[str, ...]] = ("board",)

    address: int = 1

    def monitor(self, subject):
        return ModbusMonitor(self, subject)


class ModbusMonitor(SerialMonitor[ModbusRules]):
    def frames(self):
        """Frames: whether 20 ms of silence came before, and the characters. A pause of 5 ms ends a frame."""
        ms = self.subject.clock // 1000
        frames, last = [], -20 * ms
        for character in self.received:
            if not frames or character.tick - last > 5 * ms:
                frames.append((character.tick - last > 20 * ms, []))
            frames[-1][1].append(character)
            last = character.tick
        return frames

    def end(self, tick):
        frames, address = self.frames(), self.check.address
        ends = [*(characters[0].tick for _, characters in frames[1:]), tick]
        for (quiet, characters), until in zip(frames, ends, strict=False):
            last = characters[-1].tick
            request = bytes(character.value for character in characters)
            answer = bytes(character.value for character in self.sent if last < character.tick < until)
            if quiet and self.reset_tick is None:
                self.judge(address, request, answer, last)
            if good(request) and request[1:5] == b"\x06\0\0\0" and request[0] in (0, address):
                address = request[5] if 1 <= request[5] <= 247 else address  # register 0 is the address

    def judge(self, address, request, answer, last):
        self.judged += 1
        if good(request) and request[0] == address:
            wanted, right = "an answer", good(answer) and answer[0] == address and fits(request[1], answer)
        else:
            wanted, right = "no answer", not answer
        if not right:
            self.fail(last, f"{wanted} to {request.hex(' ')}", answer.hex(" ") or "none")


def good(frame):
    return 4 <= len(frame) <= 256 and sealed(frame[:-2]) == frame


def fits(function, answer):
    """Whether it answers this function: by itself, or by exception 1 to 4."""
    return answer[1] == function or (answer[1] == function | 0x80 and answer[2] in (1, 2, 3, 4))
