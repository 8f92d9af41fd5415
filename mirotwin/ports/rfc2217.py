"""A port behind RFC 2217: TCP with telnet negotiation of baud rate, format and lines, as `rfc2217://` speaks.

The format is always 8N1, and a radio's rate 9600 baud; a request for another one is answered with the actual one, and
the client raises. A wire accepts any rate until it has one. Flow control, DTR, RTS and BREAK are acknowledged and have
no effect: a radio module and a wire of three have no such lines, and no break gets through. CTS, DSR and CD are active.
Negotiation that makes no sense is ignored and counted.
"""

from __future__ import annotations

import struct
from typing import Any

from serial import rfc2217
from serial.serialutil import EIGHTBITS, PARITY_NONE, STOPBITS_ONE

from mirotwin.ports.sockets import TcpEndpoint

LONGEST_SUBOPTION = 256
NONSENSE = (struct.error, TypeError, ValueError, KeyError, IndexError)
"""Exceptions of `PortManager` for a command that is cut short or has values that do not exist."""


class Rfc2217Endpoint(TcpEndpoint):
    """`ignored`: commands of all clients that made no sense."""

    kind, scheme = "rfc2217", "rfc2217"
    ignored = 0
    _manager: Any = None

    def greet(self) -> None:
        self._reported = False
        self._settings = _Settings(self)
        self._manager = rfc2217.PortManager(self._settings, self)

    @property
    def baud(self) -> int:
        return 0 if self._manager is None else self._settings.baudrate

    def from_client(self, data: bytes) -> bytes:
        manager = self._manager
        received = bytearray()
        for value in data:
            try:
                for byte in manager.filter(bytes([value])):
                    received += byte
                if manager.suboption is not None and len(manager.suboption) > LONGEST_SUBOPTION:
                    raise ValueError("a suboption that does not end")
            except NONSENSE:
                self._ignore()
        return bytes(received)

    def _ignore(self) -> None:
        self._manager.suboption = None
        self._manager.mode = rfc2217.M_NORMAL
        self.ignored += 1
        if not self._reported:
            self._reported = True
            self.tell(f"{self.name}: {self.client} negotiates nonsense, which is ignored")

    def to_client(self, data: bytes) -> bytes:
        return b"".join(self._manager.escape(data))


class _Settings:
    """The port as `PortManager` sees it: settings that can be read, of which only the rate of a wire can be changed."""

    cts = dsr = cd = True
    ri = False
    xonxoff = rtscts = dtr = rts = break_condition = False
    bytesize, parity, stopbits = EIGHTBITS, PARITY_NONE, STOPBITS_ONE
    baudrate = 0

    def __init__(self, endpoint: Rfc2217Endpoint) -> None:
        self._endpoint = endpoint
        super().__setattr__("baudrate", endpoint.port.baud)

    def __setattr__(self, name: str, wanted: object) -> None:
        if name == "baudrate" and isinstance(wanted, int) and self._endpoint.port.takes(wanted):
            super().__setattr__(name, wanted)
        elif name in ("baudrate", "bytesize", "parity", "stopbits") and wanted != getattr(self, name):
            raise ValueError(f"this port has {getattr(self, name)}")
        super().__setattr__(name, wanted)

    def reset_input_buffer(self) -> None:
        self._endpoint.out.clear()

    def reset_output_buffer(self) -> None:
        self._endpoint.port.purge()
