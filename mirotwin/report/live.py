"""What `summary.json` says of a live session."""

import msgspec


class Plug(msgspec.Struct, frozen=True):
    """A port: how many clients were there and were refused, bytes from and to them, and those that none had read."""

    name: str
    clients: int
    refused: int
    bytes_in: int
    bytes_out: int
    dropped: int


class LiveFigures(msgspec.Struct, frozen=True):
    """A session: virtual seconds in a second of the wall clock, and how far the world was behind it.

    `late_max_ms` in virtual time at most; `late_s`: how much of it was passed 20 ms or more behind.
    """

    realtime: float
    late_max_ms: float
    late_s: float
    plugs: tuple[Plug, ...]
