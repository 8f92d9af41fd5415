"""Robots behind a serial port of this PC: characters go out at a tick, and come in with the tick of their arrival.

    with RobotPort("/dev/ttyUSB0", MotionLimits()) as port:
        port.run_to(port.tick + 24_000)        waits, and reads what comes
        port.send(data)                        now; tick of the first start bit
        port.answers                           valid answers so far
                                               at the end, whatever happened: stop frames

Ticks count from the opening, 24 in a microsecond of the wall clock. `miro://` without `realtime` has its own clock.
"""

from __future__ import annotations

import errno
import select
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import TracebackType
from typing import Any, NamedTuple

import serial

from miro_exact.bad_input import BadInput
from miro_exact.clock import HOST_CHARACTER_TICKS, TICKS_PER_SECOND
from miro_protocol.decoder import TelemetryDecoder
from miro_protocol.events import Event, Received
from miro_protocol.transmission import DOWN, UP, Transmission, character_ticks
from mirotwin.desk.guard import Guard, MotionLimits

BAUD = 9600
BLOCKED_S = 1.0
"""A port that takes no characters for so long is blocked: its buffers are full, and nobody empties them."""
LOOK_S = 0.001
"""How often a port is looked at that cannot be waited for (`rfc2217://`)."""
READ_BYTES = 4096
CUT_TICKS = TICKS_PER_SECOND // 10
"""What came so long before is no part of an answer that goes on now; USB adapters keep characters for 16 ms."""
REOPENINGS = 3
_REMEDIES = {
    errno.ENOENT: ("there is no such port", "`python -m serial.tools.list_ports` lists those there are"),
    errno.EACCES: ("no permission to open it", "join the group that owns it (dialout), and log in again"),
    errno.EBUSY: ("another program has it open", "end that program first"),
}


class PortError(BadInput):
    """A port that cannot be opened, or is there no more."""


class TimedFrame(NamedTuple):
    """A valid answer, whole at `tick`."""

    tick: int
    frame: Received


