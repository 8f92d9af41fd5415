"""The output of a decoder: valid frames and damaged runs, with every character in exactly one of them."""

from __future__ import annotations

from enum import IntEnum
from functools import lru_cache

import msgspec

from miro_protocol.frames import Message, decode_fields
from miro_protocol.table import SEQ_MODULUS


class Reason(IntEnum):
    """Why a run of characters is no frame: the furthest that any window starting in it got."""

    NO_SYNC = 0
    CUT_SHORT = 1  # a sync, but the input ended before the frame did
    BAD_STOP_BIT = 2
    BAD_SPACING = 3
    BAD_CRC = 4


class Received(msgspec.Struct, frozen=True, gc=False):
    """A valid frame. `data` are its characters with the preamble found right before it."""

    data: bytes
    start_tick: int
    """Start bit of data[0]."""
    last_tick: int
    """Start bit of the last character."""
    body: bytes
    """HDR and payload in clear."""

    @property
    def type(self) -> int:
        return self.body[0] // SEQ_MODULUS

    @property
    def seq(self) -> int:
        return self.body[0] % SEQ_MODULUS

    def message(self, n: int) -> Message:
        """The content of the frame, in a network of `n` robots. Raises ContentError for unknown content."""
        return _message(self.body, n)


_message = lru_cache(maxsize=16)(decode_fields)
"""Cached, because several listeners decode the same body."""


class Damaged(msgspec.Struct, frozen=True, gc=False):
    """A run of characters between frames, preambles of damaged frames included."""

    data: bytes
    reason: Reason
    start_tick: int


Event = Received | Damaged
