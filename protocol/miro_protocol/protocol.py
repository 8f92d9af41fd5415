"""A wire format as fuzzers need it: bodies become frames, characters become frames and damage, and back.

A body is what a frame carries, without all that can be computed: checksum, escapes, delimiters. Mistakes of firmware
lie behind the checksum, and random bytes never get there; a fuzzer changes bodies, and `repair` makes frames of them
that the receiver has to take.
"""

from __future__ import annotations

import msgspec

from miro_exact.plugins import Registry


class Frame(msgspec.Struct, frozen=True):
    """A good frame: its body, and `start` .. `end` - 1, where its characters stand among those decoded."""

    body: bytes
    start: int
    end: int


class Damage(msgspec.Struct, frozen=True):
    """Characters `start` .. `end` - 1 that are no frame; `reason` in a few words."""

    start: int
    end: int
    reason: str


class Protocol(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="protocol"):
    """Base of every wire format. The fields are its parameters.

    Derive with `frozen=True, tag="its_name"`, give each parameter its range (`typing.Annotated` with `msgspec.Meta`),
    and define all three methods. Two laws hold for any bytes:

        decode(encode(body)) == [Frame(body, 0, size)]          of a body that can be sent
        decode(repair(body)) == [Frame(some body, 0, size)]     of any body at all
    """

    @property
    def name(self) -> str:
        return str(self.__struct_config__.tag)

    def encode(self, body: bytes) -> bytes:
        """All characters of the frame around `body`. Raises ValueError for a body that no frame can carry."""
        raise NotImplementedError

    def decode(self, wire: bytes) -> list[Frame | Damage]:
        """Decodes consecutive characters as a receiver does. Raises nothing."""
        raise NotImplementedError

    def repair(self, body: bytes, number: int | None = None) -> bytes:
        """The frame nearest to `body`, for any bytes. Raises nothing.

        `number`: index of the frame in its session, from which a format with sequence numbers computes the right one.
        None: the body's own numbers stay.
        """
        raise NotImplementedError

    def samples(self) -> tuple[bytes, ...]:
        """Bodies that mean something, one of each kind: what fuzzing begins with."""
        return (b"",)


PROTOCOLS: Registry[Protocol] = Registry(
    word="protocol",
    key="protocol",
    base="miro_protocol.protocol:Protocol",
    own={"miro": "miro_protocol.miro_wire:Miro"},
)
