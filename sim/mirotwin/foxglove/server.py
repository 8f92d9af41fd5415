"""A WebSocket server to which Foxglove connects: what is sent goes to whoever listens.

What belongs here: foxglove-sdk (extra `live`), its errors as ours, and channels that open with their first message.
What does not: what is sent (`derived`), and when (`cli.run_live`).

Nothing that a viewer says reaches a run. The server sends from threads of its own; a viewer that is too slow loses the
oldest messages.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterable
from importlib import import_module
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput, one_line
from miro_exact.clock import nanoseconds
from mirotwin.foxglove.derived import Said
from mirotwin.foxglove.published import schema_of

OPTION = "--live"
NAME = "mirotwin"
LOGGER = "foxglove"
"""Name of the SDK's logger in Python; who wants to see what it has to say gives it a handler."""
QUIET_S = 0.2
"""After so long without a new subscription a viewer has all that it wants."""
LINGER_S = 0.5
"""The SDK forgets at its end what it has not sent yet, and does not say how much that is."""


class Server:
    """Listens at `host`, `port` (0: any that is free). Raises BadInput where that cannot be done.

    `session` names the run, so that a viewer that comes again knows whether it is another one.
    """

    def __init__(self, host: str, port: int, session: str) -> None:
        try:
            self._sdk = import_module("foxglove")
            capability = import_module("foxglove.websocket").Capability
        except ImportError:
            raise BadInput(
                "", OPTION, "foxglove-sdk is not installed", "pip install 'mirotwin[live]'"
            ) from None
        logging.getLogger(LOGGER).addHandler(logging.NullHandler())  # stderr is for our own lines
        self._context = self._sdk.Context()
        self._channels: dict[str, Any] = {}
        self._encode = msgspec.json.Encoder().encode
        self._asked = threading.Event()
        try:
            self._server = self._sdk.start_server(
                name=NAME,
                host=host,
                port=port,
                capabilities=[capability.Time],  # virtual time, not the viewer's clock
                context=self._context,
                server_listener=_Listener(self._asked.set),
                session_id=session,
            )
        except (RuntimeError, OSError, ValueError) as error:
            what = one_line(f"cannot listen at {host}:{port}: {error}".replace("FoxgloveError: ", ""))
            remedy = "choose another place, --live=HOST:PORT; port 0 is any that is free"
            raise BadInput("", OPTION, what, remedy) from None
        self.url = f"ws://{f'[{host}]' if ':' in host else host}:{self._server.port}"

    def __enter__(self) -> Server:
        return self

    def __exit__(self, kind: object, *error: object) -> None:
        try:
            if kind is None and any(channel.has_sinks() for channel in self._channels.values()):
                threading.Event().wait(LINGER_S)
        finally:
            self._server.stop()

    def open(self, said: Iterable[Said]) -> None:
        """Tells viewers of the topics of these messages, which are sent later."""
        for one in said:
            self._channel(one)

    def wait_for_viewer(self) -> None:
        """Until somebody has asked for topics."""
        while not self._asked.wait(QUIET_S):  # in pieces, for Ctrl-C
            pass
        while self._asked.is_set():
            self._asked.clear()
            self._asked.wait(QUIET_S)

    def tell_time(self, tick: int) -> None:
        """Now is `tick`."""
        self._server.broadcast_time(nanoseconds(tick))

    def send(self, said: Said) -> None:
        """To whoever listens to its topic."""
        channel = self._channel(said)
        if channel.has_sinks():
            channel.log(self._encode(said.message), log_time=nanoseconds(said.tick))

    def _channel(self, said: Said) -> Any:
        found = self._channels.get(said.topic)
        if found is None:
            name, text = schema_of(said.message)
            schema = self._sdk.Schema(name=name, encoding="jsonschema", data=text)
            found = self._sdk.Channel(
                said.topic, schema=schema, message_encoding="json", context=self._context
            )
            self._channels[said.topic] = found
        return found


class _Listener:
    """Called by the server's threads; `asked` has to be content with that."""

    def __init__(self, asked: Callable[[], None]) -> None:
        self._asked = asked

    def on_subscribe(self, client: object, channel: object) -> None:
        self._asked()

    def on_unsubscribe(self, client: object, channel: object) -> None:
        """Nobody waits for that."""
