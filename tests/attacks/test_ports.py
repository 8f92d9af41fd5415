"""Ports: who connects, says nothing, reads nothing or comes from elsewhere changes no run and holds none up."""

import contextlib
import signal
import socket
import struct
import threading
import time

import pytest
import websocket

from mirotwin.report.foxglove import derived, server
from mirotwin.report.foxglove.messages import ALWAYS, INFO, Log
from mirotwin.report.foxglove.server import MOST_CONNECTIONS, PROTOCOLS, Server
from tests.mirotwin.conftest import SHORT
from tests.mirotwin.report.foxglove.client import live as live_run

HERE = "127.0.0.1"
PATIENCE_S = 10.0
SOON_S = 20.0
"""A run of 0.2 s, and the second that viewers have at its end, on a machine that is busy."""


def address_of(url):
    host, _, port = url.removeprefix("ws://").rpartition(":")
    return host, int(port)


def asked(url, host=None, origin=None):
    """The status line for a handshake with these headers."""
    with socket.create_connection(address_of(url), PATIENCE_S) as connection:
        lines = ["GET / HTTP/1.1", f"Host: {host or url.removeprefix('ws://')}", "Upgrade: websocket"]
        lines += [
            "Connection: Upgrade",
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
            "Sec-WebSocket-Version: 13",
        ]
        lines += [f"Sec-WebSocket-Protocol: {PROTOCOLS[0]}", *([f"Origin: {origin}"] if origin else [])]
        connection.sendall("\r\n".join([*lines, "", ""]).encode())
        return connection.recv(4096).split(b"\r\n")[0].decode()


def viewer(url, **named):
    return websocket.create_connection(url, subprotocols=PROTOCOLS[:1], timeout=PATIENCE_S, **named)


@pytest.fixture
def live():
    with Server(HERE, 0, "attacked") as found:
        found.open([said("first")])
        yield found


def said(text):
    return derived.log(0, Log(ALWAYS, INFO, text, ""))


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "https://elsewhere.example"},
        {"origin": "http://app.foxglove.dev"},
        {"origin": "https://app.foxglove.dev.elsewhere.example"},
        {"origin": "null"},
        {"origin": "http://localhost.elsewhere.example"},
        {"origin": "https://10.0.0.1"},
        {"host": "rebound.example"},
        {"host": "rebound.example:8765"},
        {"host": "127.0.0.1.rebound.example"},
        {"host": "["},
        {"host": "evil@localhost"},
        {"host": "localhost/elsewhere"},
        {"host": "localhost:x"},
        {"host": "192.168.1.5"},
        {"host": "0.0.0.0"},
        {"origin": "http://evil@localhost"},
        {"origin": "elsewhere://localhost"},
        {"origin": "http://localhost/elsewhere"},
        {"origin": "http://rebound.example", "host": "rebound.example"},
        {"host": "rebound.example", "origin": "https://app.foxglove.dev"},
    ],
)
def test_a_page_of_elsewhere_and_a_name_of_elsewhere_are_refused(live, headers):
    assert asked(live.url, **headers) == "HTTP/1.1 403 Forbidden"


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"origin": "https://app.foxglove.dev"},
        {"origin": "file://"},
        {"origin": "http://localhost:8080"},
        {"origin": "http://[::1]:8080"},
        {"host": "localhost"},
        {"host": "[::1]:8765"},
    ],
)
def test_foxglove_and_pages_of_this_machine_may_watch(live, headers):
    assert asked(live.url, **headers).startswith("HTTP/1.1 101")


def test_connections_beyond_the_limit_are_closed_at_once_and_free_places_are_taken_again(live):
    with contextlib.ExitStack() as opened:
        idle = [opened.enter_context(socket.create_connection(address_of(live.url))) for _ in range(50)]
        time.sleep(0.5)
        for one in idle:
            one.setblocking(False)
        open_ones = [one for one in idle if _is_open(one)]
        assert len(open_ones) == MOST_CONNECTIONS
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        with contextlib.suppress(OSError, websocket.WebSocketException):
            viewer(live.url).close()
            return
    raise AssertionError("no place became free")


def test_connections_that_never_ask_keep_no_viewer_out(live):
    with contextlib.ExitStack() as opened:
        for _ in range(2 * MOST_CONNECTIONS):
            opened.enter_context(socket.create_connection(address_of(live.url)))
        for _ in range(MOST_CONNECTIONS):
            opened.enter_context(contextlib.closing(viewer(live.url)))
        with pytest.raises((OSError, websocket.WebSocketException)):
            viewer(live.url)


def test_what_is_told_of_refused_connections_is_bounded_and_told_while_the_run_goes():
    told = []
    with Server(HERE, 0, "attacked", told.append) as live:
        for number in range(2 * server.MOST_NOTES):
            asked(live.url, origin=f"https://{number}.example")
        live.tell_time(0)
        assert len(told) == server.MOST_NOTES
    assert told[0] == "--live: a connection was refused: Origin https://0.example"
    assert told[-1] == "--live: more refused connections are not told"
    assert len(told) == server.MOST_NOTES


