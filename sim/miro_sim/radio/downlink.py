"""The band down: one transmitter, and one receiver per robot of the network.

A transmission handed over for tick s arrives at s + latency + jitter, or when the one before it is over.
The jitter is drawn from `NAME/jitter` at index s // 2500: 0 .. jitter_ticks, all alike. A transmission that
`NAME/lost_frames` loses at that index is never on the air: the PC takes it for sent, robots hear no carrier.
Networks on one frequency hear each other (`overhear`); the bands up stay apart.
"""

from __future__ import annotations

from miro_exact.clock import HOST_BIT_TICKS, HOST_CHARACTER_TICKS, ticks
from miro_exact.rng import Stream
from miro_exact.state import TICK
from miro_robot.mcs51.line import Line
from miro_sim.radio.listener import Listener
from miro_sim.radio.params import Radio, threshold
from miro_sim.radio.sender import Sender

_BIT = HOST_BIT_TICKS
_CHARACTER_TICKS = HOST_CHARACTER_TICKS
MEMORY_TICKS = 2 * HOST_BIT_TICKS
"""Time for which another network's transmission is stored after its end: a bit that it disturbed may still be under
way.
"""


class TransmissionError(ValueError):
    """A transmission that does not fit the ones already on the air."""


class Downlink:
    """A transmitter with its listeners; streams are called NAME/jitter and NAME/robotK/...

    `settled_tick`: every listener's line is final below it. `free_tick`: the transmitter is busy until then.
    `busy_tick`: at the listeners the last transmission is over by then; part of the state only if there is
    jitter or an offset, because else it follows from `free_tick`. The lines' content is not part of
    this state: it belongs to the parts that own the lines.
    """

    STATE = {
        "settled_tick": TICK,
        "free_tick": TICK,
        "busy_tick": TICK,
        "sender": Sender,
        "listeners": [Listener],
        "overheard": [Sender],
    }
    NOT_STATE = (
        *("audience", "jitter", "jitter_ticks", "lost", "lost_threshold"),
        *("name", "params", "seed"),
    )

    def __init__(self, params: Radio, seed: int, name: str) -> None:
        self.params = params
        self.seed = seed
        self.name = name
        self.jitter = Stream(seed, f"{name}/jitter")
        self.lost = Stream(seed, f"{name}/lost_frames")
        self.jitter_ticks = ticks(params.jitter_s)
        self.lost_threshold = threshold(params.lost_frames)
        self.listeners: dict[int, Listener] = {}
        self.sender = Sender(params, params.crystal_offset_ppm)
        self.overheard: list[Sender] = []
        self.audience: list[tuple[Downlink, Sender]] = []
        self.settled_tick = 0
        self.free_tick = 0
        self.busy_tick = 0

    def __repr__(self) -> str:
        waiting = [(start, data.hex(" ")) for start, data, _ in self.sender.transmissions]
        robots = [*self.listeners]
        return f"Downlink({self.name!r}, robots {robots}, settled_tick={self.settled_tick}, {waiting})"

    def listen(self, robot: int, line: Line) -> Listener:
        """Connects a robot's RXD wire: once, before anything is settled."""
        listener = Listener(line, self.params, self.seed, f"{self.name}/robot{robot}")
        self.listeners[robot] = listener
        line.settled_tick = 0  # an open wire stays at mark
        return listener

    def reseed(self, seed: int, tick: int) -> None:
        """The noise of another seed from `tick` on."""
        self.jitter.reseed(seed)
        self.lost.reseed(seed)
        for listener in self.listeners.values():
            listener.reseed(seed, tick)

    def overhear(self, other: Downlink) -> None:
        """Puts another network on this one's frequency, before tick 0: the robots of this one hear it too."""
        heard = Sender(other.params, self.params.crystal_offset_ppm)
        self.overheard.append(heard)
        other.audience.append((self, heard))

    def send(self, start_tick: int, data: bytes, bad_stop: tuple[int, ...] = ()) -> int:
        """Transmits `data` without a gap, the first start bit at `start_tick`; returns `free_tick`.

        `bad_stop`: indices of the characters whose stop bit is bad (`sender`). Raises TransmissionError when nothing is
        to be sent, when the previous transmission is not over by then, and when a robot that hears it is settled past
        the tick at which the carrier comes up.
        """
        if not data:
            raise TransmissionError(f"{self.name}: a transmission needs at least one byte")
        if start_tick < self.free_tick:
            raise TransmissionError(
                f"{self.name}: start at tick {start_tick}, but busy until {self.free_tick}"
            )
        lead = 0 if self.sender.always_on else self.sender.keyup
        key_tick = max(start_tick - lead, 0) + self.sender.latency
        settled_tick = self.settled_tick
        for link, _ in self.audience:
            settled_tick = max(settled_tick, link.settled_tick)
        if key_tick < settled_tick:
            raise TransmissionError(
                f"{self.name}: the carrier for tick {start_tick} reaches the robots at tick {key_tick},"
                f" but they are settled up to {settled_tick}"
            )
        stops = bytes([place in bad_stop for place in range(len(data))]) if bad_stop else b""
        slot = start_tick // _BIT
        late = self.jitter.u32(slot) * (self.jitter_ticks + 1) >> 32 if self.jitter_ticks else 0
        arrival = max(start_tick + self.sender.latency + late, self.busy_tick)
        on_air = arrival, bytes(data), stops
        air_ticks = len(data) * _CHARACTER_TICKS
        self.free_tick = start_tick + air_ticks
        self.busy_tick = max(arrival + air_ticks, self.sender.end(arrival, len(data)))
        if not self.lost_threshold or not self.lost.below(slot, self.lost_threshold):
            self.sender.transmissions.append(on_air)
            for _, sender in self.audience:
                sender.transmissions.append(on_air)
        return self.free_tick

    def settle(self, until_tick: int) -> None:
        """Makes every listener's line final for ticks below `until_tick`; no effect if it is already."""
        if until_tick <= self.settled_tick:
            return
        senders = [self.sender, *self.overheard]
        for listener in self.listeners.values():
            if listener.rxd_state == 0:
                listener.fill(self.settled_tick, until_tick, senders, 0)
            else:
                listener.fill_broken(self.settled_tick, until_tick, senders, 0)
            listener.line.settled_tick = until_tick
        self.settled_tick = until_tick
        self.sender.forget(until_tick)
        for sender in self.overheard:
            sender.forget(until_tick - MEMORY_TICKS)
