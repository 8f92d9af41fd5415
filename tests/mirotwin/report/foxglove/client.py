"""A viewer that asks for every topic and keeps what it is sent: the protocol `foxglove.sdk.v1`, by hand.

The SDK tells of a topic a moment before it takes subscriptions to it, so the viewer asks when it has heard
nothing for a moment.
"""

from __future__ import annotations

import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
import websocket

from tests import children

PROTOCOL = "foxglove.sdk.v1"
MESSAGE, TIME = 1, 2
PATIENCE_S, MOMENT_S = 30.0, 0.05


class Viewer:
    """Connects at once; `stop_after` messages it goes away, else when the server does."""

    def __init__(self, url: str, stop_after: int = 1 << 60) -> None:
        self.socket = websocket.create_connection(url, subprotocols=[PROTOCOL], timeout=PATIENCE_S)
        assert self.socket.subprotocol == PROTOCOL
        self.stop_after = stop_after
        self.info: dict[str, Any] = {}
        self.channels: dict[int, dict[str, Any]] = {}
        self._wanted: list[dict[str, int]] = []
        self.messages: list[tuple[str, int, bytes]] = []
        self.times_ns: list[int] = []
        self._thread = threading.Thread(target=self._listen)
        self._thread.start()

    def done(self) -> Viewer:
        """Waits until it has gone."""
        self._thread.join(60)
        assert not self._thread.is_alive()
        return self

    def _listen(self) -> None:
        while len(self.messages) < self.stop_after:
            try:
                self.socket.settimeout(MOMENT_S if self._wanted else PATIENCE_S)
                kind, data = self.socket.recv_data()
            except websocket.WebSocketTimeoutException:
                if not self._wanted:
                    break
                self._ask()
                continue
            except (websocket.WebSocketException, OSError):
                break
            if kind == websocket.ABNF.OPCODE_TEXT:
                self._told(msgspec.json.decode(data))
            elif kind == websocket.ABNF.OPCODE_BINARY:
                self._sent(data)
            else:
                break
        self.socket.close()

    def _told(self, what: dict[str, Any]) -> None:
        if what["op"] == "serverInfo":
            self.info = what
        if what["op"] == "advertise":
            fresh = {channel["id"]: channel for channel in what["channels"]}
            self.channels.update(fresh)
            self._wanted += [{"id": number, "channelId": number} for number in fresh]

    def _ask(self) -> None:
        what = {"op": "subscribe", "subscriptions": self._wanted}
        self.socket.send(msgspec.json.encode(what).decode())
        self._wanted = []

    def _sent(self, data: bytes) -> None:
        if data[0] == MESSAGE:
            number, time_ns = struct.unpack_from("<IQ", data, 1)
            self.messages.append((self.channels[number]["topic"], time_ns, data[13:]))
        if data[0] == TIME:
            self.times_ns += struct.unpack_from("<Q", data, 1)


PROGRAM = "import sys; import mirotwin.entry as entry; sys.argv[0] = 'mirotwin'; entry.main()"


@contextmanager
def live(*arguments: object) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """`mirotwin run .. --live` at a free port, and its URL; ended in any case."""
    words = [
        sys.executable,
        "-c",
        PROGRAM,
        "run",
        *map(str, arguments),
        "--live",
        "127.0.0.1:0",
        "--no-figure",
    ]
    with children.start(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            assert line.startswith("live ws://127.0.0.1:"), (line, process.stderr and process.stderr.read())
            yield process, line.split()[1]
        finally:
            if process.poll() is None:
                process.kill()
