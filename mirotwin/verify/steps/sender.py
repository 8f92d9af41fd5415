"""The hosts of a run with steps: what a step sends, and the stream of frames that goes on by itself.

A stream announces each frame just before it goes out, so that a step can change or end it at any time; a frame that
finds the transmitter busy follows.
"""

from __future__ import annotations

import msgspec

from miro_exact.clock import NEVER_TICK
from miro_host.wheels import Wheels
from miro_protocol.frames import ServiceFrame, TeamFrame
from miro_sim.world.world import World
from mirotwin.verify.frame_sender import FrameSender
from mirotwin.verify.steps.sends import Send, SendBytes, SendFrame, SendPoll, SendService, SendTeam

WHEELS = Wheels()


class Stream(msgspec.Struct):
    """Team frames to come: the next one's first start bit is due at `due_tick`; `left` of them, None: no end."""

    due_tick: int
    every_ticks: int
    lead_ticks: int
    ask: bool
    left: int | None


class Host(FrameSender):
    """That of one network; its first frame has number 1."""

    def __init__(self, world: World, network: int) -> None:
        super().__init__(world, network, 0)
        self.first_slot = min(robot.slot for robot in world.scenario.networks[network].robot)
        self.stream: Stream | None = None

    def send(self, what: Send) -> None:
        """Puts it on the air as soon as the transmitter is free. Raises ValueError for what cannot be sent."""
        if isinstance(what, SendBytes):
            data, bad_stop = what.characters()
            self.world.inject(data, self.network, bad_stop=bad_stop)
            return
        assert isinstance(what, SendFrame)
        self.put(self._frame(what), bad_stop=what.bad_stop, wrong_bits=what.wrong_bits)

    def _frame(self, what: SendFrame) -> TeamFrame | ServiceFrame:
        slot = getattr(what, "slot", None)
        slot = self.first_slot if slot is None else slot
        if isinstance(what, SendService):
            return what.frame(self.next_seq() if what.seq is None else what.seq, slot)
        if isinstance(what, SendPoll):
            return self.team(True, self.asking_seq(slot) if what.seq is None else what.seq)
        assert isinstance(what, SendTeam)
        self.command(slot, what.left_m_s, what.right_m_s)
        for at, (left, right) in enumerate(what.team_m_s or ()):
            self.command(at, left, right)
        return self.team(what.ask, what.seq)

    def command(self, slot: int, left_m_s: float | None, right_m_s: float | None) -> None:
        """New velocities of one robot; None: as before."""
        left, right = self.velocities[slot]
        left = left if left_m_s is None else WHEELS.counts(left_m_s)
        right = right if right_m_s is None else WHEELS.counts(right_m_s)
        self.velocities[slot] = (left, right)

    # The stream

    def begin(self, every_ticks: int, frames: int | None, ask: bool) -> None:
        """Frames from now on, with the velocities that were sent or commanded last."""
        now = self.world.tick
        due_tick = self.world.earliest_tick(self.network)
        self.stream = Stream(due_tick, every_ticks, due_tick - now, ask, frames)
        self.top_up()

    @property
    def next_tick(self) -> int:
        """When the next frame of the stream has to be announced."""
        return NEVER_TICK if self.stream is None else self.stream.due_tick - self.stream.lead_ticks

    def top_up(self) -> None:
        """Announces the frames that are due."""
        while self.stream is not None and self.next_tick <= self.world.tick:
            stream = self.stream
            self.put(self.team(stream.ask))
            stream.due_tick += stream.every_ticks
            if stream.left is not None:
                stream.left -= 1
                if not stream.left:
                    self.stream = None
