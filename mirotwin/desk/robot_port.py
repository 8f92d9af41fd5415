"""Robots behind a serial port of this PC as a `Machine`, within the limits of a PC.

    with RobotPort(desk, scenario) as port:      opened; at the end, whatever happened: stop frames
        port.greet()                             finds the robots; tick 0 is now
        port.inject(data)                        sends what the guard allows; tick of the first start bit
        port.run_until(Answer(slot=0), within=ms(80))

Ticks are 24 in a microsecond of the wall clock (`miro://` without `realtime` has its own), and an event is known when
its characters have arrived. Operations that need a robot's inside, or a switch on it, raise NotObservable with the
reason in `LACKS`.
"""

from __future__ import annotations

import errno
import os
import select
import socket
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from types import TracebackType
from typing import Any, BinaryIO, NoReturn
from urllib.parse import urlsplit

import msgspec
import serial

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, TICKS_PER_SECOND
from miro_protocol.actions import Action
from miro_protocol.decoder import Decoder, TelemetryDecoder
from miro_protocol.events import Event as Decoded
from miro_protocol.events import Received
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.table import FRESH_AGAIN_TICKS, SEQ_MODULUS, FrameType
from miro_protocol.transmission import DOWN, UP, Transmission, character_ticks
from miro_sim.periods import Period
from miro_sim.scenario.keys import NetworkSpec, Scenario
from miro_sim.world.conditions import Condition, answer_of
from miro_sim.world.device import Device
from miro_sim.world.events import Cursor, Event, HostLog
from miro_sim.world.machine import Feature, NotObservable, require
from miro_sim.world.robot import Robot
from miro_sim.world.waits import Waits
from mirotwin.desk.guard import DeskOptions, Guard
from mirotwin.recording.recorder import Recorder, RunSource
from mirotwin.shell.held_signals import held_signals

PORT = "port"
"""`source` of a recording that was made here."""
LACKS: dict[Feature, str] = {
    "bad stop": "on a port: no serial port sends a bad stop bit",
    "inside": "on a port: it is inside the robot",
    "switch": "on a port: only a twin has such a switch",
    "save": "on a port: only a twin can be saved",
}
"""Operation that a PC cannot do or observe -> reason."""
BAUD = 9600
BLOCKED_S = 1.0
"""A port that takes no characters for so long is blocked: its buffers are full, and no program reads them."""
LOOK_S = 0.001
"""Polling interval of a port that cannot be waited for (`rfc2217://`), in seconds."""
READ_BYTES = 4096
BURST_BYTES = 1 << 16
"""Bytes that may wait in the system's buffers before the port is read."""
LEAST_CHARACTER_TICKS = character_ticks(UP) * 15 // 16
"""No receiver of 9600 baud accepts shorter characters; a longer stream of faster ones comes from no robot, and is
dropped.
"""
CUT_TICKS = TICKS_PER_SECOND // 10
"""Characters older than this do not belong to the present answer; USB adapters hold characters for 16 ms."""
PORT_ERRORS: tuple[type[Exception], ...] = (OSError,)
"""Exceptions of pyserial for a lost port: its own errors are OSErrors, a termios error is not."""
with suppress(ImportError):  # Windows has none
    import termios

    PORT_ERRORS += (termios.error,)
OPENING_ERRORS: tuple[type[Exception], ...] = (*PORT_ERRORS, ValueError)
REOPENINGS = 3
BOOT_TICKS = TICKS_PER_SECOND // 10
"""A twin that is switched on at tick 0 is up by then."""
ROUNDS = 4
"""Requests to each robot to identify itself."""
APART = 32
"""Distance in numbers between the last question of the greeting and the next frame."""
PAUSE_TICKS = FRESH_AGAIN_TICKS + TICKS_PER_SECOND // 10
"""After the greeting: after so long a silence any other number is fresh."""
ADAPTER_TICKS = TICKS_PER_SECOND // 10
"""Largest content of an adapter's buffer after the port's driver has sent everything, as a time."""
AFTER_TICKS = TICKS_PER_SECOND // 5
"""An answer that comes later than this is none."""
PIECE_BYTES = 200
LEAD_TICKS = PIECE_BYTES * HOST_CHARACTER_TICKS // 2
"""Of a long transmission the next piece is handed over so long before the piece under way is sent."""
SETTLED_TICKS = 2 * CONTROL_PERIOD_TICKS
"""An answer that is whole belongs to no earlier period than this; a question is logged when it is sent."""
_REMEDIES = {
    errno.ENOENT: ("there is no such port", "`python -m serial.tools.list_ports` lists those there are"),
    errno.EACCES: ("no permission to open it", "join the group that owns it (dialout), and log in again"),
    errno.EBUSY: ("another program has it open", "end that program first"),
}


