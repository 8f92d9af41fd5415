"""The Debug Adapter Protocol on two streams: a head with Content-Length, then JSON."""

from __future__ import annotations

import queue
import re
import threading
from typing import Any, BinaryIO

import msgspec

from miro_exact.bad_input import BadInput, shortened

MOST_BYTES = 16 << 20
_MOST_HEAD = 4096
_LENGTH = re.compile(rb"Content-Length:[ \t]*([0-9]{1,9})[ \t]*\r?\n", re.IGNORECASE)
_TYPE = re.compile(rb"Content-Type:[^\n]*\n", re.IGNORECASE)
_NULL = ("dataId",)  # what the protocol wants as null where there is none
Message = dict[str, Any]


class Request(msgspec.Struct):
    """Fields of every message from a client."""

    seq: int
    type: str
    command: str
    arguments: Message | None = None


class Wire:
    """Messages of a client, read by a thread of their own so that one that comes during a run is noticed."""

    def __init__(self, source: BinaryIO, sink: BinaryIO) -> None:
        self.source = source
        self.sink = sink
        self.sequence = 0
        self.came: queue.SimpleQueue[Message | BadInput | None] = queue.SimpleQueue()
        threading.Thread(target=self._read_all, daemon=True).start()

    def next(self, wait: bool = True) -> Message | None:
        """The next message; None at the end of input. Without `wait` an empty message if none has arrived.

        Raises BadInput for malformed input, and again on each later call: nothing is read after it.
        """
        try:
            message = self.came.get(block=wait)
        except queue.Empty:
            return {}
        if not isinstance(message, dict):
            self.came.put(message)  # it is the last one
        if isinstance(message, BadInput):
            raise message
        return message

    def send(self, message: Message) -> None:
        """Sends a message without its None fields. Raises OSError if the client has disconnected."""
        self.sequence += 1
        data = msgspec.json.encode({"seq": self.sequence, **_given(message)})
        self.sink.write(b"Content-Length: %d\r\n\r\n%b" % (len(data), data))
        self.sink.flush()

    def _read_all(self) -> None:
        message: Message | BadInput | None = {}
        while isinstance(message, dict):
            try:
                message = self._read()
            except BadInput as error:
                message = error
            except (OSError, ValueError):  # it was closed
                message = None
            self.came.put(message)

    def _read(self) -> Message | None:
        """Raises BadInput for a head with anything but the protocol's own fields: it may be a web browser's."""
        line = self.source.readline(_MOST_HEAD)
        while line in (b"\n", b"\r\n"):  # between messages
            line = self.source.readline(_MOST_HEAD)
        if not line:
            return None
        size = -1
        while line not in (b"\n", b"\r\n"):
            if match := _LENGTH.fullmatch(line):
                size = int(match[1])
            elif not _TYPE.fullmatch(line):
                raise _garbage(line, "no field of a head")
            line = self.source.readline(_MOST_HEAD)
        if not 0 <= size <= MOST_BYTES:
            raise _garbage(b"%d" % size, f"no Content-Length up to {MOST_BYTES >> 20} MiB")
        data = self.source.read(size)
        try:
            request = msgspec.json.decode(data, type=Request)
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:  # not UTF-8, long numbers, nested
            raise _garbage(data, f"no request: {error}") from None
        return msgspec.structs.asdict(request) | {"arguments": request.arguments or {}}


def _given(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _given(inner) for key, inner in value.items() if inner is not None or key in _NULL}
    return [_given(inner) for inner in value] if isinstance(value, list) else value


def _garbage(data: bytes, fault: str) -> BadInput:
    reason = f"the client sends no message of the protocol: {shortened(repr(data[:_MOST_HEAD]))} is {fault}"
    return BadInput("--dap", "", reason, "check what is connected")
