"""The band up, as the PC's receiver hears it: the TXD wires of all robots of a network mixed into one level.

At tick t, with u = t - latency,

* a robot's carrier is up while its TXD had an edge in (u - 50000, u], from its first start bit until two
  characters after its last edge, unless its `dropouts` chain is bad in slot u // 2500;
* the level is the AND of the TXD levels of the robots whose carrier is up (two at once: space wins);
* with any carrier up it is inverted if the `errors` stream is below the threshold at index u // 2500; the
  threshold is that of a burst if the `bursts` chain of one of them is bad in slot u // 2500;
* with none it is mark: this band's receiver is always squelched;
* while the radio is down no carrier is up; in noise the level is the bit of the `noise` stream at index t // 2500.

Sampling it as a UART is the business of `uplink`.
"""

from __future__ import annotations

from miro_exact.clock import HOST_BIT_TICKS, HOST_CHARACTER_TICKS, NEVER_TICK
from miro_exact.rng import Stream
from miro_robot.mcs51.line import Line
from miro_sim.radio.chain import Chain
from miro_sim.radio.params import DOWN, NOISE, UP, Radio

_NEVER = NEVER_TICK
_BIT = 2500
_HOLD = 50_000
_UP, _DOWN, _NOISE = UP, DOWN, NOISE
assert (HOST_BIT_TICKS, 2 * HOST_CHARACTER_TICKS) == (_BIT, _HOLD)


class Transmitter:
    """One robot's TXD wire and the tick of the last edge that the receiver has come past (-1: none yet).

    Its chains are called NAME/bursts and NAME/dropouts.
    """

    STATE = {"last_edge": ("q", -1, NEVER_TICK)}
    NOT_STATE = ("bursts", "dropouts", "line")

    def __init__(self, line: Line, params: Radio, seed: int, name: str) -> None:
        self.line = line
        self.bursts = None if params.bursts is None else Chain(params.bursts, seed, f"{name}/bursts")
        self.dropouts = None if params.dropouts is None else Chain(params.dropouts, seed, f"{name}/dropouts")
        self.last_edge = -1

    def reseed(self, seed: int, slot: int) -> None:
        """The chains of another seed from `slot` on."""
        for chain in (self.bursts, self.dropouts):
            if chain is not None:
                chain.reseed(seed, slot)


class Band:
    """The mixed level. Ticks are the receiver's; queries come in ascending order, below `limit`."""

    STATE = {"link_state": ("i", 0, NOISE), "transmitters": [Transmitter]}
    NOT_STATE = (
        "alone", "alone_until", "burst_threshold", "chained", "change_tick", "errors", "known", "latency",
        "name", "noise", "params", "seed", "threshold",
    )  # fmt: skip

    def __init__(self, params: Radio, seed: int, name: str) -> None:
        self.params = params
        self.seed = seed
        self.name = name
        self.errors = Stream(seed, f"{name}/errors")
        self.noise = Stream(seed, f"{name}/noise")
        self.link_state = UP
        self.latency = params.latency_ticks
        self.threshold = params.error_threshold
        self.burst_threshold = params.burst_threshold
        self.chained = params.bursts is not None or params.dropouts is not None
        self.transmitters: list[Transmitter] = []
        self.known = 1  # the answer before `change_tick`
        self.change_tick = 0
        self.alone: Transmitter | None = None  # on the air before `alone_until`; nothing disturbs it
        self.alone_until = -_NEVER

    def add(self, robot: int, line: Line) -> None:
        """Adds a robot's TXD wire, before anything is received; `robot` is its number in the names of streams."""
        line.unread = False
        self.transmitters.append(Transmitter(line, self.params, self.seed, f"{self.name}/robot{robot}"))

    def reseed(self, seed: int, tick: int) -> None:
        """The noise of another seed from `tick` on."""
        self.change_tick, self.alone_until = 0, -_NEVER  # found with the old seed's errors
        self.errors.reseed(seed)
        self.noise.reseed(seed)
        for transmitter in self.transmitters:
            transmitter.reseed(seed, (tick - self.latency) // _BIT)

    def limit(self) -> int:
        """The tick up to which the robots' wires, and so the level, are final."""
        limit = _NEVER
        for transmitter in self.transmitters:
            limit = min(limit, transmitter.line.settled_tick + self.latency)
        return limit

    def level(self, tick: int) -> int:
        """The level at `tick` in bit 0; bit 1 is set if it is inverted by an error. It stays up to `change_tick`."""
        if tick >= self.change_tick:
            sent = tick - self.latency
            alone = self.alone
            if sent < self.alone_until and alone is not None:  # its wire has an edge after the last query
                alone.last_edge = alone.line.edge_at(sent)
                self.known = alone.line.level_at(sent)
                self.change_tick = min(alone.line.next_edge(sent), self.alone_until) + self.latency
            else:
                self._look(sent)
        return self.known

    def _look(self, sent: int) -> None:
        """Mixes all wires, and finds up to when what was found holds."""
        slot = sent // _BIT
        level = 1
        keyed = carriers = 0
        threshold = self.threshold
        change = own_edge = _NEVER
        for transmitter in self.transmitters:
            line = transmitter.line
            transmitter.last_edge = max(transmitter.last_edge, line.edge_at(sent))
            if transmitter.last_edge < 0 or sent >= transmitter.last_edge + _HOLD:
                change = min(change, line.next_edge(sent))
                continue
            keyed += 1
            change = min(change, transmitter.last_edge + _HOLD)
            own_edge = min(own_edge, line.next_edge(sent))
            if transmitter.dropouts is not None and transmitter.dropouts.bad(slot):
                continue
            if transmitter.bursts is not None and transmitter.bursts.bad(slot):
                threshold = self.burst_threshold
            carriers += 1
            level &= line.level_at(sent)
            self.alone = transmitter
        wrong = carriers > 0 and self.errors.below(slot, threshold)
        if keyed and (wrong or self.chained):
            change = min(change, (slot + 1) * _BIT)
        elif keyed:
            change = min(change, self.errors.next_below(slot + 1, change // _BIT + 1, threshold) * _BIT)
        one_alone = keyed == 1 and not wrong and not self.chained and self.link_state == _UP
        self.alone_until = change if one_alone else -_NEVER
        change = min(change, own_edge)
        self.known = (level ^ 1) | 2 if wrong else level
        if self.link_state == _NOISE:
            slot = (sent + self.latency) // _BIT
            self.known = self.noise.bit(slot)
            change = min(change, (slot + 1) * _BIT - self.latency)
        elif self.link_state == _DOWN:
            self.known = 1
        self.change_tick = change + self.latency

    def hear(self, tick: int) -> None:
        """The receiver has reached `tick`: drops edges from the robots' wires that no later query needs.

        The wires' future is unknown, so the next query reads them again. Later queries are about `last_edge` or later,
        so the edges behind it and the level between are enough.
        """
        self.change_tick, self.alone_until = 0, -_NEVER
        for transmitter in self.transmitters:
            transmitter.line.forget(transmitter.last_edge)
            transmitter.line.hear(tick)

    def full_tick(self) -> int:
        """The first tick at which 2048 edges of one robot wait for the receiver, NEVER_TICK if there is none.

        A robot with a full wire stops, and continues when this tick was received.
        """
        tick = _NEVER
        for transmitter in self.transmitters:
            tick = min(tick, transmitter.line.full_tick())
        return tick
