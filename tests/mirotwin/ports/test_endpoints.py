"""Ports in this process: TCP, telnet negotiation and pseudo-terminals, with clients that behave well and badly."""

import os
import select
import socket
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from serial import rfc2217

from miro_exact.bad_input import BadInput
from miro_exact.clock import ticks
from mirotwin.ports import terminal
from mirotwin.ports.rfc2217 import Rfc2217Endpoint
from mirotwin.ports.sockets import TcpEndpoint
from mirotwin.ports.terminal import PtyEndpoint
from tests.mirotwin.ports.rig import Rig, connected, question, soon

IAC, SB, SE, WILL, DO = b"\xff", b"\xfa", b"\xf0", b"\xfb", b"\xfd"
COM_PORT = b"\x2c"


# TCP


@pytest.fixture
def rig():
    found = Rig()
    yield found
    found.close()


def test_bytes_pass_as_they_are_both_ways(rig):
    port, client = rig.connected(TcpEndpoint)
    everything = bytes(range(256))
    client.sendall(everything)
    got = b""
    while len(got) < 256:
        got += port.receive()
    assert got == everything
    port.deliver(everything)
    port.push()
    assert client.recv(1000) == everything
    client.close()
    soon(port, lambda: rig.world.run_to(rig.world.tick + 24_000) or not port.client)
    assert (port.plug().clients, port.plug().bytes_out) == (1, 256)


def test_a_second_client_is_refused_and_the_first_one_stays(rig):
    port, first = rig.connected(TcpEndpoint)
    with socket.create_connection(first.getpeername(), timeout=5) as second:
        soon(port, lambda: port.refused)
        assert second.recv(1) == b""
    first.sendall(b"x")
    got = []
    soon(port, lambda: got.append(port.receive()) or b"".join(got) == b"x")
    assert [line.endswith(f"is refused; {port.client} is there") for line in rig.told].count(True) == 1
    assert port.plug().refused == 1


def test_a_client_that_breaks_the_connection_is_gone_and_the_next_one_is_welcome(rig):
    port = rig.opened(TcpEndpoint, "127.0.0.1", 0)
    for _ in range(2):
        client = connected(port)
        client.sendall(question(0)[:10])  # in the middle of a frame
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        client.close()  # RST
        soon(port, lambda: not port.client)
    assert port.plug().clients == 2


def test_a_client_whose_input_is_over_gets_answers_for_half_a_second(rig):
    port, client = rig.connected(TcpEndpoint)
    client.sendall(b"?")
    client.shutdown(socket.SHUT_WR)
    port.port.send(soon(port, lambda: port._input_over_tick >= 0) or b"?")
    rig.world.run_to(ticks(0.4))
    port.receive()
    port.deliver(b"answer")
    port.push()
    assert client.recv(100) == b"answer"
    rig.world.run_to(ticks(0.6))
    port.receive()
    assert port.client == ""
    assert client.recv(100) == b""


def test_bytes_wait_in_the_kernel_while_the_transmit_buffer_is_full(rig):
    port, client = rig.connected(TcpEndpoint)
    client.sendall(bytes(6000))
    until_s = time.monotonic() + 5
    while port.bytes_in < 4096 and time.monotonic() < until_s:
        port.exchange(0)
    assert (port.bytes_in, port.port.room) == (4096, 0)
    port.exchange(0)
    assert port.bytes_in == 4096
    ready = [key.fileobj for key, _ in rig.selector.select(0)]
    assert ready in ([], [port._listener])  # it lets us sleep
    rig.world.run_to(ticks(3.0))
    while port.bytes_in < 6000 and time.monotonic() < until_s:
        port.exchange(0)
    assert port.bytes_in == 6000


def test_a_slow_reader_is_dropped_bytes_and_not_waited_for(rig):
    port, client = rig.connected(TcpEndpoint)
    for _ in range(2000):
        port.deliver(bytes(8192))
        port.push()
    assert 65_536 - 4096 <= len(port.out) <= 65_536
    assert port.plug().dropped > 0
    client.close()
    soon(port, lambda: not port.client)
    plug = port.plug()
    assert plug.bytes_out + plug.dropped == 2000 * 8192


