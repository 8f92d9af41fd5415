"""A TCP port, with clients that behave well and badly."""

import socket
import time

import pytest

from miro_exact.bad_input import BadInput
from miro_exact.clock import ticks
from mirotwin.ports.rfc2217 import Rfc2217Endpoint
from mirotwin.ports.sockets import TcpEndpoint
from tests.mirotwin.ports.ports import connected, soon
from tests.mirotwin.ports.rig import question


def test_bytes_pass_as_they_are_both_ways(rig):
    port = rig.opened(TcpEndpoint(rig.context, "127.0.0.1", 0))
    client = connected(port)
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
    port = rig.opened(TcpEndpoint(rig.context, "127.0.0.1", 0))
    first = connected(port)
    with socket.create_connection(first.getpeername(), timeout=5) as second:
        soon(port, lambda: port.refused)
        assert second.recv(1) == b""
    first.sendall(b"x")
    got = []
    soon(port, lambda: got.append(port.receive()) or b"".join(got))
    assert b"".join(got) == b"x"
    assert any(line.endswith(f"is refused; {port.client} is there") for line in rig.told)
    first.close()


def test_a_client_that_breaks_the_connection_is_gone_and_the_next_one_is_welcome(rig):
    port = rig.opened(TcpEndpoint(rig.context, "127.0.0.1", 0))
    for _ in range(2):
        client = connected(port)
        client.sendall(question(0)[:10])  # in the middle of a frame
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        client.close()  # RST
        soon(port, lambda: not port.client)
    assert port.plug().clients == 2


def test_a_client_whose_input_is_over_gets_answers_for_half_a_second(rig):
    port = rig.opened(TcpEndpoint(rig.context, "127.0.0.1", 0))
    client = connected(port)
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
    port = rig.opened(TcpEndpoint(rig.context, "127.0.0.1", 0))
    client = connected(port)
    client.sendall(bytes(6000))
    until_s = time.monotonic() + 5
    while port.bytes_in < 4096 and time.monotonic() < until_s:
        port.exchange()
    assert (port.bytes_in, port.port.room) == (4096, 0)
    port.exchange()
    assert port.bytes_in == 4096
    assert not [
        key for key, _ in rig.selector.select(0) if key.fileobj is not port._listener
    ]  # it lets us sleep
    rig.world.run_to(ticks(3.0))
    while port.bytes_in < 6000 and time.monotonic() < until_s:
        port.exchange()
    assert port.bytes_in == 6000
    client.close()


def test_a_slow_reader_is_dropped_bytes_and_not_waited_for(rig):
    port = rig.opened(TcpEndpoint(rig.context, "127.0.0.1", 0))
    client = connected(port)
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
    port = rig.opened(TcpEndpoint(rig.context, "127.0.0.1", 0))
    number = int(port.where.rpartition(":")[2])
    with pytest.raises(
        BadInput, match=rf"--tcp {number}: 127.0.0.1: Address already in use; choose another port"
    ):
        TcpEndpoint(rig.context, "127.0.0.1", number)
    with pytest.raises(BadInput, match=r"--rfc2217 0: 203\.0\.113\.9: "):
        Rfc2217Endpoint(rig.context, "203.0.113.9", 0)


def test_the_kernel_gives_up_a_client_that_has_vanished_whether_answers_are_on_their_way_or_not(rig):
    port = rig.opened(TcpEndpoint(rig.context, "127.0.0.1", 0))
    with connected(port):
        assert port._socket is not None
        assert port._socket.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
        if hasattr(socket, "TCP_USER_TIMEOUT"):  # without it, 15 minutes of retransmission
            assert port._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 60_000
