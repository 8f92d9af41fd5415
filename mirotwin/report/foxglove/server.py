"""A WebSocket server to which Foxglove connects: what is sent goes to whoever listens.

    world's thread    send() ──► each viewer's queue ──┐
    server's thread                                    └──► WebSocket ──► viewer

Nothing that a viewer says reaches a run. A viewer that is too slow loses the oldest messages, and one that takes
nothing is put out. The end waits for no viewer longer than LINGER_S.
"""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import os
import re
import socket
import struct
import threading
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from importlib import import_module
from typing import Annotated, Any

import msgspec

from miro_exact.bad_input import BadInput, one_line
from miro_exact.clock import nanoseconds
from mirotwin.report.foxglove.derived import Said
from mirotwin.report.foxglove.published import schema_of

OPTION = "--live"
NAME = "mirotwin"
PROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
ORIGINS = ("https://app.foxglove.dev", "https://studio.foxglove.dev", "file://")
"""Foxglove's own, in a browser and as an application. Pages of this machine (localhost) may connect too."""
QUIET_S = 0.2
"""After so long without a new subscription a viewer has all that it wants."""
LINGER_S = 1.0
"""So long the end waits for viewers to take what is left."""
HANDSHAKE_S = 3.0
STALLED_S = 3.0
"""A viewer that takes nothing for so long is put out."""
MOST_CONNECTIONS = 16
QUEUE_BYTES = 4 << 20
LARGEST_REQUEST = 64 << 10
REQUEST_S = 0.01
"""A viewer's next request is read after so long, so that none keeps the run from its processor."""
MOST_NOTES = 20
_AUTHORITY = re.compile(r"(\[[0-9a-fA-F:.]+\]|[a-zA-Z0-9._-]+)(:[0-9]{1,5})?")
_MESSAGE, _TIME = struct.Struct("<BIQ"), struct.Struct("<BQ")
_JSON = msgspec.json.Encoder()