def test_a_port_that_is_taken_is_bad_input(rig):
    port = rig.opened(TcpEndpoint, "127.0.0.1", 0)
    number = int(port.where.rpartition(":")[2])
    taken = rf"--tcp {number}: 127.0.0.1: Address already in use; choose another port"
    with pytest.raises(BadInput, match=taken):
        TcpEndpoint(rig.context, "127.0.0.1", number)
    with pytest.raises(BadInput, match=r"--rfc2217 0: 203\.0\.113\.9: "):
        Rfc2217Endpoint(rig.context, "203.0.113.9", 0)


def test_the_kernel_gives_up_a_client_that_has_vanished_whether_answers_are_on_their_way_or_not(rig):
    port, _ = rig.connected(TcpEndpoint)
    assert port._socket.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
    if hasattr(socket, "TCP_USER_TIMEOUT"):  # without it, 15 minutes of retransmission
        assert port._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 60_000


# Telnet negotiation


def sent_to(port, data):
    """What of a client's bytes goes to the radio, in pieces as TCP may cut them."""
    return b"".join(port.from_client(data[at : at + 7]) for at in range(0, len(data), 7))


def test_bytes_pass_with_ff_doubled(rig):
    port, _ = rig.connected(Rfc2217Endpoint)
    everything = bytes(range(256))
    assert sent_to(port, everything.replace(IAC, IAC + IAC)) == everything
    assert port.to_client(everything) == everything.replace(IAC, IAC + IAC)


def test_the_rate_is_answered_with_the_one_there_is(rig):
    port, client = rig.connected(Rfc2217Endpoint)
    client.recv(100)
    for rate in (9600, 115_200, 0):
        assert sent_to(port, IAC + SB + COM_PORT + b"\1" + rate.to_bytes(4, "big") + IAC + SE) == b""
        port.push()
        assert client.recv(100) == IAC + SB + COM_PORT + b"\x65" + (9600).to_bytes(4, "big") + IAC + SE
    assert port.ignored == 0


def test_purging_empties_the_buffers(rig):
    port, _ = rig.connected(Rfc2217Endpoint)
    port.port.send(b"a" * 100)
    port.deliver(b"b" * 100)
    sent_to(port, IAC + SB + COM_PORT + b"\x0c\x03" + IAC + SE)
    assert (port.port.waiting, len(port.out)) == (0, 0)


@pytest.mark.parametrize(
    "nonsense",
    [
        IAC + SE,  # the end of what has not begun
        IAC + SB + COM_PORT + b"\1" + IAC + SE,  # no rate
        IAC + SB + COM_PORT + b"\3\x63" + IAC + SE,  # parity 99
        IAC + SB + COM_PORT + b"\x0b" + IAC + SE,  # no mask
        IAC + SB + COM_PORT + bytes(100_000) + IAC + SE,
    ],
)
def test_nonsense_is_ignored_and_what_follows_passes(rig, nonsense):
    port, _ = rig.connected(Rfc2217Endpoint)
    assert sent_to(port, nonsense + b"through").endswith(b"through")
    assert port.ignored >= 1
    told = f"{port.name}: {port.client} negotiates nonsense, which is ignored"
    assert [line for line in rig.told if "nonsense" in line] == [told]


_pieces = st.one_of(
    st.binary(max_size=20),
    st.sampled_from([IAC, SB, SE, WILL, DO, IAC + SB + COM_PORT, IAC + SE, IAC + IAC, COM_PORT, b"\0"]),
)


@pytest.fixture(scope="module")
def fuzzed():
    rig = Rig()
    yield rig.connected(Rfc2217Endpoint)[0]
    rig.close()


@settings(max_examples=200)
@given(st.lists(_pieces, max_size=40))
def test_no_negotiation_raises_or_grows_without_bound(fuzzed, pieces):
    fuzzed.greet()
    data = b"".join(pieces)
    assert len(sent_to(fuzzed, data)) <= len(data)
    assert len(fuzzed._manager.suboption or b"") <= 257
    fuzzed._wire.clear()
    fuzzed._manager.mode, fuzzed._manager.suboption = rfc2217.M_NORMAL, None
    assert sent_to(fuzzed, b"55") == b"55"


def test_a_client_that_asks_without_reading_answers_is_put_out(rig):
    port, client = rig.connected(Rfc2217Endpoint)
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    port._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    ask = IAC + SB + COM_PORT + b"\7" + IAC + SE
    for _ in range(2000):
        port.from_client(ask * 100)
        port.push()
        if not port.client:
            break
    assert any("is put out: it makes answers and reads none" in line for line in rig.told)


