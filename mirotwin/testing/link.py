"""The link fixture: a host at the radio that sends the test's frames, and waits for answers in virtual time.

Each answer is consumed once; answers that a wait does not want stay for the next one. The link reads independently, so
a wait for something else (`world`, `robot`) takes no answers from it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeVar

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS
from miro_protocol.actions import RadioState
from miro_protocol.frames import Message, ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.table import TICKS_PER_MS, Flags
from miro_sim.world.conditions import Answer, Condition, Heard, answer_of
from miro_sim.world.events import Cursor, Event
from miro_sim.world.machine import Machine
from miro_sim.world.waits import WaitExpired, Waits
from mirotwin.testing.waiting import WaitFailed, shown_where_it_was_called
from mirotwin.verify.checks.happens import expect_of
from mirotwin.verify.frame_sender import FrameSender

T = TypeVar("T")
_CHARACTERS_KEPT = 4096
Velocities = Mapping[int, tuple[int, int]]
"""(left, right) by slot, in 1/256 count per LM629 sample."""


class SentFrame(msgspec.Struct, frozen=True):
    """A transmission: first start bit, end of the last stop bit, its sequence number (None for bare characters)."""

    tick: int
    end_tick: int
    seq: int | None
    data: bytes


class Link(FrameSender):
    """The host's end of `network`. Sequence numbers count automatically; `velocities`: those sent last."""

    def __init__(self, machine: Machine, network: int = 0) -> None:
        super().__init__(machine, network, -1)
        self.answers: list[tuple[int, TelemetryFrame]] = []
        """(tick, answer) of all that the PC received."""
        self._waits = Waits(machine)
        self._cursor = Cursor(machine.networks[network].log)
        self._open: list[TelemetryFrame] = []
        self._characters: list[Event] = []
        machine.observers.append(lambda period: self._gather())

    # Sending

    @shown_where_it_was_called
    def send(
        self,
        frame: Message | bytes | None = None,
        *,
        velocities: Velocities | None = None,
        ask: bool = False,
        seq: int | None = None,
        bad_stop: Sequence[int] = (),
        at_tick: int | None = None,
        wait: bool = True,
    ) -> SentFrame:
        """Sends a frame, bare characters, or a team frame with `velocities` (robots that are not named: 0), and goes on
        to the end of the last character; without `wait`, virtual time stands still and the next frame queues.

        `ask`: robot (seq mod N) answers. `seq`: instead of the next number; a frame brings its own. `bad_stop`: indices
        of characters whose stop bit is bad. `at_tick`: of the first start bit. Raises ValueError for content that
        cannot be sent.
        """
        number: int | None = None
        if isinstance(frame, bytes | bytearray):
            data = bytes(frame)
            tick = self.machine.inject(data, self.network, at_tick, tuple(bad_stop))
        else:
            message = self._of_slots(velocities, ask, seq) if frame is None else frame
            number, data = message.seq, encode(message, self.robots)
            tick = self.put(message, at_tick, bad_stop)
        sent = SentFrame(tick, tick + len(data) * HOST_CHARACTER_TICKS, number, data)
        if wait:
            self.machine.run_to(sent.end_tick)
        return sent

    def _of_slots(self, velocities: Velocities | None, ask: bool, seq: int | None) -> TeamFrame:
        if velocities is None:
            raise ValueError("nothing to send: give a frame, bytes, or velocities={slot: (left, right)}")
        wrong = [slot for slot in velocities if slot not in range(self.robots)]
        if wrong:
            raise ValueError(f"slot {wrong[0]!r} does not exist on a network of {self.robots} robots")
        return self.team(ask, seq, [velocities.get(slot, (0, 0)) for slot in range(self.robots)])

    @shown_where_it_was_called
    def poll(self, slot: int = 0, *, velocities: Velocities | None = None, wait: bool = True) -> SentFrame:
        """Asks the robot in `slot`: a team frame with the next number at its turn, and the velocities sent last.

        Raises ValueError where that number would not be fresh: 64 is not a multiple of the number of robots.
        """
        if slot not in range(self.robots):
            raise ValueError(f"slot {slot!r} does not exist on a network of {self.robots} robots")
        velocities = velocities or dict(enumerate(self.velocities))
        return self.send(velocities=velocities, ask=True, seq=self.asking_seq(slot), wait=wait)

    @shown_where_it_was_called
    def drive(self, velocities: Velocities, for_ticks: int) -> None:
        """Sends `velocities` once a control period (33.4 ms) for so long, and lets the last period pass."""
        end_tick = self.machine.tick + for_ticks
        while self.machine.tick < end_tick:
            begun = self.machine.tick
            self.send(velocities=velocities)
            self.machine.run_to(min(begun + CONTROL_PERIOD_TICKS, end_tick))

    def ping(self, slot: int = 0) -> SentFrame:
        """Sends a service frame without an effect."""
        return self.send(ServiceFrame.ping(self.next_seq(), slot))

    def set_acceleration(self, slot: int, value: int) -> SentFrame:
        """In 1/65536 count per sample^2."""
        return self.send(ServiceFrame.acceleration(self.next_seq(), slot, value))

    def set_filter(self, slot: int, kp: int, ki: int, kd: int, il: int) -> SentFrame:
        return self.send(ServiceFrame.filter(self.next_seq(), slot, kp, ki, kd, il))

    def radio(self, state: Literal["up", "down", "noise"]) -> None:
        """Lets the radio of the network work, be off, or give noise, from now on."""
        action = RadioState(self.machine.earliest_action_tick, self.network, state)
        self.machine.run_to(self.machine.do(action))

    # Hearing

    @shown_where_it_was_called
    def expect(
        self, wanted: type[TelemetryFrame] = TelemetryFrame, *, within: int, **fields: int
    ) -> TelemetryFrame:
        """Waits for an answer with these `fields` and returns it; an answer received earlier and not consumed counts,
        too. `within`: ticks from now, `ms(40)`. Raises WaitFailed with the answers received instead, BadInput for a
        field that telemetry does not have.
        """
        if wanted is not TelemetryFrame:
            raise BadInput(
                "", "link.expect", f"{wanted!r} is no kind of answer", "give Telemetry, or use expect_bytes"
            )
        wrong = [name for name in fields if name not in TelemetryFrame.__struct_fields__]
        if wrong:
            names = ", ".join(TelemetryFrame.__struct_fields__)
            raise BadInput("", "link.expect", f"telemetry has no field {wrong[0]!r}", f"it has {names}")
        filters = ", ".join(f"{name}={value}" for name, value in fields.items())

        def taken() -> TelemetryFrame | None:
            for place, answer in enumerate(self._open):
                if all(getattr(answer, name) == value for name, value in fields.items()):
                    return self._open.pop(place)
            return None

        missing = f"no answer{' with ' + filters if fields else ''} within {within / TICKS_PER_MS:g} ms"
        return self._until(taken, _answer_with(self.network, fields), within, missing)

    @shown_where_it_was_called
    def expect_bytes(self, pattern: bytes, *, within: int) -> int:
        """Waits until the PC has received `pattern`, and returns the tick; the characters up to it are consumed."""

        def taken() -> int | None:
            place = bytes(event.value for event in self._characters).find(pattern)
            if place < 0:
                return None
            end = place + len(pattern)
            tick = self._characters[end - 1].tick
            del self._characters[:end]
            return tick

        missing = f"{pattern.hex(' ')} not heard within {within / TICKS_PER_MS:g} ms"
        return self._until(taken, Heard(network=self.network), within, missing, judged=False)

    def _until(
        self,
        taken: Callable[[], T | None],
        condition: Condition,
        within: int,
        wanted: str,
        judged: bool = True,
    ) -> T:
        """The result of `taken` now, or after an event of this condition. Raises WaitFailed after `within` ticks."""
        begun_tick, remaining = self.machine.tick, within
        events: list[Event] = []
        while True:
            self._gather()
            if (result := taken()) is not None:
                return result
            try:
                events.append(self._waits.until([condition], remaining))
            except WaitExpired as expired:
                raise WaitFailed.of(expired, self.machine, wanted, begun_tick, events, judged) from None
            remaining = max(0, begun_tick + within - self.machine.tick)

    @shown_where_it_was_called
    def expect_silence(self, for_ticks: int) -> None:
        """Runs for `for_ticks`. Raises WaitFailed at the first character that the PC receives."""
        begun_tick = self.machine.tick
        end_tick = begun_tick + for_ticks
        expected = f"silence for {for_ticks / TICKS_PER_MS:g} ms"
        silence = Heard(network=self.network)
        event = None
        while event is None or event.tick <= begun_tick:
            try:
                event = self._waits.until([silence], max(0, end_tick - self.machine.tick))
            except WaitExpired as expired:
                if expired.tick < end_tick:
                    raise WaitFailed.of(expired, self.machine, expected, begun_tick, judged=False) from None
                return
        expect = expect_of("never_happens", silence, begun_tick, end_tick)
        raise WaitFailed(f"{expected}: broken", begun_tick, event.tick, [event], expect)

    def _gather(self) -> None:
        """Reads what the PC has received by now."""
        cursor = self._cursor
        for serial, event in cursor.log.since(cursor.next):
            if event.what in ("heard", "answer") and event.tick > self.machine.tick:
                break
            cursor.next = serial + 1
            if event.what == "heard":
                self._characters.append(event)
            elif event.frame is not None and event.value >= 0 and (answer := answer_of(event.frame)):
                # of the others the CRC is good, but no correct robot says this: the checks tell
                self.answers.append((event.tick, answer))
                self._open.append(answer)
        del self._characters[:-_CHARACTERS_KEPT]

    def __repr__(self) -> str:
        return f"Link(net{self.network}, seq={self.seq}, {len(self.answers)} answers, {len(self._open)} not taken)"


def _answer_with(network: int, fields: Mapping[str, int]) -> Answer:
    """The condition for an answer with these fields of a telemetry frame."""
    wanted: dict[str, Any] = dict(fields)
    flags = wanted.pop("flags", None)
    for flag in Flags if flags is not None else ():
        wanted[str(flag.name).lower()] = bool(flags & flag)
    return Answer(network=network, **wanted)
