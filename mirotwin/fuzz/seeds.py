"""What a campaign begins with: what a host may say, each kind of it once.

Eight random bytes alone never get past the synchronisation, so a campaign begins with frames. A seed is short, and they
differ in what a robot does with them.
"""

from __future__ import annotations

from collections.abc import Sequence

from miro_protocol.frames import Message, ServiceFrame, TeamFrame, encode
from miro_protocol.table import DEFAULT_ACCELERATION, FrameType
from miro_protocol.transmission import DOWN, Transmission
from mirotwin.fuzz.inputs import SILENCE, input_of

MS = 24_000
_BETWEEN_MS = 12
_FILTER = (100, 10, 20, 100)

Said = tuple[Message, int]
"""A frame, and the milliseconds of silence before it."""


def talks(robots: int, slot: int) -> list[list[Said]]:
    """What a host says, one list a seed."""

    def team(seq: int, speed: int, kind: int = FrameType.TEAM) -> TeamFrame:
        return TeamFrame(kind, seq, ((speed, speed),) * robots)

    def asked(first: int) -> int:
        """The number from `first` on with which a question goes to this robot."""
        return next(seq for seq in range(first, first + robots) if seq % robots == slot)

    poll = asked(1)
    return [
        [(team(1, 900), 0)],
        [(team(1, 16_633), 0), (team(2, -16_633), _BETWEEN_MS), (team(3, 0), _BETWEEN_MS)],
        [(team(poll, 300, FrameType.TEAM_ASK), 0)],
        [(team(1, 300, FrameType.TEAM_ASK), 0), (team(2, 300, FrameType.TEAM_ASK), 40)],
        [(ServiceFrame.ping(1, slot), 0)],
        [(ServiceFrame.filter(1, slot, *_FILTER), 0)],
        [(ServiceFrame.acceleration(1, slot, DEFAULT_ACCELERATION // 2), 0), (team(2, 900), _BETWEEN_MS)],
        [(team(1, 900), 0), (ServiceFrame.acceleration(2, slot, DEFAULT_ACCELERATION), _BETWEEN_MS)],
        [(team(1, 900), 0), (team(1, 100), 160)],  # the same number again: not fresh
        [(team(1, 900), 0), (team(2, 900), 120)],  # longer than the smooth stop's time
        [(team(1, 900), 0), (team(2, 900), 520)],  # longer than the time after which motors go off
        [(team(1, 900), 0), (team(poll + 6, 900, FrameType.TEAM_ASK), 120)],
    ]


def sent(talk: Sequence[Said], robots: int) -> list[Transmission]:
    """A talk as what goes over the air."""
    found: list[Transmission] = []
    end_tick = 0
    for message, silence_ms in talk:
        found.append(Transmission(end_tick + silence_ms * MS, DOWN, encode(message, robots)))
        end_tick = found[-1].end_tick
    return found


def seeds(kind: str, robots: int, slot: int) -> list[bytes]:
    """The built-in inputs of that kind."""
    found = [input_of(kind, sent(talk, robots), robots) for talk in talks(robots, slot)]
    if kind == "session":
        found += [one + bytes([SILENCE, 39]) for one in found[:1]]  # 120 ms of silence at the end
        found += [one + bytes([SILENCE, 173]) for one in found[:1]]  # 522 ms
    return list(dict.fromkeys(found))
