"""The Debug Adapter Protocol on two streams: a head with Content-Length, then JSON."""

from __future__ import annotations

import queue
import re
import threading
from collections.abc import Callable
from typing import Any, BinaryIO

import msgspec

from miro_exact.bad_input import BadInput, shortened

MOST_BYTES = 16 << 20
_MOST_HEAD, _CHUNK_BYTES = 4096, 65536
_LENGTH = re.compile(rb"^Content-Length:[ \t]*([0-9]{1,9})[ \t]*$", re.MULTILINE | re.IGNORECASE)
Message = dict[str, Any]


class Wire:
    """Messages of a client, read by a thread of their own so that one that comes during a run is seen."""

    def __init__(self, receive: Callable[[int], bytes], sink: BinaryIO) -> None:
        self.receive = receive
        self.sink = sink
        self.sequence = 0
        self.data = b""
        self.came: queue.SimpleQueue[Message | BadInput | None] = queue.SimpleQueue()
        self.back: list[Message | BadInput | None] = []
        threading.Thread(target=self._read_all, daemon=True).start()

    def next(self, wait: bool = True) -> Message | None:
        """The next message; None at the end of input, and (without `wait`) an empty one where none is there yet.

        Raises BadInput for what is no message.
        """
        try:
            found = self.back.pop(0) if self.back else self.came.get(block=wait)
        except queue.Empty:
            return {}
        if isinstance(found, BadInput):
            raise found
        return found

    def send(self, message: Message) -> None:
        """Raises OSError where the client has gone."""
        self.sequence += 1
        data = msgspec.json.encode({"seq": self.sequence, **message})
        self.sink.write(b"Content-Length: %d\r\n\r\n%b" % (len(data), data))
        self.sink.flush()

    def _read_all(self) -> None:
        try:
            while (message := self._read()) is not None:
                self.came.put(message)
            self.came.put(None)
        except BadInput as error:
            self.came.put(error)
        except (OSError, ValueError):  # it was closed
            self.came.put(None)

    def _more(self) -> bool:
        """Takes what comes next; False at the end of input."""
        data = self.receive(_CHUNK_BYTES)
        self.data += data
        return bool(data)

    def _read(self) -> Message | None:
        while (end := self.data.find(b"\r\n\r\n")) < 0:
            if len(self.data) > _MOST_HEAD or (not self._more() and self.data):
                raise _garbage(f"the head {shortened(repr(self.data))} does not end")
            if not self.data:
                return None
        head, begin = self.data[:end].replace(b"\r", b""), end + 4
        found = _LENGTH.search(head)
        if found is None or int(found[1]) > MOST_BYTES:
            raise _garbage(
                f"the head {shortened(repr(head))} has no Content-Length up to {MOST_BYTES >> 20} MiB"
            )
        end = begin + int(found[1])
        while len(self.data) < end and self._more():
            pass
        data, self.data = self.data[begin:end], self.data[end:]
        try:
            message = msgspec.json.decode(data, type=dict[str, Any])
        except msgspec.MsgspecError:
            raise _garbage(f"{shortened(repr(data))} is no JSON object") from None
        wanted = {"seq": int, "command": str, "type": str}
        if any(not isinstance(message.get(key), kind) for key, kind in wanted.items()):
            raise _garbage(f"{shortened(repr(data))} is no request")
        if not isinstance(message.setdefault("arguments", {}), dict):
            raise _garbage(f"{shortened(repr(data))} has arguments that are no object")
        return message


def _garbage(what: str) -> BadInput:
    return BadInput(
        "--dap", "", f"the client sends no message of the protocol: {what}", "check what is connected"
    )