# Pseudo-terminals


def at(port, path=None):
    """A program opens the terminal."""
    client = os.open(path or port.path, os.O_RDWR | os.O_NOCTTY)
    soon(port, lambda: port.client)
    return client


def leave(port, client):
    os.close(client)
    soon(port, lambda: not port.client)


def empty(port):
    return select.select([port._master], [], [], 0)[0] == []


def test_a_terminal_passes_all_bytes_unchanged_and_without_echo(rig, tmp_path):
    port = rig.opened(PtyEndpoint, tmp_path / "radio")
    client = at(port, tmp_path / "radio")
    everything = bytes(range(256))
    os.write(client, everything)
    assert soon(port, lambda: empty(port)) + port.receive() == everything
    port.deliver(everything)
    port.push()
    assert os.read(client, 1000) == everything
    assert port.receive() == b""
    leave(port, client)


def test_what_a_program_has_not_read_is_gone_when_the_next_one_opens_the_terminal(rig):
    port = rig.opened(PtyEndpoint, None)
    client = at(port)
    port.deliver(b"stale")
    port.push()
    leave(port, client)
    client = at(port)
    os.set_blocking(client, False)
    with pytest.raises(BlockingIOError):
        os.read(client, 100)
    os.close(client)


def test_a_program_that_writes_and_closes_at_once_is_heard(rig):
    port = rig.opened(PtyEndpoint, None)
    client = os.open(port.path, os.O_WRONLY | os.O_NOCTTY)
    os.write(client, b"short visit")
    os.close(client)
    assert soon(port, lambda: port.clients and not port.client) == b"short visit"


def test_a_full_terminal_holds_nothing_up_and_what_is_dropped_is_counted(rig):
    port = rig.opened(PtyEndpoint, None)
    client = at(port)
    for _ in range(100):
        port.deliver(bytes(4096))
        port.push()
    assert len(port.out) == 65_536
    assert port.plug().dropped > 200_000
    leave(port, client)
    assert port.plug().bytes_out + port.plug().dropped == 100 * 4096


def test_another_baud_rate_is_told_once(rig):
    termios = pytest.importorskip("termios")
    port = rig.opened(PtyEndpoint, None)
    client = at(port)
    modes = termios.tcgetattr(client)
    modes[4] = modes[5] = termios.B115200
    termios.tcsetattr(client, termios.TCSANOW, modes)
    for count in (1, 2):
        os.write(client, b"x")
        soon(port, lambda count=count: port.exchange(0) or port.bytes_in == count)
    leave(port, client)
    assert len([line for line in rig.told if "has set another baud rate; the radio has 9600" in line]) == 1


def test_a_link_is_made_and_removed_and_replaces_only_one_that_leads_nowhere(rig, tmp_path):
    link = tmp_path / "radio"
    link.symlink_to(tmp_path / "gone")
    port = PtyEndpoint(rig.context, link)
    assert os.readlink(link) == port.path
    for force in (False, True):
        with pytest.raises(BadInput, match="another session serves it; end that one, or choose another link"):
            PtyEndpoint(rig.context, link, force)
    assert os.readlink(link) == port.path
    port.close()
    assert list(tmp_path.iterdir()) == []
    link.symlink_to(os.ttyname(os.openpty()[1]))  # as a session that was killed leaves it
    with pytest.raises(BadInput, match="radio: is there already; choose another link with --pty"):
        PtyEndpoint(rig.context, link)
    other = PtyEndpoint(rig.context, link, force=True)
    assert os.readlink(link) == other.path
    other.close()
    assert list(tmp_path.iterdir()) == []
    link.write_text("years of work")
    with pytest.raises(BadInput, match="is there already"):
        PtyEndpoint(rig.context, link, force=True)
    assert link.read_text() == "years of work"


def test_a_lock_whose_file_another_session_has_just_removed_is_taken_again(tmp_path, monkeypatch):
    """Two sessions that began while a third ended had both the lock, of two files of one name."""
    fcntl = pytest.importorskip("fcntl")
    path, flock, removed = tmp_path / ".radio.lock", fcntl.flock, []

    def late(descriptor, how):
        if not removed:
            removed.append(path.unlink())
        flock(descriptor, how)

    monkeypatch.setattr(fcntl, "flock", late)
    held = terminal._locked(path)
    with pytest.raises(BlockingIOError):
        terminal._locked(path)
    os.close(held)