def test_a_viewer_that_asks_all_the_time_keeps_the_run_from_nothing(live):
    """Before: 21,000 subscriptions ended in a request, again and again, let the run send 8 messages a second."""
    ended = '{"op":"unsubscribe","subscriptionIds":[' + ",".join(["99"] * 21_000) + "]}"
    live.open([derived.Said(f"/{number}", 0, said("").message) for number in range(60)])
    one = viewer(live.url)
    wanted = ",".join(f'{{"id":{number},"channelId":{number}}}' for number in range(1, 60))
    one.send(f'{{"op":"subscribe","subscriptions":[{wanted}]}}')
    flood = threading.Thread(target=_flood, args=(one, ended), daemon=True)
    flood.start()
    time.sleep(0.2)
    end_s, count = time.monotonic() + 0.5, 0
    while time.monotonic() < end_s:
        live.send(said("to you"))
        count += 1
        time.sleep(0.001)
    one.sock.close()
    flood.join(PATIENCE_S)
    assert count > 40


def _flood(connection, text):
    with contextlib.suppress(OSError, websocket.WebSocketException, AttributeError):
        while True:
            connection.send(text)


def _is_open(connection):
    try:
        return bool(connection.recv(1))
    except BlockingIOError:
        return True
    except OSError:
        return False


def test_a_handshake_that_does_not_end_is_closed(monkeypatch):
    monkeypatch.setattr(server, "HANDSHAKE_S", 0.3)
    with (
        Server(HERE, 0, "attacked") as live,
        socket.create_connection(address_of(live.url), PATIENCE_S) as connection,
    ):
        connection.sendall(b"GET / HTTP/1.1\r\nHost:")
        assert connection.recv(100) == b""


def test_a_viewer_that_reads_nothing_is_put_out_and_has_a_bounded_queue(monkeypatch):
    monkeypatch.setattr(server, "QUEUE_BYTES", 1 << 20)
    monkeypatch.setattr(server, "STALLED_S", 0.3)
    notes = []
    with Server(HERE, 0, "attacked", notes.append) as live:
        live.open([said("first")])
        deaf = viewer(live.url, sockopt=[(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)])
        deaf.send('{"op":"subscribe","subscriptions":[{"id":7,"channelId":1}]}')
        live.wait_for_viewer()
        large = said("x" * 100_000)
        (inside,) = live._viewers
        end_s = time.monotonic() + PATIENCE_S
        while live._viewers and time.monotonic() < end_s:
            live.send(large)
            assert inside.size <= (1 << 20) + 100_000
            time.sleep(0.001)
        assert not live._viewers
        deaf.close()
    assert notes == ["--live: a viewer was put out: it took nothing for 0.3 s"]


@pytest.mark.parametrize(
    "message",
    [
        "",
        "{",
        "[]",
        '{"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]}',
        '{"op":"subscribe","subscriptions":[{"id":99999999999999999999,"channelId":1}]}',
        '{"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]}',
        '{"op":"unsubscribe","subscriptionIds":[1,2,3]}',
        '{"op":"subscribe","subscriptions":' + "[" * 10_000 + "]" * 10_000 + "}",
        "x" * 100_000,
    ],
)
def test_whatever_a_viewer_says_others_are_served(live, message):
    with contextlib.suppress(websocket.WebSocketException, OSError):
        bad = viewer(live.url)
        bad.send(message)
        bad.send_binary(message.encode())
    good = viewer(live.url)
    good.send('{"op":"subscribe","subscriptions":[{"id":5,"channelId":1}]}')
    live.wait_for_viewer()
    live.send(said("to you"))
    received = b""
    while b"to you" not in received:
        received = good.recv()
        received = received.encode() if isinstance(received, str) else received
    assert struct.unpack_from("<BI", received) == (1, 5)
    good.close()


@pytest.fixture
def short(tmp_path):
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.mark.parametrize("ended_by", [None, signal.SIGINT, signal.SIGTERM])
def test_a_run_ends_whoever_still_holds_a_connection(short, tmp_path, ended_by):
    pace = "max" if ended_by is None else "0.01"
    with (
        live_run(short, "--out", tmp_path / "out", "--pace", pace, "-q") as (process, url),
        socket.create_connection(address_of(url)),
        contextlib.ExitStack() as opened,
    ):
        with contextlib.suppress(websocket.WebSocketException, OSError):
            deaf = opened.enter_context(contextlib.closing(viewer(url)))
            deaf.send('{"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]}')
        if ended_by is not None:
            process.send_signal(ended_by)
        assert process.wait(SOON_S) == {None: 0, signal.SIGINT: 130, signal.SIGTERM: 143}[ended_by]
