"""The board and serial fixtures: actions, waits and readings of a test, and a terminal at the serial port."""

from __future__ import annotations

import re
from typing import Any, NoReturn

from miro_exact.bad_input import BadInput, did_you_mean
from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.plugins import use_one_of
from miro_protocol.actions import Put, PutValue
from miro_protocol.toml_text import TomlError, struct_of
from miro_robot.wired_board import WiredBoard
from miro_sim.world.conditions import CONDITIONS, Condition, Followed, Heard, Text
from miro_sim.world.events import Cursor, Event
from miro_sim.world.followers import readable, shown
from miro_sim.world.waits import WaitExpired, Waits
from miro_sim.world.wire import BoardAlone
from miro_sim.world.world import World
from mirotwin.testing.device import DeviceUnderTest
from mirotwin.testing.waiting import WaitFailed, shown_where_it_was_called
from mirotwin.verify.checks.happens import expect_of
from mirotwin.verify.checks.interface import ms_ticks

_KEPT = 1 << 16
_PORTS = (0x80, 0x90, 0xA0, 0xB0)


def ticks_of(world: World, within: int | None, within_ms: float | None) -> int | None:
    """Length of a wait in ticks of 24 MHz (for any board): from `within_ms`, or from `within` as `mirotwin.ms` gives
    it.
    """
    if within_ms is not None:
        return ms_ticks(within_ms, world.clock)
    return None if within is None else own_ticks(world, within)


def own_ticks(world: World, duration: int) -> int:
    """A duration as `mirotwin.ms` gives it, in ticks of the board's crystal, rounded half up."""
    return (2 * duration * world.clock + TICKS_PER_SECOND) // (2 * TICKS_PER_SECOND)


class BoardUnderTest(DeviceUnderTest):
    """The board of a test. Values go by PART.KEY, pins by their names (`P2.0`, a net, `eyes.trig`)."""

    def __init__(self, world: World) -> None:
        super().__init__(world, 0, 0)
        device = world.device(0, 0)
        assert isinstance(device, BoardAlone)
        self._device: BoardAlone = device
        self.pressed: dict[str, int] = {}  # until which tick a button is

    @shown_where_it_was_called
    def put(self, path: str, value: PutValue) -> None:
        """Puts a value of a part, as soon as possible: `put("eyes.distance_cm", 60)`."""
        self._device.check_put(path, value)
        tick = self.world.do(Put(self.world.earliest_action_tick, 0, 0, path, value))
        self.world.run_to(tick + 1)

    @shown_where_it_was_called
    def value(self, path: str) -> float | int | bool | str:
        """The present value of a part."""
        return self._device.value(path)

    @shown_where_it_was_called
    def press(self, button: str, for_ms: float = 100.0) -> None:
        """Presses a button, which is let go so long later; no time passes."""
        world, path = self.world, f"{button}.pressed"
        self._device.check_put(path, True)
        tick = world.earliest_action_tick
        if tick <= self.pressed.get(button, -1):
            raise ValueError(f"{button} is pressed until tick {self.pressed[button]}; let it go before")
        self.pressed[button] = tick + ms_ticks(for_ms, world.clock)
        world.do(Put(tick, 0, 0, path, True))
        world.do(Put(self.pressed[button], 0, 0, path, False))

    @shown_where_it_was_called
    def pin(self, name: str) -> int:
        """The level of a pin now."""
        place, board = self._device.find_pin(name), self._device.board
        if not isinstance(board, WiredBoard):
            port, bit = divmod(place.port_pin, 8)
            return board.cpu.sfr(_PORTS[port]) >> bit & 1
        net = board.nets.ports[place.port_pin] if place.net < 0 else place.net
        return board.nets.levels[net] ^ int(place.inverted)

    @shown_where_it_was_called
    def run_for(self, duration: int) -> None:
        """Lets time pass: `run_for(mirotwin.ms(250))`."""
        self.world.run_for(own_ticks(self.world, duration))

    @shown_where_it_was_called
    def wait_for(
        self,
        event: str | Condition,
        *,
        within: int | None = None,
        within_ms: float | None = None,
        **fields: Any,
    ) -> Event:
        """Runs to the first event that fits, with the fields of the step `wait_for`: `wait_for("pulse", pin="P1.2",
        at_least_us=1400, within_ms=50)`. Raises WaitFailed with the events that occurred instead.
        """
        condition = condition_of(event, fields)
        ticks = ticks_of(self.world, within, within_ms)
        return self._until(condition, ticks, f"no {condition}")

    @shown_where_it_was_called
    def never(self, event: str | Condition, for_ms: float, **fields: Any) -> None:
        """Runs for `for_ms`. Raises WaitFailed if an event occurs that fits."""
        self._never(condition := condition_of(event, fields), for_ms, f"no {condition}")

    @shown_where_it_was_called
    def hold(self, event: str | Condition, for_ms: float, **fields: Any) -> None:
        """Runs for `for_ms`.

        Raises WaitFailed if the condition is not true all the time: `hold("value", 5, of="a.b", equals=1)`.
        """
        condition = condition_of(event, fields)
        if not isinstance(condition, Followed) or not condition.LASTS:
            raise BadInput("", "board.hold", f"{condition.what} is not for a time", "use level, duty, value")
        self._never(condition.opposite(), for_ms, f"{condition}")

    def _never(self, condition: Condition, for_ms: float, required: str) -> None:
        world, begun_tick = self.world, self.world.tick
        end_tick = begun_tick + ms_ticks(for_ms, world.clock)
        waits = Waits(world)
        try:
            event = waits.until([condition], end_tick - begun_tick)
        except WaitExpired as expired:
            if expired.tick < end_tick:
                raise WaitFailed.of(expired, world, required) from None
            return
        expect = expect_of("never_happens", condition, begun_tick, max(event.tick, world.tick), True)
        reason = f"{required} for {for_ms:g} ms: broken"
        raise WaitFailed(reason, begun_tick, event.tick, [event], expect, world)

    def __repr__(self) -> str:
        return f"BoardUnderTest({self._device.board!r})"


