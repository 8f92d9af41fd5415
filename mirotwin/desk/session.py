"""A talk with the robots at a port: who is there, then transmissions at their times on a schedule of the wall clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, TICKS_PER_SECOND
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.frames import ContentError, TeamFrame, TelemetryFrame, encode
from miro_protocol.table import FRESH_AGAIN_TICKS, ROBOT_COUNTS, SEQ_MODULUS, FrameType
from miro_protocol.transmission import Transmission
from mirotwin.desk.robot_port import RobotPort

BOOT_TICKS = TICKS_PER_SECOND // 10
"""A twin that is switched on at tick 0 is up by then."""
ROUNDS = 4
"""How often each robot is asked who it is."""
APART = 32
"""Numbers between the last question of the greeting and what follows it."""
PAUSE_TICKS = FRESH_AGAIN_TICKS + TICKS_PER_SECOND // 10
"""Behind the greeting: after so long a silence any other number is fresh."""
AFTER_TICKS = TICKS_PER_SECOND // 5
"""An answer that comes later than this is none."""
PIECE_BYTES = 200
LEAD_TICKS = PIECE_BYTES * HOST_CHARACTER_TICKS // 2
"""Of a long transmission the next piece is handed over so long before the piece under way is sent."""


class Greeting(msgspec.Struct, frozen=True):
    """Who answers in a network of `robots`. `delay_ticks`: from a question's first character to its whole answer,
    the shortest and the longest.
    """

    robots: int
    slots: tuple[int, ...]
    delay_ticks: tuple[int, int]


def greet(port: RobotPort, robots: int, next_seq: int = 0) -> Greeting:
    """Asks each robot of a network some times, standing; then silence, after which `next_seq` is fresh.

    Raises BadInput where nobody answers.
    """
    seq = (next_seq - APART - ROUNDS * robots) % SEQ_MODULUS
    asked: dict[int, int] = {}
    port.run_to(max(port.tick, BOOT_TICKS))
    first, silent = len(port.answers), len(port.received)
    for _ in range(ROUNDS * robots):
        begun = port.tick
        frame = TeamFrame(FrameType.TEAM_ASK, seq, ((0, 0),) * robots)
        asked[seq] = port.send(encode(frame, robots)).tick
        seq = (seq + 1) % SEQ_MODULUS
        port.run_to(begun + CONTROL_PERIOD_TICKS)
    port.run_to(port.tick + PAUSE_TICKS)
    delays: list[int] = []
    slots: set[int] = set()
    for heard in port.answers[first:]:
        said = answer_of(heard.frame)
        if said is not None and said.seq in asked and said.slot == said.seq % robots:
            slots.add(said.slot)
            delays.append(heard.tick - asked[said.seq])
    if not slots:
        port.end()
        raise BadInput(port.url, "", *_why_nobody(port, robots, silent))
    return Greeting(robots, tuple(sorted(slots)), (min(delays), max(delays)))


def answer_of(frame: Received) -> TelemetryFrame | None:
    """What an answer says, None for what no robot says."""
    try:
        said = frame.message(max(ROBOT_COUNTS))
    except ContentError:
        return None
    return said if isinstance(said, TelemetryFrame) else None


def _why_nobody(port: RobotPort, robots: int, first: int) -> tuple[str, str]:
    """What came instead of answers, and what to do."""
    came = b"".join(one.data for one in port.received[first:])
    asked = f"no robot of a network of {robots} answers {ROUNDS * robots} questions"
    if not came:
        return f"{asked}: nothing comes", "is it switched on, and is this its radio's port?"
    if any(isinstance(event, Received) for event in Decoder(robots).feed(came)):
        return f"{asked}: the port echoes what is sent", "turn the echo of the adapter off"
    if any(heard.tick for heard in port.answers):
        return f"{asked}, but others answer", "is it a network of another size?"
    what = f"{asked}: {len(came)} characters come that are no answer, {came[:6].hex(' ')} .."
    return what, "is this the radio's port, and is its rate 9600 baud?"


def play(
    port: RobotPort,
    transmissions: Sequence[Transmission],
    offset: int,
    went: Callable[[Transmission], object] = lambda one: None,
) -> None:
    """Sends these `offset` ticks later than they say, and reads meanwhile and a little longer."""
    for one in transmissions:
        for start, due in _pieces(one):
            port.run_to(due + offset)
            place = f"tick {one.tick}"
            port.send(one.data[start : start + PIECE_BYTES], place, None if start else due + offset)
        went(one)
    port.run_to(max(port.tick, port.free_tick) + AFTER_TICKS)


def _pieces(one: Transmission) -> Iterator[tuple[int, int]]:
    """Where each piece begins, and when it is handed over."""
    for start in range(0, len(one.data), PIECE_BYTES):
        yield start, one.tick + start * HOST_CHARACTER_TICKS - (LEAD_TICKS if start else 0)