Note = Callable[[str], object]


def _ignore(line: str) -> None:
    pass


class PortError(BadInput):
    """A port that cannot be opened, or is there no more."""


class PortNetwork(msgspec.Struct, frozen=True):
    """The network of a port. A PC sees no robot from inside."""

    spec: NetworkSpec
    log: HostLog
    index: int = 0
    robots: tuple[Robot, ...] = ()
    devices: tuple[Device, ...] = ()

    @property
    def first_slot(self) -> int:
        return min(robot.slot for robot in self.spec.robot)


class RobotPort:
    """The robots at `desk.port`, with the network and the duration of `scenario`. `name`: source of the sent
    characters, for errors. `note`: gets remarks, a line each.

    `wire`: characters sent, complete answers, and the characters between them, in order of arrival; its ticks count
    from the opening, all others from the greeting. `late_ticks`: lateness of each transmission of a schedule. `slots`:
    robots that answer; `delays`: ticks from each question since the begin of the greeting to the end of its answer.
    `accepted` and `rejected` of answers count from the greeting, as from a power-on. `prompt`: run with real-time
    priority. `dropped`: number of characters that came faster than the line can carry.
    """

    lacks = LACKS
    clock = TICKS_PER_SECOND
    image = None
    robots: tuple[Robot, ...] = ()
    devices: tuple[Device, ...] = ()
    in_period = stopped = False

    def __init__(self, desk: DeskOptions, scenario: Scenario, name: str = "", note: Note = _ignore) -> None:
        assert desk.port is not None
        self.url = desk.port
        self.guard = Guard(desk, name)
        self.scenario = scenario
        self.note = note
        self.recorder: Recorder | None = None
        spec = scenario.networks[0]
        self.log = HostLog(0, lambda tick: tick, spec.robots)
        self.networks = self.lines = (PortNetwork(spec, self.log),)
        self.waits = Waits(self)
        self.observers: list[Callable[[Period], object]] = []
        self.wire: list[Transmission] = []
        self.late_ticks: list[int] = []
        self.slots: tuple[int, ...] = ()
        self.delays: list[int] = []
        self._question_ticks: dict[int, int] = {}
        self.began_tick = self.free_tick = 0
        self.prompt = self._blocked = False
        self._counted: dict[int, tuple[int, int]] = {}
        self._decoder = TelemetryDecoder()
        self._received_tick = self._end_tick = self._recorded = self._came = self.dropped = 0
        self._began_ns = time.monotonic_ns()
        self._serial: Any = _opened(self.url)
        self._virtual = getattr(self._serial, "virtual_tick", None) is not None

    def __enter__(self) -> RobotPort:
        # Only while a port is open: a thread of that priority that spins stops the whole PC.
        self.prompt = not self._virtual and realtime_priority()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # A second Ctrl-C must not break off the stop frames: a robot would drive on for its 110 ms.
        with held_signals():
            # First of all, whatever went wrong: the rest takes time, in which the last command is valid.
            self.stop()
            realtime_priority(False)
            self._keep(self._decoder.flush(), self._received_tick)
            # A period more: the one with the last character is not over yet, and would not be written.
            self._record(max(self._now, self.free_tick, self._end_tick) + CONTROL_PERIOD_TICKS)
            with suppress(*PORT_ERRORS):
                self._serial.close()
            if self.recorder is not None:
                self.recorder.__exit__(kind, error, trace)
        if self.dropped:
            count = amount(self.dropped, "character is", "characters are")
            self.note(f"{self.url}: {count} left out, which came faster than {BAUD} baud carries")

    # ---- time --------------------------------------------------------------------------------------------

    @property
    def _now(self) -> int:
        """Since the opening."""
        if self._virtual:
            return int(self._serial.virtual_tick)
        return (time.monotonic_ns() - self._began_ns) * self.clock // 1_000_000_000

    @property
    def tick(self) -> int:
        return self._now - self.began_tick

    @property
    def finished(self) -> bool:
        return self.tick >= self.scenario.end_tick

    @property
    def period_end(self) -> int:
        return (self.tick // CONTROL_PERIOD_TICKS + 1) * CONTROL_PERIOD_TICKS

    def run_to(self, tick: int) -> None:
        """Waits until then, and reads. Raises PortError."""
        while (remaining := tick - self.tick) > 0:
            self._take(self._read(remaining))
        # What came on the last tick belongs to it; without this a wait for 0 ticks reads nothing.
        self._take(self._read(0))

    def run_for(self, for_ticks: int) -> None:
        self.run_to(self.tick + for_ticks)

    def run_until(self, condition: Condition | Sequence[Condition], within: int | None = None) -> Event:
        return self.waits.until([condition] if isinstance(condition, Condition) else condition, within)

    def run_piece(self, tick: int) -> None:
        """For `Waits`: until then, but no longer than to the next characters that come."""
        self._take(self._read(max(0, tick - self.tick)))

    def begin_period(self) -> None:
        """For `Waits`, like the next four methods: nothing to do, as time cannot go back here and arrivals are in the
        log.
        """

    def end_period(self) -> None:
        pass

    def rendezvous(self, tick: int) -> int:
        return tick

    def mark(self) -> None:
        pass

    def go_back(self, mark: None) -> None:
        pass

    # ---- sending -----------------------------------------------------------------------------------------

    def earliest_tick(self, network: int = 0) -> int:
        return max(self.tick, self.free_tick - self.began_tick)

    def inject(
        self, data: bytes, network: int = 0, at_tick: int | None = None, bad_stop: Sequence[int] = ()
    ) -> int:
        """Sends now, or waits until `at_tick` first; the tick of the first start bit. Raises BadInput, PortError."""
        require(self, "a transmission", "bad stop" if bad_stop else None)
        if at_tick is not None:
            self.run_to(at_tick)
        # Before anything leaves: a frame that may move a robot is refused whole.
        numbers = self.guard.check(data, f"tick {self.tick}")
        now = self._now
        with self._port_errors():
            if self._blocked:  # how much of what was sent last is on its way is not known
                raise serial.SerialTimeoutException
            # The system's buffer takes it at once, the line only when it is free.
            sent = Transmission(max(now, self.free_tick), DOWN, data)
            self.free_tick = (
                sent.end_tick
            )  # before Ctrl-C can break off the next line: some of it may be on its way
            self._serial.write(data)
        if at_tick is not None:
            self.late_ticks.append(max(0, now - self.began_tick - at_tick))
        self.wire.append(sent)
        self._question_ticks |= dict.fromkeys(numbers, sent.tick)
        tick = sent.tick - self.began_tick
        self.log.note(Event(tick=tick, what="sent", data=data))
        return tick

    @property
    def earliest_action_tick(self) -> int:
        return self.tick

    def do(self, action: Action) -> NoReturn:
        raise NotObservable(f"{type(action).__name__}: not observable {LACKS['switch']}")

    def device(self, network: int = 0, slot: int = 0) -> NoReturn:
        raise NotObservable(f"net{network}/robot{slot}: not observable {LACKS['inside']}")

    robot = device

    def play(self, sent: Iterable[Transmission], each: Callable[[int], object] = lambda tick: None) -> None:
        """Sends these at their ticks while reading, and reads a little longer; `each` is called with the tick of each
        end.
        """
        for transmission in sent:
            for start in range(0, len(transmission.data), PIECE_BYTES):
                # In pieces: what is in the system's buffer cannot be taken back by `stop`.
                due = transmission.tick + start * HOST_CHARACTER_TICKS - (LEAD_TICKS if start else 0)
                self.inject(transmission.data[start : start + PIECE_BYTES], at_tick=due)
            self._record(self._now - SETTLED_TICKS)
            each(transmission.end_tick)
        self.run_to(self.earliest_tick() + AFTER_TICKS)

    def stop(self) -> None:
        """Takes back waiting characters and sends stop frames. Reopens a lost port for this if possible."""
        # The adapter may be within a frame: stop frames have to be enough for one to be read whole.
        unsent_ticks = max(0, self.free_tick - self._now) + ADAPTER_TICKS
        frames = self.guard.stop_frames(unsent_ticks // HOST_CHARACTER_TICKS)
        for _ in range(REOPENINGS):
            with suppress(PortError, *PORT_ERRORS):
                if not self._serial.is_open:
                    self._serial = _opened(self.url)
                if not self.url.lower().startswith("rfc2217:"):  # it would wait up to 3 s for a confirmation
                    with suppress(*PORT_ERRORS):
                        # Commands that are not sent yet would move the robots after the stop.
                        self._serial.reset_output_buffer()
                self._serial.write(frames)
                if not self._virtual:
                    # Closing drops what is not sent yet, on many systems.
                    time.sleep(len(frames) * HOST_CHARACTER_TICKS / TICKS_PER_SECOND)
                return
            with suppress(*PORT_ERRORS):
                self._serial.close()
            time.sleep(LOOK_S)

    # ---- who is there ------------------------------------------------------------------------------------

    def greet(self, sizes: Sequence[int] = (), sent: Iterable[Transmission] = ()) -> int:
        """Queries the robots in networks of these sizes (default: the scenario's) and returns the first size with
        answers. A silence follows, after which `sent` is fresh. Raises BadInput if no robot answers.
        """
        sizes, first = sizes or (self.networks[0].spec.robots,), len(self.wire)
        for robots in sizes:
            if counted := self._who_answers(robots, sent):
                self.slots, self._counted = tuple(sorted(counted)), counted
                self.began_tick = self._now
                # Answers to the greeting must not end the first wait of a test.
                self.waits.forget()
                return robots
        self._keep(self._decoder.flush(), self._received_tick)
        raise BadInput(self.url, "", *self._why_nobody(sizes, first))

    def _who_answers(self, robots: int, sent: Iterable[Transmission]) -> dict[int, tuple[int, int]]:
        """By slot, how many frames each has accepted and rejected; each is questioned some times, standing."""
        self._counted, self._question_ticks, self.delays, cursor = {}, {}, [], Cursor(self.log)
        decoder = Decoder(robots)
        numbers = (
            event.seq
            for transmission in sent
            for event in decoder.feed(transmission.data)
            if isinstance(event, Received)
        )
        # Well before the first number that follows: a robot drops a frame whose number is not newer.
        seq = (next(numbers, 0) - APART - ROUNDS * robots) % SEQ_MODULUS
        self.run_to(BOOT_TICKS)
        for _ in range(ROUNDS * robots):
            sent_tick = self.inject(encode(TeamFrame(FrameType.TEAM_ASK, seq, ((0, 0),) * robots), robots))
            self.run_to(sent_tick + CONTROL_PERIOD_TICKS)
            seq = (seq + 1) % SEQ_MODULUS
        self.run_to(self.tick + PAUSE_TICKS)
        counted = {}
        for answer in [answer_of(event.frame) for _, event in cursor.read() if event.frame]:
            if (
                answer is not None
                and answer.seq in self._question_ticks
                and answer.slot == answer.seq % robots
            ):
                since = (self.guard.last[robots] - answer.seq) % SEQ_MODULUS  # questions to others
                counted[answer.slot] = (answer.accepted + since, answer.rejected)
        return counted if self.delays else {}  # without any, the numbers are those of later questions

    def _why_nobody(self, sizes: Sequence[int], first: int) -> tuple[str, str]:
        """Text about the characters that arrived instead of answers, and a remedy."""
        came = b"".join(sent.data for sent in self.wire[first:] if sent.direction == UP)
        problem = f"no robot of a network of {' or '.join(map(str, sizes))} answers"
        if not came:
            return f"{problem}: nothing comes", "is it switched on, and is this its radio's port?"
        if any(isinstance(event, Received) for event in Decoder(sizes[0]).feed(came)):
            return f"{problem}: the port echoes what is sent", "turn the echo of the adapter off"
        if any(isinstance(event, Received) for event in TelemetryDecoder().feed(came)):
            return f"{problem}, but others answer", "is it a network of another size?"
        reason = f"{problem}: {len(came)} characters come that are no answer, {came[:6].hex(' ')} .."
        return reason, "is this the radio's port, and is its rate 9600 baud?"

    # ---- reading -----------------------------------------------------------------------------------------

    def _read(self, wait_ticks: int) -> bytes:
        """The available bytes, or the first to arrive within this time."""
        port, wait_s = self._serial, wait_ticks / TICKS_PER_SECOND
        unread = getattr(
            port, "_read_buffer", None
        )  # of rfc2217://, which a thread of pyserial fills without end
        if unread is not None and unread.qsize() > BURST_BYTES:
            with unread.mutex:
                self.dropped += len(unread.queue)
                unread.queue.clear()
        with self._port_errors():
            if self._virtual:
                port.timeout = wait_s
                return bytes(port.read(max(1, port.in_waiting)))
            data = bytes(port.read(READ_BYTES))
            if not data and wait_s:
                try:
                    select.select([port], [], [], wait_s)
                except OSError:  # it has no descriptor
                    time.sleep(min(wait_s, LOOK_S))
                data = bytes(port.read(READ_BYTES))
            return data

    def _take(self, data: bytes) -> None:
        now = self._now
        # A port that floods (a stuck adapter, /dev/zero) would fill memory and never let `run_to` end.
        room = BURST_BYTES + now // LEAST_CHARACTER_TICKS - self._came
        self.dropped += max(0, len(data) - room)
        data = data[: max(0, room)]
        if not data:
            return
        self._came += len(data)
        # A frame whose rest was lost: else its begin would swallow the next answer.
        if now - self._received_tick > CUT_TICKS and self._decoder.pending:
            self._keep(self._decoder.flush(), self._received_tick)
        self._received_tick = now
        for byte in data:
            self.log.note(Event(tick=now - self.began_tick, what="heard", value=byte))
        self._keep(self._decoder.feed(data), now)

    def _keep(self, decoded: Iterable[Decoded], now: int) -> None:
        for item in decoded:
            # Not before the end of the last: adapters hand over several at once, and a line carries one.
            came = Transmission(
                max(self._end_tick, now - len(item.data) * character_ticks(UP)), UP, item.data
            )
            self._end_tick = came.end_tick
            self.wire.append(came)
            if isinstance(item, Received):
                answer = answer_of(item)
                slot = -1 if answer is None else answer.slot
                if answer is not None and answer.seq in self._question_ticks:
                    self.delays.append(now - self._question_ticks[answer.seq])
                frame = self._from_zero(item, slot)
                self.log.note(Event(tick=now - self.began_tick, what="answer", value=slot, frame=frame))

    def _from_zero(self, frame: Received, slot: int) -> Received:
        """The answer with counters that began with the greeting; they are its last two bytes."""
        counts = self._counted.get(slot, (0, 0))
        last = bytes(byte - count & 0xFF for byte, count in zip(frame.body[-2:], counts, strict=True))
        return msgspec.structs.replace(frame, body=frame.body[:-2] + last)

    @contextmanager
    def _port_errors(self) -> Iterator[None]:
        """Errors of the port, which pyserial derives from OSError, as a PortError."""
        try:
            yield
        except serial.SerialTimeoutException:
            self._blocked = True
            reason = f"it takes no characters for {BLOCKED_S:g} s"
            raise PortError(self.url, "", reason, "look at its flow control, and at who reads it") from None
        except PORT_ERRORS as error:
            seconds = self._now / TICKS_PER_SECOND
            with suppress(*PORT_ERRORS):
                self._serial.close()
            reason, remedy = f"the port is lost: {error}", "robots that hear nothing stop after 110 ms"
            raise PortError(self.url, f"{seconds:.3f} s", reason, remedy) from None

    # ---- a recording like any other ----------------------------------------------------------------------

    def record(self, stream: BinaryIO, source: RunSource) -> None:
        """Records from the opening on, until the port is closed. `source`: of the twin."""
        self.recorder = Recorder(stream, source)

    def _record(self, until_tick: int) -> None:
        """Writes the periods that end by `until_tick`, so that an interrupted recording is complete up to there."""
        if self.recorder is None:
            return
        # Answers are dated back to their first character: one may begin before what was sent while it came.
        self.wire.sort(key=lambda sent: sent.tick)
        done = 0
        while (end_tick := (self._recorded + 1) * CONTROL_PERIOD_TICKS) <= until_tick:
            first = done
            while done < len(self.wire) and self.wire[done].tick < end_tick:
                done += 1
            begin_tick = self._recorded * CONTROL_PERIOD_TICKS
            self.recorder.write(Period(self._recorded, begin_tick, (), tuple(self.wire[first:done]), ""))
            self._recorded += 1
            self.recorder.flush_if_due()
        del self.wire[:done]


@contextmanager
def port_for_test(desk: DeskOptions, scenario: Scenario, name: str, note: Note) -> Iterator[RobotPort]:
    """Robots that a test may speak to. Raises NotObservable for a test that needs more than the one network of a port,
    and a PC that sees no pitch; BadInput, PortError.
    """
    if (count := len(scenario.networks)) > 1:
        raise NotObservable(f"{count} networks: not observable on a port, which is the radio of one")
    if scenario.networks[0].host != "silent":
        raise NotObservable("a controller, which needs a camera: not observable on a port")
    with RobotPort(desk, scenario, name, note) as port:
        port.greet()
        yield port


def _check_address(url: str, scheme: str) -> None:
    """Refuses a network address without a port number, for which pyserial's own message is misleading."""
    with suppress(ValueError):  # letters, or beyond 65535
        if scheme not in ("socket", "rfc2217") or urlsplit(url).port is not None:
            return
    remedy = f"write {scheme}://HOST:PORT, such as {scheme}://127.0.0.1:7000"
    raise PortError(url, "", "names no port", remedy)


def _opened(url: str) -> Any:
    scheme = url.partition("://")[0].lower()
    _check_address(url, scheme)
    address, blocked_s = url, None if scheme == "rfc2217" else BLOCKED_S  # pyserial has no other there
    if scheme == "rfc2217":  # ser2net says nothing of a DTR that is not there
        address += "&ign_set_control" if "?" in url else "?ign_set_control"
        realtime_priority()  # of the thread that reads there, too
    try:
        port = serial.serial_for_url(address, BAUD, timeout=0, exclusive=True, write_timeout=blocked_s)
        if scheme == "socket":  # or a frame waits until the one before is acknowledged, up to 40 ms
            with socket.socket(fileno=os.dup(port.fileno())) as same:
                same.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return port
    except OPENING_ERRORS as error:
        number = getattr(error, "errno", None)
        if "exclusively lock" in f"{error}":
            number = errno.EBUSY
        why = f"{error}".rpartition(f"{address}: ")[2]
        unknown = f"cannot be opened: {why}", "is its address right, and does anybody serve it?"
        reason, remedy = _REMEDIES.get(number or 0, unknown)
        raise PortError(url, "", reason, remedy) from None
    finally:
        realtime_priority(False)


def realtime_priority(wanted: bool = True) -> bool:
    """Asks the system to wake this thread before all others, or no longer; whether it does. Few users may."""
    policy = "SCHED_FIFO" if wanted else "SCHED_OTHER"
    with suppress(AttributeError, OSError):  # not everywhere, or not allowed
        os.sched_setscheduler(0, getattr(os, policy), os.sched_param(int(wanted)))
        return wanted
    return False
