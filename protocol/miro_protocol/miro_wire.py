"""The robot's own wire format as a `Protocol`: what the host sends to a network of robots."""

from __future__ import annotations

from typing import Literal

from miro_protocol.decoder import Decoder
from miro_protocol.events import Damaged
from miro_protocol.frames import ServiceFrame, TeamFrame, encode, seal
from miro_protocol.protocol import Damage, Frame, Protocol
from miro_protocol.table import DEFAULT_ACCELERATION, SEQ_MODULUS, FrameType, downlink


class Miro(Protocol, frozen=True, tag="miro"):
    """Bodies are HDR and payload in clear, 1 + 4 N bytes; the sequence number stands in HDR."""

    robots: Literal[3, 5] = 3

    def encode(self, body: bytes) -> bytes:
        form = downlink(self.robots)
        if len(body) != form.body_size:
            raise ValueError(
                f"body of {len(body)} bytes: a network of {self.robots} robots has {form.body_size}"
            )
        return seal(form, body)

    def decode(self, wire: bytes) -> list[Frame | Damage]:
        decoder = Decoder(self.robots)
        items: list[Frame | Damage] = []
        at = 0
        for event in (*decoder.feed(wire), *decoder.flush()):
            end = at + len(event.data)
            if isinstance(event, Damaged):
                items.append(Damage(at, end, event.reason.name.lower().replace("_", " ")))
            else:
                items.append(Frame(event.body, at, end))
            at = end
        return items

    def repair(self, body: bytes, number: int | None = None) -> bytes:
        """Cuts or fills with zeros."""
        form = downlink(self.robots)
        whole = body[: form.body_size].ljust(form.body_size, b"\0")
        if number is not None:
            kind = whole[0] // SEQ_MODULUS
            whole = bytes([kind * SEQ_MODULUS + number % SEQ_MODULUS]) + whole[1:]
        return seal(form, whole)

    def samples(self) -> tuple[bytes, ...]:
        fast = tuple((4000 * (slot + 1), -4000 * (slot + 1)) for slot in range(self.robots))
        messages = (
            TeamFrame(FrameType.TEAM, 0, ((0, 0),) * self.robots),
            TeamFrame(FrameType.TEAM, 1, fast),
            TeamFrame(FrameType.TEAM_ASK, 2, fast),
            ServiceFrame.ping(3, 0),
            ServiceFrame.filter(4, 0, 100, 10, 1000, 50),
            ServiceFrame.acceleration(5, 0, DEFAULT_ACCELERATION),
        )
        events = Decoder(self.robots).feed(b"".join(encode(message, self.robots) for message in messages))
        return tuple(event.body for event in events if not isinstance(event, Damaged))
