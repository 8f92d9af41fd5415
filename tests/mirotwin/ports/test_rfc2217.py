"""A port with telnet negotiation, with clients that talk sense and nonsense."""

import socket

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from serial import rfc2217

from mirotwin.ports.rfc2217 import Rfc2217Endpoint
from tests.mirotwin.ports.ports import Rig, connected

IAC, SB, SE, WILL, DO = b"\xff", b"\xfa", b"\xf0", b"\xfb", b"\xfd"
COM_PORT = b"\x2c"


def sent_to(port, data):
    """What of a client's bytes goes to the radio, in pieces as TCP may cut them."""
    return b"".join(port.heard_from(data[at : at + 7]) for at in range(0, len(data), 7))


def test_bytes_pass_with_ff_doubled(rig):
    port = rig.opened(Rfc2217Endpoint(rig.context, "127.0.0.1", 0))
    client = connected(port)
    everything = bytes(range(256))
    assert sent_to(port, everything.replace(IAC, IAC + IAC)) == everything
    assert port.said_to(everything) == everything.replace(IAC, IAC + IAC)
    client.close()


def test_the_rate_is_answered_with_the_one_there_is(rig):
    port = rig.opened(Rfc2217Endpoint(rig.context, "127.0.0.1", 0))
    client = connected(port)
    client.recv(100)
    for rate in (9600, 115_200, 0):
        assert sent_to(port, IAC + SB + COM_PORT + b"\1" + rate.to_bytes(4, "big") + IAC + SE) == b""
        port.push()
        assert client.recv(100) == IAC + SB + COM_PORT + b"\x65" + (9600).to_bytes(4, "big") + IAC + SE
    assert port.ignored == 0
    client.close()


def test_purging_empties_the_buffers(rig):
    port = rig.opened(Rfc2217Endpoint(rig.context, "127.0.0.1", 0))
    client = connected(port)
    port.port.send(b"a" * 100)
    port.deliver(b"b" * 100)
    sent_to(port, IAC + SB + COM_PORT + b"\x0c\x03" + IAC + SE)
    assert (port.port.waiting, len(port.out)) == (0, 0)
    client.close()


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
    port = rig.opened(Rfc2217Endpoint(rig.context, "127.0.0.1", 0))
    client = connected(port)
    assert sent_to(port, nonsense + b"through").endswith(b"through")
    assert port.ignored >= 1
    assert [line for line in rig.told if "nonsense" in line] == [
        f"{port.name}: {port.client} negotiates nonsense, which is ignored"
    ]
    client.close()


_pieces = st.one_of(
    st.binary(max_size=20),
    st.sampled_from([IAC, SB, SE, WILL, DO, IAC + SB + COM_PORT, IAC + SE, IAC + IAC, COM_PORT, b"\0"]),
)


@pytest.fixture(scope="module")
def fuzzed():
    found = Rig()
    yield found
    found.close()


@settings(max_examples=200)
@given(st.lists(_pieces, max_size=40))
def test_no_negotiation_raises_or_grows_without_bound(fuzzed, pieces):
    if not fuzzed.open:
        fuzzed.opened(Rfc2217Endpoint(fuzzed.context, "127.0.0.1", 0))
        fuzzed.client = connected(fuzzed.open[0])
    port = fuzzed.open[0]
    assert isinstance(port, Rfc2217Endpoint)
    port.greet()
    data = b"".join(pieces)
    assert len(sent_to(port, data)) <= len(data)
    assert len(port._manager.suboption or b"") <= 257
    port._wire.clear()
    port._manager.mode, port._manager.suboption = rfc2217.M_NORMAL, None
    assert sent_to(port, b"55") == b"55"


def test_a_client_that_asks_without_reading_answers_is_put_out(rig):
    port = rig.opened(Rfc2217Endpoint(rig.context, "127.0.0.1", 0))
    client = connected(port)
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    assert port._socket is not None
    port._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    ask = IAC + SB + COM_PORT + b"\7" + IAC + SE
    for _ in range(2000):
        port.heard_from(ask * 100)
        port.push()
        if not port.client:
            break
    assert any("is put out: it makes answers and reads none" in line for line in rig.told)
    client.close()
