"""The host of a network for which a test or a step speaks: frames with their numbers, put on the air of a machine."""

from __future__ import annotations

from collections.abc import Sequence

from miro_protocol.frames import Message, TeamFrame, asking_step, encode, format_of
from miro_protocol.table import FRESH_STEPS, SEQ_MODULUS, FrameType
from miro_sim.world.machine import Machine

Pair = tuple[int, int]
"""(left, right) in 1/256 count per LM629 sample."""


class FrameSender:
    """`seq`: the number that was sent last; `velocities`: of all slots, sent last."""

    def __init__(self, machine: Machine, network: int, seq: int) -> None:
        self.machine = machine
        self.network = network
        self.robots: int = machine.networks[network].spec.robots
        self.seq = seq
        self.velocities: list[Pair] = [(0, 0)] * self.robots

    def next_seq(self) -> int:
        return (self.seq + 1) % SEQ_MODULUS

    def asking_seq(self, slot: int) -> int:
        """The next number with which robot `slot` must answer. Raises ValueError if that is not fresh any more."""
        step = asking_step(self.seq, slot, self.robots)
        if step > FRESH_STEPS:
            reason = f"no number that is fresh after {self.seq} asks robot {slot}"
            raise ValueError(f"{reason}: 64 is not a multiple of {self.robots}; send a team frame before")
        return (self.seq + step) % SEQ_MODULUS

    def team(self, ask: bool, seq: int | None = None, velocities: Sequence[Pair] | None = None) -> TeamFrame:
        """These velocities, or those as before, under this number or the next one."""
        kind = FrameType.TEAM_ASK if ask else FrameType.TEAM
        pairs = tuple(self.velocities if velocities is None else velocities)
        return TeamFrame(kind, self.next_seq() if seq is None else seq, pairs)

    def put(
        self,
        message: Message,
        at_tick: int | None = None,
        bad_stop: Sequence[int] = (),
        wrong_bits: Sequence[int] = (),
    ) -> int:
        """Puts a frame on the air and returns the tick of its first start bit. Raises ValueError if it cannot be sent.

        `wrong_bits` are sent wrong, counted from the first of HDR; `bad_stop`: characters with a bad stop bit.
        """
        form, data = format_of(message, self.robots), bytearray(encode(message, self.robots))
        first = len(form.lead) + len(form.sync)
        for bit in wrong_bits:
            data[first + bit // 8] ^= 1 << bit % 8
        tick = self.machine.inject(bytes(data), self.network, at_tick, tuple(bad_stop))
        self.seq = message.seq
        if isinstance(message, TeamFrame):
            self.velocities = list(message.velocities)
        return tick