def condition_of(event: str | Condition, fields: dict[str, Any]) -> Condition:
    """The condition of this kind with these fields. Raises BadInput."""
    if isinstance(event, Condition):
        return event
    kinds = {name: kind for name, kind in CONDITIONS.items() if "board" in kind.SUBJECTS}
    if event not in kinds:
        remedy = did_you_mean(event, kinds, use_one_of(kinds))
        raise BadInput("", "board", f"{event!r} is no event of a board", remedy)
    try:
        return struct_of({**fields, "event": event}, kinds[event])
    except TomlError as error:
        raise BadInput("", f"{event}: {error.place}", error.what, error.remedy) from None


class SerialUnderTest:
    """A terminal at the serial port of the board: `write`, `expect`, `read`."""

    def __init__(self, world: World) -> None:
        self.world = world
        self._waits = Waits(world)
        self._cursor = Cursor(world.lines[0].log)
        self._characters: list[Event] = []

    @shown_where_it_was_called
    def write(self, data: bytes | str, gap_ms: float = 0.0) -> int:
        """Sends characters (a text as UTF-8) after those already queued; no time passes. Returns the number of bytes.

        At the rate of the board's file, or of its receiver, which has to be on then.
        """
        content = data.encode() if isinstance(data, str) else bytes(data)
        if not gap_ms:
            self.world.inject(content)
            return len(content)
        tick = None
        for value in content:
            tick = self.world.inject(bytes([value]), 0, tick)
            tick += self.world.lines[0].outbox.character_ticks + ms_ticks(gap_ms, self.world.clock)
        return len(content)

    @shown_where_it_was_called
    def expect(
        self,
        text: str | bytes | None = None,
        *,
        pattern: str | None = None,
        within: int | None = None,
        within_ms: float | None = None,
    ) -> re.Match[bytes]:
        """Waits until the board has sent this text, or text that matches the pattern, and returns the match. The match
        and all text before it are consumed. Text sent before this call and not yet consumed counts. Raises WaitFailed.
        """
        plain = text.decode("utf-8", "backslashreplace") if isinstance(text, bytes) else text
        condition = Text(text=plain, pattern=pattern)
        raw = text if isinstance(text, bytes) else (text or "").encode()
        searched = re.compile(re.escape(raw) if pattern is None else pattern.encode())
        world, begun_tick = self.world, self.world.tick
        remaining = ticks_of(world, within, within_ms)
        end_tick = None if remaining is None else begun_tick + remaining
        events: list[Event] = []
        while True:
            self._gather()
            if match := searched.search(bytes(event.value for event in self._characters)):
                del self._characters[: match.end()]
                return match
            remaining = None if end_tick is None else max(0, end_tick - world.tick)
            try:
                events.append(self._waits.until([Heard()], remaining))
            except WaitExpired as expired:
                self._failed(condition, begun_tick, expired, events)

    def _failed(
        self, condition: Text, begun_tick: int, expired: WaitExpired, events: list[Event]
    ) -> NoReturn:
        tail = bytes(event.value for event in self._characters)[-60:]
        have = f"sent was {shown(readable(tail))}" if tail else "nothing was sent"
        failed = WaitFailed.of(
            expired, self.world, f"no {condition}, {have}", begun_tick, events, judged=False
        )
        if expired.tick > begun_tick:
            failed.expect = expect_of("happens", condition, begun_tick, expired.tick, True)
        raise failed from None

    @shown_where_it_was_called
    def read(self) -> bytes:
        """Everything that the board has sent and that is not yet consumed; no time passes."""
        self._gather()
        data = bytes(event.value for event in self._characters)
        self._characters.clear()
        return data

    def _gather(self) -> None:
        cursor = self._cursor
        for serial, event in cursor.log.since(cursor.next, ("heard",)):
            if event.tick > self.world.tick:
                break
            cursor.next = serial + 1
            self._characters.append(event)
        del self._characters[:-_KEPT]

    def __repr__(self) -> str:
        return f"SerialUnderTest({len(self._characters)} characters not taken)"
