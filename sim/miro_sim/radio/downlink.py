"""The band down: one transmitter, and every robot of the network listening with a receiver of its own.

What belongs here: the level on each robot's RXD wire as a function of time. At tick t, with u = t - latency,

* a bit of a transmission that began at tick s <= u: the bit number (u - s) // 2500 of its 8N1 characters,
inverted
  if the listener's `errors` stream is below the threshold at index (tick at which that bit began) // 2500;
* otherwise, with a carrier (always on, or within the key-up before s): mark;
* otherwise mark if squelched, else the bit of the listener's `noise` stream with index t // 2500.

Bits never overlap, so no two have the same error index. All of it depends on what was sent and on t alone,
not on how often or up to where `settle` was called.
"""

from __future__ import annotations

from miro_robot.mcs51.line import Line
from msgspec import convert

from miro_sim.clock import CHARACTER_BITS, HOST_BIT_TICKS, HOST_CHARACTER_TICKS
from miro_sim.radio.params import RadioParams
from miro_sim.rng import Stream

_BIT = 2500
_CHARACTER = 10
assert (HOST_BIT_TICKS, CHARACTER_BITS) == (_BIT, _CHARACTER)


class Listener:
    """One robot's receiver. `bit_errors` counts the bits inverted on its way so far."""

    NOT_STATE = ("errors", "latency", "line", "noise", "threshold")

    def __init__(self, line: Line, params: RadioParams, seed: int, name: str) -> None:
        self.line = line
        self.errors = Stream(seed, f"{name}/errors")
        self.noise = Stream(seed, f"{name}/noise")
        self.latency = params.latency_ticks
        self.threshold = params.error_threshold
        self.bit_errors = 0

    def hear_noise(self, tick: int, until: int) -> None:
        """Slicer noise from `tick` to `until`."""
        slot = tick // _BIT
        while tick < until:
            self.line.append(tick, self.noise.bit(slot))
            slot += 1
            tick = slot * _BIT

    def hear_data(self, tick: int, until: int, start: int, data: bytes) -> None:
        """Part of a transmission whose first start bit arrives at `start`."""
        number = (tick - start) // _BIT
        last = (until - start + _BIT - 1) // _BIT
        while number < last:
            begin = start + number * _BIT
            place = number % _CHARACTER
            if place == 0:
                level = 0
            elif place == _CHARACTER - 1:
                level = 1
            else:
                level = (data[number // _CHARACTER] >> (place - 1)) & 1
            if self.errors.below((begin - self.latency) // _BIT, self.threshold):
                level ^= 1
                if begin >= tick:  # else the bit was counted when it began
                    self.bit_errors += 1
            self.line.append(max(begin, tick), level)
            number += 1

    def snapshot(self) -> dict[str, object]:
        return {"bit_errors": self.bit_errors}

    def restore(self, state: dict[str, object]) -> None:
        self.bit_errors = convert(state["bit_errors"], int)


class Downlink:
    """A transmitter with its listeners; streams are called NAME/robotK/errors and NAME/robotK/noise.

    `settled_tick`: every listener's line is final below it. `free_tick`: the transmitter is busy until then.
    The lines' content is not part of the snapshot; it belongs to whoever owns them.
    """

    NOT_STATE = ("always_on", "keyup", "latency", "name", "params", "seed", "squelch")

    def __init__(self, params: RadioParams, seed: int, name: str) -> None:
        self.params = params
        self.seed = seed
        self.name = name
        self.latency = params.latency_ticks
        self.keyup = params.keyup_ticks
        self.always_on = params.carrier == "on"
        self.squelch = params.squelch
        self.listeners: dict[int, Listener] = {}
        self.transmissions: list[tuple[int, bytes]] = []  # arrival tick of the first start bit, bytes
        self.settled_tick = 0
        self.free_tick = 0

    def __repr__(self) -> str:
        waiting = [(start, data.hex(" ")) for start, data in self.transmissions]
        robots = [*self.listeners]
        return f"Downlink({self.name!r}, robots {robots}, settled_tick={self.settled_tick}, {waiting})"

    def listen(self, robot: int, line: Line) -> Listener:
        """Connects a robot's RXD wire: once and before anything is settled, else ValueError."""
        if self.settled_tick or robot in self.listeners:
            raise ValueError(f"{self.name}: robot {robot} is connected twice, or after tick 0")
        listener = Listener(line, self.params, self.seed, f"{self.name}/robot{robot}")
        self.listeners[robot] = listener
        line.settled_tick = 0  # an open wire is mark for ever
        return listener

    def send(self, start_tick: int, data: bytes) -> int:
        """Transmits `data` without a gap, the first start bit at `start_tick`; returns `free_tick`.

        Raises ValueError when nothing is to be sent, when the previous transmission is not over by then,
        and when the wires are settled past the tick at which the carrier comes up.
        """
        if not data:
            raise ValueError(f"{self.name}: a transmission needs at least one byte")
        if start_tick < self.free_tick:
            raise ValueError(f"{self.name}: start at tick {start_tick}, but busy until {self.free_tick}")
        key_tick = start_tick if self.always_on else max(start_tick - self.keyup, 0)
        if key_tick + self.latency < self.settled_tick:
            raise ValueError(
                f"{self.name}: the carrier for tick {start_tick} reaches the robots at tick"
                f" {key_tick + self.latency}, but they are settled up to {self.settled_tick}"
            )
        self.transmissions.append((start_tick + self.latency, bytes(data)))
        self.free_tick = start_tick + len(data) * HOST_CHARACTER_TICKS
        return self.free_tick

    def settle(self, until_tick: int) -> None:
        """Makes every listener's line final for ticks below `until_tick`; no effect if it is already."""
        if until_tick <= self.settled_tick:
            return
        for listener in self.listeners.values():
            self.fill(listener, self.settled_tick, until_tick)
            listener.line.settled_tick = until_tick
        self.settled_tick = until_tick
        while self.transmissions and self.end(0) <= until_tick:
            del self.transmissions[0]

    def end(self, index: int) -> int:
        """Tick at which the last stop bit of a waiting transmission is over at the listeners."""
        start, data = self.transmissions[index]
        return start + len(data) * HOST_CHARACTER_TICKS

    def fill(self, listener: Listener, tick: int, until: int) -> None:
        """One listener's edges for `tick` up to but not including `until`."""
        for index in range(len(self.transmissions)):
            start, data = self.transmissions[index]
            tick = self.wait(listener, tick, min(until, start - self.keyup))
            if tick < min(until, start):
                listener.line.append(tick, 1)
                tick = min(until, start)
            stop = min(until, self.end(index))
            if tick < stop:
                listener.hear_data(tick, stop, start, data)
                tick = stop
        self.wait(listener, tick, until)

    def wait(self, listener: Listener, tick: int, until: int) -> int:
        """What a listener hears between transmissions; returns the tick reached."""
        if tick >= until:
            return tick
        if self.always_on or self.squelch:
            listener.line.append(tick, 1)
        else:
            listener.hear_noise(tick, until)
        return until

    def snapshot(self) -> dict[str, object]:
        return {
            "settled_tick": self.settled_tick,
            "free_tick": self.free_tick,
            "transmissions": [[start, data] for start, data in self.transmissions],
            "listeners": [listener.snapshot() for listener in self.listeners.values()],
        }

    def restore(self, state: dict[str, object]) -> None:
        """Raises ValueError when the snapshot is of a network with another number of listeners."""
        self.settled_tick = convert(state["settled_tick"], int)
        self.free_tick = convert(state["free_tick"], int)
        self.transmissions = convert(state["transmissions"], list[tuple[int, bytes]])
        heard = convert(state["listeners"], list[dict[str, object]])
        for listener, its_state in zip(self.listeners.values(), heard, strict=True):
            listener.restore(its_state)
