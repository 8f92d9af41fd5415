"""The ports of `serve`: telnet negotiation fed with bytes, and TCP and terminals with a client that does anything."""

import contextlib
import os
import socket
from selectors import DefaultSelector

from mirotwin.ports.endpoint import PortContext
from mirotwin.ports.radio_port import RadioPort
from mirotwin.ports.rfc2217 import LONGEST_SUBOPTION, Rfc2217Endpoint
from mirotwin.ports.sockets import TcpEndpoint
from mirotwin.ports.terminal import PtyEndpoint
from tests.fuzz.target import Draws, Target, pieces


class _Radio:
    """A radio's port that keeps what is sent. `room` is drawn; time stands, but for `world.tick`."""

    baud = RadioPort.baud
    takes, remark_on_sending = RadioPort.takes, RadioPort.remark_on_sending
    deaf_to, mute_at = RadioPort.deaf_to, RadioPort.mute_at

    def __init__(self):
        self.world = self
        self.clock = 24_000_000
        self.tick = self.free_tick = 0
        self.room = 4096
        self.sent = b""
        self.network = self.waiting = 0

    def send(self, data, at_tick=0, baud=0):
        assert 0 < len(data) <= self.room, f"{len(data)} bytes where there is room for {self.room}"
        self.sent += data
        return self.tick

    def purge(self):
        """Nothing waits."""


def _context(radio, told):
    return PortContext(radio, DefaultSelector(), told.append)


def _negotiation():
    told = []
    whole, parts, other = (Rfc2217Endpoint(_context(_Radio(), told), "127.0.0.1", 0) for _ in range(3))

    def run(data):
        cut, data = 1 + (data[0] if data else 0), data[1:]
        del told[:]
        for port in (whole, parts, other):
            port.greet()
            port.ignored = 0
            port._wire.clear()
        found = whole.from_client(data)
        again = b"".join(parts.from_client(part) for part in pieces(data, cut))
        assert found == again, "cut elsewhere, other bytes pass"
        assert whole._wire == parts._wire, "cut elsewhere, the answers differ"
        assert whole.ignored == parts.ignored, "cut elsewhere, more or less is ignored"
        assert len(whole._manager.suboption or b"") <= LONGEST_SUBOPTION
        assert len(told) <= 2, told
        assert all(line.isprintable() for line in told), told
        assert other.from_client(whole.to_client(data)) == data, "escaped and heard, the bytes differ"
        return f"{min(len(found), 3)} bytes, {min(whole.ignored, 3)} ignored, {min(len(whole._wire) // 8, 40)} answers"

    return run


def _client(draw, radio, port, connect, told):
    """Does what is drawn; every byte that arrives was sent, in that order, by one client after the other."""
    clients = []
    given = []
    delivered = 0
    for _ in range(24):
        action = draw.below(10)
        if action == 0:
            clients.append(connect())
            given.append(b"")
        elif action in (1, 2) and clients:
            at = draw.below(len(clients))
            data = draw.take(1 + draw.below(100)) * (1 if action == 1 else 100)
            given[at] += clients[at].say(data)
        elif action == 3 and clients:
            clients[draw.below(len(clients))].finish()
        elif action == 4 and clients:
            clients[draw.below(len(clients))].close(draw.below(2))
        elif action == 5 and clients:
            clients[draw.below(len(clients))].hear()
        elif action == 6:
            port.deliver(draw.take(draw.below(100)) * (1 + draw.below(2) * 900))
            delivered += 1
        elif action == 7:
            radio.tick += draw.below(1 << 24)
        elif action == 8:
            radio.room = draw.below(4097)
        if action != 9:
            port.exchange(0)
        port.push()
        if not draw.left:
            break
    for client in clients:
        client.close(0)
    assert all(line.isprintable() for line in told), told
    assert port.bytes_in == len(radio.sent), "bytes were lost between the port and the radio"
    assert len(port.out) <= port.out.limit
    return f"{port.clients} clients, {port.refused} refused, {min(port.bytes_in, 2)} in, {min(port.bytes_out, 2)} out"


class _TcpClient:
    def __init__(self, number):
        self.socket = socket.create_connection(("127.0.0.1", number), timeout=5)
        self.socket.setblocking(False)

    def say(self, data):
        try:
            return data[: self.socket.send(data)]
        except OSError:
            return b""

    def hear(self):
        with contextlib.suppress(OSError):
            self.socket.recv(65_536)

    def finish(self):
        with contextlib.suppress(OSError):
            self.socket.shutdown(socket.SHUT_WR)

    def close(self, hard):
        if hard and self.socket.fileno() >= 0:
            linger = b"\1\0\0\0\0\0\0\0"
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
        self.socket.close()


class _TerminalClient:
    def __init__(self, path):
        self.file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def say(self, data):
        try:
            return data[: os.write(self.file, data)] if self.file >= 0 else b""
        except OSError:
            return b""

    def hear(self):
        try:
            if self.file >= 0:
                os.read(self.file, 65_536)
        except OSError:
            pass

    def finish(self):
        """A terminal has no half of a connection to close; it may be set, to another rate and to lines."""
        import termios

        if self.file >= 0:
            modes = termios.tcgetattr(self.file)
            modes[3] |= termios.ICANON | termios.ECHO
            modes[4] = modes[5] = termios.B115200
            termios.tcsetattr(self.file, termios.TCSANOW, modes)

    def close(self, hard):
        if self.file >= 0:
            os.close(self.file)
        self.file = -1


def _sockets(kind):
    def run(data):
        radio, told = _Radio(), []
        context = _context(radio, told)
        if kind == "pty":
            port = PtyEndpoint(context, None)
            connect = lambda: _TerminalClient(port.path)  # noqa: E731
        else:
            port = (Rfc2217Endpoint if kind == "rfc2217" else TcpEndpoint)(context, "127.0.0.1", 0)
            number = int(port.where.rpartition(":")[2])
            connect = lambda: _TcpClient(number)  # noqa: E731
        try:
            return _client(Draws(data), radio, port, connect, told)
        finally:
            port.close()
            assert not context.selector.get_map(), "something is still watched"
            context.selector.close()

    return run


_TELNET = [bytes((0xFF, code)) for code in (0xF0, *range(0xFB, 0x100))]
_TELNET += [b"\xff\xfa\x2c", b"\x2c", b"\x00"]

TARGETS = {
    "rfc2217": Target("RFC 2217 negotiation, cut anywhere", _negotiation, most_bytes=512, words=_TELNET),
    "rfc2217-client": Target(
        "an RFC 2217 port with clients", lambda: _sockets("rfc2217"), most_bytes=256, words=_TELNET
    ),
    "tcp": Target("a TCP port with clients that do anything", lambda: _sockets("tcp"), most_bytes=256),
    "pty": Target("a pseudo-terminal with programs", lambda: _sockets("pty"), most_bytes=256),
}
