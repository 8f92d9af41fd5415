"""What a host may say in a step: one frozen struct a kind, with its keys, and the frame that it becomes."""

from __future__ import annotations

import re
from typing import Annotated

import msgspec
from msgspec import Meta

from miro_exact.bad_input import amount
from miro_host.wheels import TICKS_PER_S, TICKS_PER_SAMPLE, UNITS_PER_COUNT, Wheels, nearest
from miro_protocol.frames import ServiceFrame
from miro_protocol.table import DOWNLINK, SEQ_MODULUS, Opcode
from miro_sim.world.conditions import Network, Slot, SpeedMS

CHARACTER = re.compile(r"([0-9a-fA-F]{2})(!?)")
MOST_ACCELERATION_M_S2 = 16_000.0
FilterWord = Annotated[int, Meta(ge=0, le=0x7FFF)]
Pair = tuple[SpeedMS, SpeedMS]


class Send(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    kw_only=True,
    tag_field="send",
    omit_defaults=True,
):
    """Base: the host of `network` sends something once."""

    network: Network = 0

    @property
    def name(self) -> str:
        return str(self.__struct_config__.tag)

    def problem(self, robots: int) -> str:
        """What is wrong with its keys on a network of `robots` slots: `what; remedy`, or the empty string."""
        slot = getattr(self, "slot", None)
        return "" if slot is None else beyond(slot, robots)


def beyond(slot: int, robots: int) -> str:
    """What is wrong with a slot that a network of so many does not have, or the empty string."""
    if slot < robots:
        return ""
    return f"slot: {slot} does not exist on a network of {robots} robots; use 0 to {robots - 1}"


class SendFrame(Send, frozen=True, kw_only=True):
    """Base of frames. `seq`: left out, the next one that is fresh. `wrong_bits`: bits that are sent wrong, counted from
    the first of HDR in the order in which they are sent; `bad_stop`: characters whose stop bit is space, counted from
    the first of the preamble.
    """

    seq: Annotated[int, Meta(ge=0, lt=SEQ_MODULUS)] | None = None
    wrong_bits: tuple[int, ...] = ()
    bad_stop: tuple[int, ...] = ()

    def problem(self, robots: int) -> str:
        form = DOWNLINK[robots]
        first = len(form.lead) + len(form.sync)
        bits = 8 * (form.wire_size - first)
        for bit in self.wrong_bits:
            if not 0 <= bit < bits:
                return f"wrong_bits: {bit} is none of {bits} bits from HDR to CRC; use 0 to {bits - 1}"
        before = -1
        for place in self.bad_stop:
            if not before < place < form.wire_size:
                what = f"bad_stop: {list(self.bad_stop)} are not characters of the frame in their order"
                return f"{what}; use 0 to {form.wire_size - 1}"
            before = place
        return super().problem(robots)


class SendTeam(SendFrame, frozen=True, kw_only=True, tag="team"):
    """Velocities. A wheel that is not given keeps what it was told last; at first that is 0.

    `left_m_s`, `right_m_s`: of the robot in `slot` (left out: the network's first); or `team_m_s`: of all slots. `ask`:
    a frame of type 3, to which robot (seq mod N) answers.
    """

    slot: Slot | None = None
    left_m_s: SpeedMS | None = None
    right_m_s: SpeedMS | None = None
    team_m_s: tuple[Pair, ...] | None = None
    ask: bool = False

    def problem(self, robots: int) -> str:
        if self.team_m_s is not None and len(self.team_m_s) != robots:
            pairs = amount(len(self.team_m_s), "pair")
            return f"team_m_s: {pairs} for {robots} slots; give one pair [left, right] a slot"
        one = (self.slot, self.left_m_s, self.right_m_s)
        if self.team_m_s is not None and one != (None, None, None):
            return "team_m_s: tells all slots; leave out slot, left_m_s and right_m_s"
        return super().problem(robots)


class SendPoll(SendFrame, frozen=True, kw_only=True, tag="poll"):
    """A team frame of type 3 whose number asks the robot in `slot` to answer; all velocities as they were told last."""

    slot: Slot | None = None

    def problem(self, robots: int) -> str:
        if None not in (self.seq, self.slot) and self.seq % robots != self.slot:  # type: ignore[operator]
            return f"seq: {self.seq} does not ask robot {self.slot}; leave it out"
        return super().problem(robots)


class SendService(SendFrame, frozen=True, kw_only=True):
    """Base of service frames, to the robot in `slot` (left out: the network's first)."""

    slot: Slot | None = None

    def frame(self, seq: int, slot: int) -> ServiceFrame:
        raise NotImplementedError


class SendPing(SendService, frozen=True, kw_only=True, tag="ping"):
    """Sets nothing, and counts as fresh."""

    def frame(self, seq: int, slot: int) -> ServiceFrame:
        return ServiceFrame.ping(seq, slot)


class SendFilter(SendService, frozen=True, kw_only=True, tag="filter"):
    """The words of the LM629's filter, for both wheels."""

    kp: FilterWord
    ki: FilterWord
    kd: FilterWord
    il: FilterWord

    def frame(self, seq: int, slot: int) -> ServiceFrame:
        return ServiceFrame.filter(seq, slot, self.kp, self.ki, self.kd, self.il)


class SendAcceleration(SendService, frozen=True, kw_only=True, tag="acceleration"):
    """The acceleration of both wheels."""

    acceleration_m_s2: Annotated[float, Meta(ge=0.001, le=MOST_ACCELERATION_M_S2)]

    def frame(self, seq: int, slot: int) -> ServiceFrame:
        return ServiceFrame(seq, slot, Opcode.ACCELERATION, (acceleration_units(self.acceleration_m_s2),))


def acceleration_units(acceleration_m_s2: float) -> int:
    """1/65536 count per sample squared, rounded: 5973 for 6 m/s^2."""
    counts_per_m = Wheels().units_per_m_s / UNITS_PER_COUNT * (TICKS_PER_S / TICKS_PER_SAMPLE)
    sample_s = TICKS_PER_SAMPLE / TICKS_PER_S
    return nearest(65536.0 * counts_per_m * sample_s * sample_s * acceleration_m_s2)


class SendBytes(Send, frozen=True, kw_only=True, tag="bytes"):
    """Characters as they are: pairs of hex digits, a `!` after one whose stop bit is bad (`55 55! ff`)."""

    hex: str

    def problem(self, robots: int) -> str:
        words = self.hex.split()
        for word in words:
            if not CHARACTER.fullmatch(word):
                return f"hex: {word[:20]!r} is no character; write two hex digits, and ! for a bad stop bit"
        return "" if words else "hex: there is no character; write two hex digits for each"

    def characters(self) -> tuple[bytes, tuple[int, ...]]:
        """The bytes, and the indices of those whose stop bit is bad."""
        words = self.hex.split()
        bad = tuple(at for at, word in enumerate(words) if word.endswith("!"))
        return bytes(int(word[:2], 16) for word in words), bad


SENDS: dict[str, type[Send]] = {
    str(struct.__struct_config__.tag): struct
    for struct in (SendTeam, SendPoll, SendPing, SendFilter, SendAcceleration, SendBytes)
}
