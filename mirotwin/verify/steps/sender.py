"""The hosts of a run with steps: what they send, under which numbers, and the stream of frames that goes on by itself.

Numbers: each frame takes the next of 64; a poll the next whose turn is the robot's that is asked. A stream announces
each frame just before it goes out, so that a step can change or end it at any time; a frame that finds the transmitter
busy follows.
"""

from __future__ import annotations

import msgspec

from miro_exact.clock import NEVER_TICK
from miro_host.wheels import Wheels
from miro_protocol.frames import ServiceFrame, TeamFrame, encode
from miro_protocol.table import FRESH_STEPS, SEQ_MODULUS, FrameType
from miro_sim.world.world import World
from mirotwin.verify.steps.keys import StreamStep
from mirotwin.verify.steps.sends import Send, SendBytes, SendFrame, SendPoll, SendService, SendTeam

WHEELS = Wheels()


class Stream(msgspec.Struct):
    """Team frames to come: the next one's first start bit is due at `due_tick`; `left` of them, None: no end."""

    due_tick: int
    every_ticks: int
    lead_ticks: int
    ask: bool
    left: int | None


class Host:
    """That of one network. `told`: the velocities of all slots, `last_seq`: the number that was sent last."""

    def __init__(self, world: World, network: int) -> None:
        self.world = world
        self.network = network
        spec = world.scenario.networks[network]
        self.robots = spec.robots
        self.first_slot = min(robot.slot for robot in spec.robot)
        self.told = [(0, 0)] * self.robots
        self.last_seq = 0
        self.stream: Stream | None = None

    def send(self, what: Send) -> None:
        """Puts it on the air as soon as the transmitter is free. Raises ValueError for what cannot be sent."""
        if isinstance(what, SendBytes):
            data, bad_stop = what.characters()
            self.world.inject(data, self.network, bad_stop=bad_stop)
            return
        assert isinstance(what, SendFrame)
        data = what.damaged(encode(self._frame(what), self.robots), self.robots)
        self.world.inject(data, self.network, bad_stop=what.bad_stop)

    def _frame(self, what: SendFrame) -> TeamFrame | ServiceFrame:
        seq, slot = what.seq, getattr(what, "slot", None)
        if slot is None:
            slot = self.first_slot
        if isinstance(what, SendPoll):
            seq = self._turn_of(slot) if seq is None else seq
        self.last_seq = seq = self._next() if seq is None else seq
        if isinstance(what, SendService):
            return what.frame(seq, slot)
        ask = isinstance(what, SendPoll)
        if isinstance(what, SendTeam):
            ask = what.ask
            self.tell(slot, what.left_m_s, what.right_m_s)
            for at, (left, right) in enumerate(what.team_m_s or ()):
                self.tell(at, left, right)
        return self._team(seq, ask)

    def _team(self, seq: int, ask: bool) -> TeamFrame:
        return TeamFrame(FrameType.TEAM_ASK if ask else FrameType.TEAM, seq, tuple(self.told))

    def tell(self, slot: int, left_m_s: float | None, right_m_s: float | None) -> None:
        """New velocities of one robot; None: as before."""
        left, right = self.told[slot]
        left = left if left_m_s is None else WHEELS.counts(left_m_s)
        right = right if right_m_s is None else WHEELS.counts(right_m_s)
        self.told[slot] = (left, right)

    def _next(self) -> int:
        return (self.last_seq + 1) % SEQ_MODULUS

    def _turn_of(self, slot: int) -> int:
        for step in range(1, FRESH_STEPS + 1):
            seq = (self.last_seq + step) % SEQ_MODULUS
            if seq % self.robots == slot:
                return seq
        what = f"no number that is fresh after {self.last_seq} asks robot {slot}"
        raise ValueError(f"{what}: 64 is no multiple of {self.robots}; send a team frame before")

    # The stream

    def begin(self, step: StreamStep) -> None:
        """Frames from now on."""
        slot = self.first_slot if step.slot is None else step.slot
        self.tell(slot, step.left_m_s, step.right_m_s)
        now = self.world.tick
        due_tick = self.world.earliest_tick(self.network)
        self.stream = Stream(due_tick, step.every_ticks, due_tick - now, step.ask, step.frames)

    @property
    def next_tick(self) -> int:
        """When the next frame of the stream has to be announced."""
        return NEVER_TICK if self.stream is None else self.stream.due_tick - self.stream.lead_ticks

    def top_up(self) -> None:
        """Announces the frames that are due."""
        while self.stream is not None and self.next_tick <= self.world.tick:
            stream, self.last_seq = self.stream, self._next()
            self.world.inject(encode(self._team(self.last_seq, stream.ask), self.robots), self.network)
            stream.due_tick += stream.every_ticks
            if stream.left is not None:
                stream.left -= 1
                if not stream.left:
                    self.stream = None
