"""`miro://` for pyserial: a robot behind its radio, in the process of the program that opens it.

Each `open` switches a new robot on: virtual time begins at 0 and nothing remains of the port's last use.

    read(n)          time passes until n bytes are there, up to `timeout` (None: for ever), or up to
                     `inter_byte_timeout` after a byte; it stands at the tick at which the last of them was known
    read, timeout 0  what is there; no time passes
    in_waiting       what is there; no time passes
    write(data)      none passes while the transmit buffer (4096 characters) has room; else until it has, up to
                     `write_timeout`
    flush, close     until everything is sent
    sleep, others    none passes

With `realtime=1` time follows the wall clock instead, also between calls, and calls wait for it.
"""

from __future__ import annotations

import atexit
import logging
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from serial.serialutil import (
    EIGHTBITS,
    PARITY_NONE,
    STOPBITS_ONE,
    PortNotOpenError,
    SerialBase,
    SerialException,
    SerialTimeoutException,
    to_bytes,
)

from miro_exact.bad_input import BadInput
from miro_exact.clock import (
    CONTROL_PERIOD_TICKS,
    HOST_CHARACTER_TICKS,
    NEVER_TICK,
    TICKS_PER_SECOND,
    seconds,
    ticks,
)
from miro_robot.faults import FirmwareFault
from miro_sim.scenario.file import ScenarioText, live_scenario
from miro_sim.world.conditions import Heard
from miro_sim.world.waits import WaitExpired
from miro_sim.world.world import World
from mirotwin.ports.endpoint import ByteFifo
from mirotwin.ports.radio_port import TRANSMIT_CHARACTERS, RadioPort
from mirotwin.ports.session import Pace
from mirotwin.ports.url import parse_url
from mirotwin.recording.recorder import Recorder, source_of
from mirotwin.runs.runner import observed
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.outputs import KEPT, RECORDING, OutputFolder

BAUD = 9600
POLLS = 1000
"""Number of polls in a row, without data and without time passing, after which a warning gives the reason."""
CATCH_UP_S = 0.25
"""Longest wall time for which one call catches up a late world; later calls continue, in seconds."""
_log = logging.getLogger("mirotwin.ports")


