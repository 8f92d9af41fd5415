"""Commands on standard input with which a session's user puts and reads values of a board's parts.

eyes.distance_cm = 30      puts a value, as a test does; it is recorded and replayed
lcd.text                   shows a value
?                          shows all values, and those that can be put
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from selectors import EVENT_READ, BaseSelector

from miro_protocol.actions import put_of
from miro_sim.world.device import Device
from miro_sim.world.wire import BoardAlone
from miro_sim.world.world import World

CHUNK_BYTES = 4096
LONGEST_LINE = 1000


class PutLines:
    """Executes the command lines of `descriptor` on the parts of `world`'s board.

    `show` gets values, `tell` error messages.
    """

    def __init__(
        self,
        world: World,
        descriptor: int,
        selector: BaseSelector,
        show: Callable[[str], object],
        tell: Callable[[str], object],
    ) -> None:
        self.world = world
        self.device: Device = world.devices[0]
        self.show = show
        self.tell = tell
        self._descriptor = descriptor
        self._selector = selector
        self._rest = b""
        self._is_open = True
        self._watched = False
        with suppress(OSError, ValueError):  # a file, which is there at once
            selector.register(descriptor, EVENT_READ)
            self._watched = True

    def exchange(self, at_tick: int) -> None:
        """Does the lines that have come, at this tick or as soon as can be."""
        for line in self._lines():
            try:
                self.do(line.decode(errors="replace").strip(), at_tick)
            except ValueError as error:
                self.tell(f"{error}")

    def do(self, line: str, at_tick: int = 0) -> None:
        """Does one line. Raises ValueError: reason; remedy."""
        if line == "?":
            self._list()
        elif "=" in line:
            tick = max(at_tick, self.world.earliest_action_tick)
            self.world.do(put_of(tick, self.device.network, self.device.slot, line))
        elif line:
            self.show(f"{line} = {self.device.value(line)!r}")

    def _list(self) -> None:
        for path, value in self.device.values().items():
            self.show(f"{path} = {value!r}")
        keys = self.device.parts if isinstance(self.device, BoardAlone) else {}
        puts = [f"{name}.{key}" for name, part in keys.items() for key in part.PUTS]
        self.show(f"put {', '.join(puts)}" if puts else "nothing can be put")

    def _lines(self) -> list[bytes]:
        if not self._is_open or not self._is_ours():
            return []
        try:
            data = os.read(self._descriptor, CHUNK_BYTES)
        except BlockingIOError:
            return []
        except OSError:
            data = b""
        if not data:
            self.close()
        *lines, self._rest = (self._rest + data).split(b"\n")
        self._rest = self._rest[:LONGEST_LINE]
        return lines

    def _is_ours(self) -> bool:
        """True if there is something to read, and at a terminal this process may: one in the background would stop."""
        import select

        if not select.select([self._descriptor], [], [], 0)[0]:
            return False
        return not os.isatty(self._descriptor) or os.tcgetpgrp(self._descriptor) == os.getpgrp()

    def close(self) -> None:
        self._is_open = False
        if self._watched:
            self._watched = False
            self._selector.unregister(self._descriptor)


def lines_of_stdin(
    world: World, selector: BaseSelector, show: Callable[[str], object], tell: Callable[[str], object]
) -> PutLines | None:
    """The command lines of standard input, for a board with parts; None without parts or without input to read."""
    device = world.devices[0]
    if not (isinstance(device, BoardAlone) and device.parts):
        return None
    try:
        descriptor = sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):  # closed, or no file
        return None
    return PutLines(world, descriptor, selector, show, tell)