class Server:
    """Listens at `host`, `port` (0: any that is free). Raises BadInput where that cannot be done.

    `session` names the run, so that a viewer that comes again knows whether it is another one. `tell` gets a line for
    each viewer that is put out or refused, MOST_NOTES in all, in the world's thread.
    """

    def __init__(self, host: str, port: int, session: str, tell: Callable[[str], None] | None = None) -> None:
        try:
            self._websockets = import_module("websockets.asyncio.server")
            self._closed: type[Exception] = import_module("websockets.exceptions").ConnectionClosed
        except ImportError:
            what, remedy = "websockets is not installed", "pip install 'mirotwin[live]'"
            raise BadInput("", OPTION, what, remedy) from None
        self._host = host
        self._tell = tell
        self._info = _text({"op": "serverInfo", "name": NAME, "capabilities": ["time"], "sessionId": session})
        self._channels: dict[str, _Channel] = {}
        self._viewers: set[_Viewer] = set()
        self._open: dict[Any, None] = {}
        self._notes: list[str] = []
        self._told = 0
        self._lock = threading.Lock()
        self._asked = threading.Event()
        self._loop = asyncio.new_event_loop()
        try:
            self._server = self._loop.run_until_complete(self._listen(port))
        except (OSError, ValueError) as error:
            self._loop.close()
            what = one_line(f"cannot listen at {host}:{port}: {getattr(error, 'strerror', '') or error}")
            remedy = "choose another place, --live=HOST:PORT; port 0 is any that is free"
            raise BadInput("", OPTION, what, remedy) from None
        names = [one.getsockname() for one in self._server.sockets]
        bound = names[0][1]
        self._is_local = all(_is_loopback(name[0]) for name in names)
        self.url = f"ws://{f'[{host}]' if ':' in host else host}:{bound}"
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        """The server's thread."""
        self._loop.run_forever()
        left = asyncio.all_tasks(self._loop)
        for task in left:
            task.cancel()
        if left:
            self._loop.run_until_complete(asyncio.wait(left, timeout=LINGER_S))
        self._loop.close()

    async def _listen(self, port: int) -> Any:
        logger = logging.getLogger(f"{NAME}.live")  # stderr is for our own lines
        logger.addHandler(logging.NullHandler())
        logger.propagate = False
        return await self._websockets.serve(
            self._serve,
            self._host,
            port,
            subprotocols=PROTOCOLS,
            process_request=self._refusal,
            create_connection=self._connection(),
            compression=None,
            open_timeout=HANDSHAKE_S,
            close_timeout=LINGER_S / 2,
            max_size=LARGEST_REQUEST,
            server_header=None,
            logger=logger,
            reuse_address=os.name == "posix",  # on Windows this would share the port with another program
        )

    def _connection(self) -> type:
        """The library's class, which counts connections from the first byte on: also those that never ask.

        Where there are too many, the oldest that has not asked yet makes room.
        """
        server = self

        class Counted(self._websockets.ServerConnection):  # type: ignore[name-defined, misc]
            has_asked = False

            def connection_made(self, transport: Any) -> None:
                super().connection_made(transport)
                server._open[self] = None
                if len(server._open) > MOST_CONNECTIONS:
                    server._note(f"a connection was refused: {MOST_CONNECTIONS} are open")
                    oldest = next(one for one in server._open if not one.has_asked)
                    del server._open[oldest]
                    oldest.transport.abort()

            def connection_lost(self, error: Exception | None) -> None:
                server._open.pop(self, None)
                super().connection_lost(error)

        return Counted

    def _refusal(self, connection: Any, request: Any) -> Any:
        """An answer to a page of elsewhere, and to who came by a name of elsewhere; None for others."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        name = _host_name(hosts[0]) if len(hosts) == 1 else ""
        if not self._is_ours(name):
            return self._refused(connection, "Host", hosts)
        if len(origins) > 1 or (origins and not _may_watch(origins[0], name)):
            return self._refused(connection, "Origin", origins)
        return None

    def _refused(self, connection: Any, header: str, found: list[str]) -> Any:
        self._note(one_line(f"a connection was refused: {header} {', '.join(found)[:100] or 'is missing'}"))
        return connection.respond(403, f"Not for this {header}.\n")

    def _is_ours(self, name: str) -> bool:
        """A name in DNS may lead anywhere; an address cannot."""
        if name == self._host.lower() or _is_loopback(name):
            return True
        return not self._is_local and (name == socket.gethostname().lower() or _is_address(name))

    def _note(self, line: str) -> None:
        if line not in self._notes and len(self._notes) < MOST_NOTES:
            last = len(self._notes) == MOST_NOTES - 1
            self._notes.append("more refused connections are not told" if last else line)

    def _tell_notes(self) -> None:
        while self._tell is not None and self._told < len(self._notes):
            self._tell(f"{OPTION}: {self._notes[self._told]}")
            self._told += 1

    async def _serve(self, connection: Any) -> None:
        connection.has_asked = True
        viewer = _Viewer(connection, self._loop)
        with self._lock:
            viewer.put_text(self._info)
            if self._channels:
                viewer.put_text(_advertised(self._channels.values()))
            self._viewers.add(viewer)
        sending = asyncio.create_task(self._send_to(viewer))
        try:
            with suppress(self._closed):
                async for request in connection:
                    if isinstance(request, str):
                        self._heard(viewer, request)
                    await asyncio.sleep(REQUEST_S)
        finally:
            with self._lock:
                self._viewers.discard(viewer)
            sending.cancel()
            await asyncio.wait([sending])

    async def _send_to(self, viewer: _Viewer) -> None:
        while True:
            with self._lock:
                data = viewer.take()
            if data is None:
                await viewer.more.wait()
                continue
            try:
                await asyncio.wait_for(viewer.connection.send(data), STALLED_S)
            except self._closed:
                return
            except TimeoutError:
                self._note(f"a viewer was put out: it took nothing for {STALLED_S:g} s")
                viewer.connection.transport.abort()
                return

    def _heard(self, viewer: _Viewer, request: str) -> None:
        """Subscriptions; whatever else a viewer says is left alone."""
        try:
            asked = msgspec.json.decode(request, type=_Request)
        except (msgspec.DecodeError, RecursionError):
            return
        ended = set(asked.ended)
        with self._lock:
            for one in asked.subscriptions:
                if 1 <= one.channel <= len(self._channels):
                    viewer.wanted[one.channel] = one.id
            viewer.wanted = {channel: one for channel, one in viewer.wanted.items() if one not in ended}
        if asked.subscriptions:
            self._asked.set()

    def __enter__(self) -> Server:
        return self

    def __exit__(self, kind: object, *error: object) -> None:
        with suppress(TimeoutError):
            asyncio.run_coroutine_threadsafe(self._close(kind is None), self._loop).result(3 * LINGER_S)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(LINGER_S)
        self._tell_notes()

    async def _close(self, linger: bool) -> None:
        end_s = self._loop.time() + LINGER_S * linger
        while self._loop.time() < end_s and any(not viewer.is_done() for viewer in self._viewers):
            await asyncio.sleep(0.01)
        self._server.close()
        with suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self._server.wait_closed(), LINGER_S)

    def open(self, said: Iterable[Said]) -> None:
        """Tells viewers of the topics of these messages, which are sent later."""
        for one in said:
            self._channel(one)

    def wait_for_viewer(self) -> None:
        """Until somebody has asked for topics."""
        while not self._asked.wait(QUIET_S):  # in pieces, for Ctrl-C
            self._tell_notes()
        while self._asked.is_set():
            self._asked.clear()
            self._asked.wait(QUIET_S)

    def tell_time(self, tick: int) -> None:
        """Now is `tick`."""
        self._tell_notes()
        data = _TIME.pack(2, nanoseconds(tick))
        with self._lock:
            for viewer in self._viewers:
                viewer.put(data)

    def send(self, said: Said) -> None:
        """To whoever listens to its topic."""
        number = self._channel(said).number
        with self._lock:
            wanting = [viewer for viewer in self._viewers if number in viewer.wanted]
            if wanting:
                body = _JSON.encode(said.message)
            for viewer in wanting:
                viewer.put(_MESSAGE.pack(1, viewer.wanted[number], nanoseconds(said.tick)) + body)

    def _channel(self, said: Said) -> _Channel:
        found = self._channels.get(said.topic)
        if found is None:
            name, text = schema_of(said.message)
            found = _Channel(len(self._channels) + 1, said.topic, name, text.decode())
            with self._lock:
                self._channels[said.topic] = found
                for viewer in self._viewers:
                    viewer.put_text(_advertised([found]))
        return found


class _Channel(msgspec.Struct, frozen=True):
    number: int
    topic: str
    schema_name: str
    schema: str


_Id = Annotated[int, msgspec.Meta(ge=0, le=0xFFFF_FFFF)]


class _Subscription(msgspec.Struct):
    id: _Id
    channel: _Id = msgspec.field(name="channelId")


class _Request(msgspec.Struct):
    op: str
    subscriptions: list[_Subscription] = []
    ended: list[_Id] = msgspec.field(name="subscriptionIds", default_factory=list)


class _Viewer:
    """One connection. `wanted`: its subscription of each channel; `queue`: what it has not taken yet, `size` bytes."""

    def __init__(self, connection: Any, loop: asyncio.AbstractEventLoop) -> None:
        self.connection = connection
        self.loop = loop
        self.more = asyncio.Event()
        self.wanted: dict[int, int] = {}
        self.queue: deque[bytes | str] = deque()
        self.size = 0
        self.sending = False

    def put_text(self, text: str) -> None:
        """What it has to know: never dropped."""
        self._put(text)

    def put(self, data: bytes) -> None:
        """A message; the oldest ones go where it would be too much."""
        self._put(data)
        while self.size > QUEUE_BYTES and isinstance(self.queue[0], bytes):
            self.size -= len(self.queue.popleft())

    def _put(self, data: bytes | str) -> None:
        self.queue.append(data)
        self.size += len(data)
        if len(self.queue) == 1:
            with suppress(RuntimeError):  # the loop has ended
                self.loop.call_soon_threadsafe(self.more.set)

    def take(self) -> bytes | str | None:
        """The next one, None where there is nothing."""
        try:
            data = self.queue.popleft()
        except IndexError:
            self.sending = False
            self.more.clear()
            return None
        self.size -= len(data)
        self.sending = True
        return data

    def is_done(self) -> bool:
        return not self.queue and not self.sending and not self.connection.transport.get_write_buffer_size()


def _advertised(channels: Iterable[_Channel]) -> str:
    found = [
        {
            "id": one.number,
            "topic": one.topic,
            "encoding": "json",
            "schemaName": one.schema_name,
            "schema": one.schema,
            "schemaEncoding": "jsonschema",
        }
        for one in channels
    ]
    return _text({"op": "advertise", "channels": found})


def _text(what: dict[str, Any]) -> str:
    return _JSON.encode(what).decode()


def _may_watch(origin: str, host: str) -> bool:
    """Foxglove, pages of this machine, and pages from where `host` is."""
    scheme, _, rest = origin.partition("://")
    name = _host_name(rest)
    return origin in ORIGINS or (scheme in ("http", "https") and (name == host or _is_loopback(name)))


def _host_name(host: str) -> str:
    """Of NAME, NAME:PORT or [ADDRESS]:PORT; empty for anything else."""
    found = _AUTHORITY.fullmatch(host)
    return found[1].strip("[]").lower() if found else ""


def _is_loopback(name: str) -> bool:
    return name == "localhost" or (_is_address(name) and ipaddress.ip_address(name).is_loopback)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
