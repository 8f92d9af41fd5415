"""The base of all live ports: one client at a time, a bounded buffer towards it, and byte counts.

Bytes from a client wait in the kernel until the transmit buffer has room, so a client that is too fast is held up, and
nothing is lost. Up to 64 KiB wait here for a client that does not read; further bytes are dropped and counted, as by a
serial port's driver, because the robots do not wait.
"""

from __future__ import annotations

from collections.abc import Callable
from selectors import EVENT_READ, EVENT_WRITE, BaseSelector
from typing import Any, NamedTuple

from miro_exact.bad_input import amount
from mirotwin.ports.radio_port import RadioPort
from mirotwin.runs.summary import Plug

BUFFER_BYTES = 65_536
"""68 s of a robot that sends all the time."""


class ByteFifo:
    """At most `limit` bytes. `dropped`: how many found it full."""

    def __init__(self, limit: int = BUFFER_BYTES) -> None:
        self.limit = limit
        self.data = bytearray()
        self.dropped = 0

    def __len__(self) -> int:
        return len(self.data)

    def add(self, data: bytes) -> None:
        """Appends as much as fits, and drops the rest."""
        room = self.limit - len(self.data)
        self.data += data[:room]
        self.dropped += max(0, len(data) - room)

    def take(self, count: int) -> bytes:
        """Removes up to `count` bytes from the front."""
        taken = bytes(self.data[:count])
        del self.data[:count]
        return taken

    def clear(self) -> None:
        self.data.clear()


CHUNK_BYTES = 4096
SETTLING_S = 0.2
"""Time for a program to set its rate after it opened a port, before a wrong rate is reported, in seconds."""
Tell = Callable[[str], object]
"""Takes a line for the user."""


class PortContext(NamedTuple):
    """Shared objects of all endpoints: the radio, the selector that wakes the session, the receiver of reports."""

    port: RadioPort
    selector: BaseSelector
    tell: Tell


class Endpoint:
    """A port that programs open: `kind`, address `where`, and `client` ("": none)."""

    kind = ""

    def __init__(self, context: PortContext, where: str) -> None:
        self.port, self.selector, self.tell = context
        self.where = where
        self.name = f"{self.kind} {where}"
        self.client = ""
        self.out = ByteFifo()
        self.clients = self.refused = 0
        self.bytes_in = self.bytes_out = self.dropped = 0
        self._client_bytes = (0, 0)
        self._came_tick = 0
        self._remarks: set[str] = set()
        self._watched = 0

    def receive(self) -> bytes:
        """The bytes that the client has sent, at most the room in the transmit buffer.

        Notices clients that come and go.
        """
        raise NotImplementedError

    def push(self) -> None:
        """Writes as much to the client as it accepts."""
        raise NotImplementedError

    def close(self) -> None:
        """Takes the port away."""
        raise NotImplementedError

    @property
    def baud(self) -> int:
        """The rate that the client has set; 0: this kind of port has none."""
        return 0

    def exchange(self, at_tick: int) -> None:
        """The client's bytes to the radio, at this tick or as soon as they can be."""
        data, baud = self.receive(), self.baud
        if data:
            self.bytes_in += len(data)
            if not self._is_said(self.port.deaf_to(baud)):
                self.port.send(data, at_tick, baud)
                self._is_said(self.port.remark_on_sending(baud))

    def _is_said(self, remark: str) -> bool:
        """True if there is a remark; it is reported once per client."""
        if remark and remark not in self._remarks:
            self._remarks.add(remark)
            self.tell(f"{self.name}: {self.client or 'the client'} {remark}")
        return bool(remark)

    def deliver(self, data: bytes) -> None:
        """Passes characters received by the PC to the client, if there is one."""
        if self.client and data:
            since = self.port.world.tick - self._came_tick
            if (mute := self.port.mute_at(self.baud)) and since < self.port.world.clock * SETTLING_S:
                return  # it has not set its rate yet
            if self._is_said(mute):
                return
            full = self.out.dropped
            self.out.add(data)
            if self.out.dropped and not full:
                waiting = amount(len(self.out), "byte waits", "bytes wait")
                self.tell(f"{self.name}: {self.client} does not read; {waiting}, more are dropped")

    def plug(self) -> Plug:
        """The counts, for the summary."""
        counts = self.clients, self.refused, self.bytes_in, self.bytes_out
        return Plug(self.name, *counts, self.dropped + self.out.dropped)

    # ---- for derived classes -----------------------------------------------------------------------------

    def watch(self, file: Any, reads: bool, writes: bool) -> None:
        """Lets the selector wake where `file` can be read, and where it can be written."""
        wanted = (EVENT_READ if reads else 0) | (EVENT_WRITE if writes else 0)
        if wanted == self._watched:
            return
        if not self._watched:
            self.selector.register(file, wanted)
        elif not wanted:
            self.selector.unregister(file)
        else:
            self.selector.modify(file, wanted)
        self._watched = wanted

    def has_come(self, client: str) -> None:
        self.client = client
        self.clients += 1
        self._came_tick = self.port.world.tick
        self._remarks.clear()
        self._client_bytes = self.bytes_in, self.bytes_out
        self.tell(f"{self.name}: {client} is there")

    def has_gone(self, why: str = "has gone") -> None:
        """Discards the bytes that wait for the client."""
        counted_in, counted_out = self._client_bytes
        lost = len(self.out)
        text = f"{amount(self.bytes_in - counted_in, 'byte')} came from it, {self.bytes_out - counted_out} went to it"
        if self.out.dropped or lost:
            text += f", {self.out.dropped + lost} that it did not read are dropped"
        self.tell(f"{self.name}: {self.client} {why}; {text}")
        self.dropped += self.out.dropped + lost
        self.client = ""
        self.out = ByteFifo()
