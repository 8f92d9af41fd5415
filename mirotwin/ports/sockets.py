"""A port behind TCP: raw bytes.

A second client is refused: its connection is closed at once and the user is notified. A client that has shut down its
sending side (`socat - TCP:..` at the end of its input) is there for half a second more, in which it gets answers,
unless another one comes.
"""

from __future__ import annotations

import os
import socket
from selectors import EVENT_READ

from miro_exact.bad_input import BadInput
from mirotwin.ports.endpoint import CHUNK_BYTES, Endpoint, PortContext

LINGER_S = 0.5
MOST_WIRE_BYTES = 65_536
"""Largest number of waiting protocol bytes of a connection; a client that causes more without reading is
disconnected.
"""


class TcpEndpoint(Endpoint):
    """Listens on `host`, `number` (0: any free one). Raises BadInput for an address that cannot be had."""

    kind, scheme = "tcp", "socket"

    def __init__(self, context: PortContext, host: str, number: int) -> None:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            self._listener = socket.create_server((host, number), family=family, backlog=8)
        except OSError as error:
            reason = os.strerror(error.errno) if error.errno and error.errno > 0 else f"{error}"
            remedy = "choose another port, or 0 for a free one"
            raise BadInput(f"--{self.kind} {number}", "", f"{host}: {reason}", remedy) from None
        self._listener.setblocking(False)
        shown = f"[{host}]" if ":" in host else host
        super().__init__(context, f"{self.scheme}://{shown}:{self._listener.getsockname()[1]}")
        self._socket: socket.socket | None = None
        self._wire = bytearray()
        self._input_over_tick = -1
        self.selector.register(self._listener, EVENT_READ)

    def receive(self) -> bytes:
        self._accept()
        over_tick = self._input_over_tick
        if self._socket is None:
            return b""
        if over_tick >= 0:
            linger_ticks = int(LINGER_S * self.port.world.clock)
            if self.port.world.tick >= max(over_tick, self.port.free_tick) + linger_ticks:
                self._put_out()
            return b""
        data = self._read(min(CHUNK_BYTES, self.port.room))
        self._watch()
        return data

    def _read(self, most: int) -> bytes:
        assert self._socket is not None
        if not most:
            return b""
        try:
            data = self._socket.recv(most)
        except BlockingIOError:
            return b""
        except OSError as error:
            self._put_out(f"has gone ({error.strerror or error})")
            return b""
        if not data:
            self._input_over_tick = self.port.world.tick
        return self.from_client(data)

    def push(self) -> None:
        if self._socket is None:
            return
        if not self._wire and self.out:
            taken = self.out.take(CHUNK_BYTES)
            self.bytes_out += len(taken)
            self._wire += self.to_client(taken)
        if self._wire:
            try:
                del self._wire[: self._socket.send(self._wire)]
            except BlockingIOError:
                pass
            except OSError as error:
                self._put_out(f"has gone ({error.strerror or error})")
                return
        if len(self._wire) > MOST_WIRE_BYTES:
            self._put_out("is put out: it makes answers and reads none")
        self._watch()

    def close(self) -> None:
        if self._socket is not None:
            self.push()
        if self._socket is not None:
            self._put_out("is left: the session ends")
        self.selector.unregister(self._listener)
        self._listener.close()

    # ---- for what is more than bytes ---------------------------------------------------------------------

    def greet(self) -> None:
        """A client is there."""

    def from_client(self, data: bytes) -> bytes:
        """The payload bytes in the client's bytes, for the radio."""
        return data

    def to_client(self, data: bytes) -> bytes:
        """The radio's bytes in the client's protocol."""
        return data

    def write(self, data: bytes) -> None:
        """Own words for the client."""
        self._wire += data

    # ---- connections -------------------------------------------------------------------------------------

    def _accept(self) -> None:
        try:
            accepted, address = self._listener.accept()
        except (BlockingIOError, ConnectionError):
            return
        client = f"{address[0]}:{address[1]}"
        if self._socket is not None and self._input_over_tick >= 0:
            self._put_out()
        if self._socket is not None:
            self.refused += 1
            accepted.close()
            self.tell(f"{self.name}: {client} is refused; {self.client} is there")
            return
        accepted.setblocking(False)
        accepted.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        _keep_alive(accepted)
        self._socket = accepted
        self._input_over_tick = -1
        self._wire = bytearray()
        self.has_come(client)
        self.greet()
        self._watch()

    def _put_out(self, why: str = "has gone") -> None:
        assert self._socket is not None
        self.watch(self._socket, reads=False, writes=False)
        self._socket.close()
        self._socket = None
        self.has_gone(why)

    def _watch(self) -> None:
        """Registers the events of the client for which the selector must wake."""
        if self._socket is not None:
            reads = self.port.room > 0 and self._input_over_tick < 0
            self.watch(self._socket, reads, writes=bool(self._wire))


def _keep_alive(client: socket.socket) -> None:
    """Enables TCP keep-alive: a vanished client is dropped after a minute, else nobody else could connect."""
    client.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (
        ("TCP_KEEPIDLE", 30),
        ("TCP_KEEPINTVL", 10),
        ("TCP_KEEPCNT", 3),
        ("TCP_USER_TIMEOUT", 60_000),  # ms; while an answer is on its way, the kernel does not probe
    ):
        if hasattr(socket, name):
            client.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