class RobotPort:
    """An open port. Use as a context manager. `limits`: what may be sent; `name`: of what is sent, in errors.

    `sent`: as it went out; `received`: whole answers and characters between them, as they came; `late_ticks`: how late
    each transmission of a schedule was. `listener` is given the characters as they come, and when.
    """

    def __init__(self, url: str, limits: MotionLimits, name: str = "") -> None:
        self.url = url
        self.guard = Guard(limits, name)
        self.sent: list[Transmission] = []
        self.received: list[Transmission] = []
        self.answers: list[TimedFrame] = []
        self.late_ticks: list[int] = []
        self.free_tick = 0
        self.stopped = False
        self.listener: Callable[[bytes, int], object] = lambda data, now: None
        self._decoder = TelemetryDecoder()
        self._heard_tick = 0
        self._began_ns = time.monotonic_ns()
        self._open()

    def _open(self) -> None:
        self._serial: Any = _opened(self.url)
        self._virtual = getattr(self._serial, "virtual_tick", None) is not None
        self._descriptor: int | None = None
        if not self._virtual:
            with suppress(OSError, ValueError, AttributeError):
                self._descriptor = self._serial.fileno()

    def __enter__(self) -> RobotPort:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with _undisturbed():
            self.stop()
            with suppress(serial.SerialException, OSError):
                self._serial.close()

    @property
    def tick(self) -> int:
        """Now."""
        if self._virtual:
            return int(self._serial.virtual_tick)
        return (time.monotonic_ns() - self._began_ns) * 24 // 1000

    # ---- sending -----------------------------------------------------------------------------------------

    def send(self, data: bytes, place: str = "", due_tick: int | None = None) -> Transmission:
        """Sends now what the guard allows; it was due at `due_tick`. Raises BadInput, PortError."""
        self.guard.check(data, place)
        tick = self.tick
        with self._told():
            self._serial.write(data)
        if due_tick is not None:
            self.late_ticks.append(max(0, tick - due_tick))
        sent = Transmission(max(tick, self.free_tick), DOWN, data)
        self.free_tick = sent.end_tick
        self.sent.append(sent)
        return sent

    def stop(self) -> None:
        """Takes back what waits, and tells all robots to stand. A lost port is opened again for it, if it can be."""
        self.stopped = False
        frames = self.guard.stop_frames()
        for _ in range(REOPENINGS):
            with suppress(serial.SerialException, OSError, PortError):
                if not self._serial.is_open:
                    self._open()
                self._serial.reset_output_buffer()
                self._serial.write(frames)
                if not self._virtual:
                    time.sleep(len(frames) * HOST_CHARACTER_TICKS / TICKS_PER_SECOND)
                self.stopped = True
                return
            with suppress(serial.SerialException, OSError):
                self._serial.close()
            time.sleep(LOOK_S)

    # ---- waiting and reading -----------------------------------------------------------------------------

    def run_to(self, tick: int) -> None:
        """Waits until then, and reads. Raises PortError."""
        while (left := tick - self.tick) > 0:
            self._take(self._read(left / TICKS_PER_SECOND))
        self._take(self._read(0.0))

    def run_to_character(self, tick: int) -> None:
        """The same, but no longer than to the next characters that come."""
        self._take(self._read(max(0, tick - self.tick) / TICKS_PER_SECOND))

    def _read(self, wait_s: float) -> bytes:
        """What is there, or is the first to come in this time."""
        port = self._serial
        with self._told():
            if self._virtual:
                port.timeout = wait_s
                first = port.read(1) if wait_s else b""
                return bytes(first) + bytes(port.read(port.in_waiting))
            if self._descriptor is not None:
                select.select([self._descriptor], [], [], wait_s)
                return bytes(port.read(READ_BYTES))
            found = bytes(port.read(READ_BYTES))
            if not found and wait_s:
                time.sleep(min(wait_s, LOOK_S))
            return found

    def _take(self, data: bytes) -> None:
        now = self.tick
        if data:
            if now - self._heard_tick > CUT_TICKS and self._decoder.pending:
                self._keep(self._decoder.flush(), self._heard_tick)
            self._heard_tick = now
            self._keep(self._decoder.feed(data), now)
            self.listener(data, now)

    def _keep(self, events: list[Event], now: int) -> None:
        for event in events:
            last = self.received[-1].end_tick if self.received else 0
            tick = max(last, now - len(event.data) * character_ticks(UP))
            self.received.append(Transmission(tick, UP, event.data))
            if isinstance(event, Received):
                self.answers.append(TimedFrame(now, event))

    def end(self) -> None:
        """What was heard of no whole answer is received too."""
        self._keep(self._decoder.flush(), self._heard_tick)

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except serial.SerialTimeoutException:
            what = f"it takes no characters for {BLOCKED_S:g} s"
            raise PortError(self.url, "", what, "look at its flow control, and at who reads it") from None
        except (serial.SerialException, OSError) as error:
            seconds = self.tick / TICKS_PER_SECOND
            with suppress(serial.SerialException, OSError):
                self._serial.close()
            raise PortError(self.url, f"{seconds:.3f} s", f"the port is lost: {error}") from None


def _opened(url: str) -> Any:
    more: dict[str, Any] = {"write_timeout": BLOCKED_S}
    if "://" not in url:
        more["exclusive"] = True
    elif url.lower().startswith("rfc2217:"):
        more["write_timeout"] = None  # the only one that pyserial has there
    try:
        return serial.serial_for_url(url, BAUD, timeout=0, **more)
    except (serial.SerialException, OSError, ValueError) as error:
        number = getattr(error, "errno", None)
        if "exclusively lock" in f"{error}":
            number = errno.EBUSY
        what, remedy = _REMEDIES.get(number or 0, (f"cannot be opened: {error}", ""))
        raise PortError(url, "", what, remedy) from None


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Within it no second Ctrl-C interrupts the stop frames."""
    numbers = (signal.SIGINT, signal.SIGTERM) if threading.current_thread() is threading.main_thread() else ()
    before = {number: signal.signal(number, signal.SIG_IGN) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