class Serial(SerialBase):  # type: ignore[misc]  # pyserial has no types
    """A port of pyserial; see the head of this file. `world`: its world while it is open."""

    BAUDRATES = (BAUD,)
    is_open: bool

    def __init__(self, *args: Any, **named: Any) -> None:
        self._lock = threading.RLock()  # a terminal reads in one thread and writes in another
        self._world: World | None = None
        self._pace: Pace | None = None
        self._files = ExitStack()
        self._cancel_read = self._cancel_write = False
        self._polls = 0
        super().__init__(*args, **named)

    @property
    def world(self) -> World:
        """The world of the open port. Raises PortNotOpenError."""
        if self._world is None:
            raise PortNotOpenError()
        return self._world

    @property
    def virtual_tick(self) -> int | None:
        """The present virtual tick, for programs that keep time by it; None if time follows the wall clock."""
        return self.world.tick if self._pace is None else None

    # ---- opening -----------------------------------------------------------------------------------------

    def open(self) -> None:
        """Makes the world. Raises SerialException for a URL, scenario, image or folder that cannot be used.

        A program that records and ends without closing closes at its exit.
        """
        if self._port is None:
            raise SerialException("Port must be configured before it can be used.")
        if self.is_open:
            raise SerialException("Port is already open.")
        self._reconfigure_port()
        try:
            options = parse_url(self._port)
            text = live_scenario(options.scenario, options.settings)
            image = load_firmware(options.firmware, named=False)
            world = RunSpec.of(text, image, options.seed).world()
            self._radio = RadioPort(world, options.network)
            if options.out:
                self._files.enter_context(_recorded(world, text, OutputFolder(Path(options.out))))
                atexit.register(self.close)
        except (BadInput, OSError, ValueError) as error:
            raise SerialException(str(error)) from None
        self._world = world
        self._inbox = ByteFifo()
        self._limit_tick = ticks(options.limit_s)
        self._pace = Pace(options.realtime) if options.realtime else None
        self.is_open = True

    def close(self) -> None:
        """Sends the waiting bytes, and finishes the control period so that a recording contains it."""
        if not self.is_open:
            return
        try:
            if not self._why_over():
                self._drain(None)
        except SerialException:  # the run ended meanwhile: nobody is left who could hear it
            pass
        finally:
            self.is_open = False
            with self._lock:
                self._world = None
                self._end_recording()

    def _end_recording(self, error: OSError | None = None) -> None:
        """`error` broke it off, after which a part stays. Raises SerialException."""
        try:
            with self._files:
                if error is not None:
                    raise error
        except (BadInput, OSError) as told:
            raise SerialException(str(told)) from None

    def _reconfigure_port(self) -> None:
        """Raises ValueError for anything that the port of this radio is not: it has one rate and one format."""
        if self._baudrate != BAUD:
            raise ValueError(f"{self._baudrate} baud: the port of this radio has {BAUD}")
        if (self._bytesize, self._parity, self._stopbits) != (EIGHTBITS, PARITY_NONE, STOPBITS_ONE):
            raise ValueError("the port of this radio has 8 data bits, no parity and 1 stop bit")
        if self._xonxoff:
            raise ValueError("xonxoff: frames hold all byte values, also 11h and 13h")

    # ---- reading -----------------------------------------------------------------------------------------

    @property
    def in_waiting(self) -> int:
        """Bytes that are there."""
        with self._caught_up():
            self._note_poll(len(self._inbox))
            return len(self._inbox)

    def read(self, size: int = 1) -> bytes:
        """See the head of this file. Raises SerialException once the run is over and all is read."""
        there, gap_end, data = 0, NEVER_TICK, b""

        def until(world: World, deadline: int) -> int | None:
            nonlocal there, gap_end, data
            if self._inter_byte_timeout is not None and len(self._inbox) > there:
                there = len(self._inbox)
                gap_end = world.tick + ticks(self._inter_byte_timeout)
            deadline = min(deadline, gap_end)
            if not self._read_ends(world, size, deadline):
                return deadline
            data = self._inbox.take(size)
            return None

        self._wait(self._timeout, until, for_byte=True)
        return data

    def _read_ends(self, world: World, size: int, deadline: int) -> bool:
        if len(self._inbox) >= size:
            return True
        if self._cancel_read:
            self._cancel_read = False
            return True
        why = self._why_over()
        if why and not self._inbox:
            raise SerialException(why)
        if why or world.tick >= deadline:
            self._note_poll(len(self._inbox) or self._timeout)
            return True
        self._polls = 0
        return False

    def cancel_read(self) -> None:
        """The pending read of another thread, or else the next read, returns the available bytes."""
        self._cancel_read = True

    def reset_input_buffer(self) -> None:
        with self._caught_up():
            self._inbox.clear()

    # ---- writing -----------------------------------------------------------------------------------------

    def write(self, data: Any) -> int:
        """See the head of this file. Raises SerialTimeoutException where the buffer has no room in time."""
        data, sent = to_bytes(data), 0

        def until(world: World, deadline: int) -> int | None:
            nonlocal sent
            if why := self._why_over():
                raise SerialException(why)
            if taken := data[sent : sent + self._radio.room]:
                self._radio.send(taken)
                sent += len(taken)
                self._polls = 0
            if sent == len(data) or self._cancel_write:
                self._cancel_write = False
                return None
            if world.tick >= deadline:
                if self._write_timeout == 0:
                    return None
                raise SerialTimeoutException("Write timeout")
            wanted = min(len(data) - sent, TRANSMIT_CHARACTERS)
            room_tick = self._radio.free_tick - (TRANSMIT_CHARACTERS - wanted) * HOST_CHARACTER_TICKS
            return min(deadline, max(room_tick, world.tick + 1))

        self._wait(self._write_timeout, until)
        return sent

    def cancel_write(self) -> None:
        """The write of another thread, or else the next one, returns how much it has written."""
        self._cancel_write = True

    def flush(self) -> None:
        """Waits until everything is sent. Raises SerialException if the run ends before."""
        self._drain(self._write_timeout)

    def _drain(self, timeout_s: float | None) -> None:
        def until(world: World, deadline: int) -> int | None:
            if not self._radio.waiting:
                return None
            if why := self._why_over():
                raise SerialException(why)
            if world.tick >= deadline:
                raise SerialTimeoutException("Write timeout")
            return min(self._radio.free_tick, deadline)

        self._wait(timeout_s, until)

    @property
    def out_waiting(self) -> int:
        """Characters that are not sent yet."""
        with self._caught_up():
            return self._radio.waiting

    def reset_output_buffer(self) -> None:
        """Removes characters whose transmission has not begun."""
        with self._caught_up():
            self._radio.purge()

    # ---- lines that a radio does not have ----------------------------------------------------------------

    @property
    def cts(self) -> bool:
        """Always active, as DSR and CD are; RI never is. Raises PortNotOpenError."""
        return self.world is not None

    dsr = cd = cts

    @property
    def ri(self) -> bool:
        return self.world is None

    def _update_line(self) -> None:
        """RTS and DTR are not connected, and a break does not get through the radio module."""

    _update_break_state = _update_rts_state = _update_dtr_state = _update_line

    # ---- within ------------------------------------------------------------------------------------------

    @contextmanager
    def _caught_up(self) -> Iterator[World]:
        """The world, where it should be now; other threads wait meanwhile. Raises PortNotOpenError."""
        with self._lock:
            world = self.world
            try:
                self._catch_up(world)
                yield world
            except SerialException:
                raise
            except OSError as error:  # what is recorded cannot be written
                self._end_recording(error)
                raise

    def _catch_up(self, world: World) -> None:
        """Advances the world to the wall clock, if the port follows it, and collects the characters that the PC has
        received.
        """
        if self._pace is not None:
            due = self._pace.tick()
            latest = due + int(CATCH_UP_S * self._pace.factor * TICKS_PER_SECOND)
            while world.tick < due and not world.stopped and self._pace.tick() < latest:
                world.run_to(min(due, world.tick + CONTROL_PERIOD_TICKS))
                self._inbox.add(self._radio.received())
            if behind := self._pace.note(world.tick, world.tick, self._pace.tick()):
                _log.warning("tick %d: %s", world.tick, behind)
        self._inbox.add(self._radio.received())

    def _advance(self, world: World, tick: int, for_byte: bool) -> None:
        """In virtual time towards `tick`; with `for_byte` not beyond the next byte received."""
        tick = min(tick, world.tick + CONTROL_PERIOD_TICKS)
        if for_byte:
            with suppress(WaitExpired):
                world.run_until(Heard(network=self._radio.network), within=tick - world.tick)
        else:
            world.run_to(tick)

    def _wait(
        self, timeout_s: float | None, until: Callable[[World, int], int | None], for_byte: bool = False
    ) -> None:
        """Lets time pass to the tick that `until` gives for world and deadline, as often as it gives one."""
        deadline = None
        while True:
            with self._caught_up() as world:
                if deadline is None:
                    deadline = NEVER_TICK if timeout_s is None else world.tick + ticks(timeout_s)
                tick = until(world, deadline)
                if tick is None:
                    return
                tick = min(tick, self._limit_tick)
                if self._pace is None:
                    self._advance(world, tick, for_byte)
            if self._pace is not None:  # other threads may have the world
                self._pace.sleep_until(min(tick, world.tick + HOST_CHARACTER_TICKS))

    def _why_over(self) -> str:
        """Why no more time passes, if so."""
        world = self.world
        if world.stopped:
            fault: FirmwareFault = world.faults[0]
            return f"the run has stopped: firmware fault: {fault}"
        if world.tick >= self._limit_tick:
            return f"the limit of {seconds(self._limit_tick):g} s of virtual time is reached (limit_s)"
        return "the day that a world may last is over" if world.finished else ""

    def _note_poll(self, data: object) -> None:
        self._polls = 0 if data else self._polls + (self._pace is None)
        if self._polls == POLLS:
            warnings.warn(
                f"{POLLS} times in a row nothing was there, and no time passed: in_waiting and reads with timeout 0"
                " let none pass; use realtime=1 in the URL for programs that poll",
                RuntimeWarning,
                stacklevel=3,
            )


@contextmanager
def _recorded(world: World, text: ScenarioText, folder: OutputFolder) -> Iterator[None]:
    """Records `world` until the end of a control period."""
    source = source_of(text, world)
    with folder:
        folder.keep = KEPT
        stream = folder.part(RECORDING).open("wb", buffering=0)
        with (
            stream,
            Recorder(stream, source) as recorder,
            observed(world, recorder, lambda period: recorder.flush_if_due()),
        ):
            yield
            if world.in_period and not world.stopped:
                world.run_to(world.period_end)
