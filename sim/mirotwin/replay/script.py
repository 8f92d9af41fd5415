"""What is sent again: the script of a recording or of a stream file, and the scenario that a stream runs in.

What belongs here: from recorded or written characters to what a world sends. What does not: the comparison
(`compare.py`), the command (`cli/replay.py`), and reading files (`recording/reader.py`, `miro_protocol.stream`).

The bytes go in before the radio: with the recorded seed it disturbs them as it did then.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, TICKS_PER_SECOND, seconds
from miro_protocol.events import Received
from miro_protocol.stream import DOWN, Transmission
from miro_sim.periods import Period
from miro_sim.scenario.file import load
from miro_sim.scenario.keys import Network, Scenario
from miro_sim.scenario.radio_keys import Radio

ScriptRun = tuple[int, int, bytes]
DEFAULT_SCENARIO = "fig6"
AFTERMATH_TICKS = TICKS_PER_SECOND
LONGEST_TICKS = 86_400 * TICKS_PER_SECOND


class StreamContentError(ValueError):
    """A stream file whose lines are well formed but cannot have been sent: file, tick, what, remedy."""


def script_of(periods: Iterable[Period]) -> list[ScriptRun]:
    """(tick, network, bytes) of everything the hosts of a recording sent."""
    return [
        (run.tick, run.network, run.data)
        for period in periods
        for run in period.wire
        if run.direction == DOWN
    ]


def robots_of_stream(sent: Sequence[Transmission]) -> int:
    """3 or 5: the layout in which more of the stream's frames can be read."""
    counts = {robots: _frames(sent, robots) for robots in (3, 5)}
    return 5 if counts[5] > counts[3] else 3


def _frames(sent: Sequence[Transmission], robots: int) -> int:
    from miro_protocol.decoder import Decoder  # a hot module: not before the engine was chosen

    decoder = Decoder(robots)
    events = [event for one in sent if one.direction == DOWN for event in decoder.feed(one.data, one.tick)]
    return len([event for event in events if isinstance(event, Received)])


def scenario_of_stream(sent: Sequence[Transmission], path: str) -> Scenario:
    """The default scenario with an ideal link, and its robot in every slot of the stream's layout, all at one start.

    Runs for a second longer than the stream, so that the failsafe is seen. Raises StreamContentError for a
    stream with nothing to send, for transmissions that overlap, and for one that takes more than a day.
    """
    down = [one for one in sent if one.direction == DOWN]
    if not down:
        raise StreamContentError(f"{path}: no line from host to robot; nothing can be replayed")
    for before, after in pairwise(down):
        end_tick = before.tick + len(before.data) * HOST_CHARACTER_TICKS
        if after.tick < end_tick:
            what = f"starts before the transmission of tick {before.tick} has ended (tick {end_tick})"
            raise StreamContentError(f"{path}: tick {after.tick}: {what}; move it back")
    end_tick = down[-1].tick + len(down[-1].data) * HOST_CHARACTER_TICKS + AFTERMATH_TICKS
    if end_tick > LONGEST_TICKS:
        raise StreamContentError(
            f"{path}: tick {down[-1].tick}: more than a day; let the stream start near tick 0"
        )
    base = load(DEFAULT_SCENARIO).scenario
    first = base.networks[0].robot[0]
    assert isinstance(first.reference, msgspec.Struct)  # parameters of a line
    standing = msgspec.structs.replace(first.reference, drive_s=0.0)  # nothing steers by it
    model = msgspec.structs.replace(first, wheel_radius_mismatch=0.0, reference=standing)
    robots = robots_of_stream(sent)
    network = Network(
        robots=5 if robots == 5 else 3,
        radio=Radio(bit_error_rate=0.0, carrier="on", squelch=True),
        robot=tuple(msgspec.structs.replace(model, slot=slot) for slot in range(robots)),
    )
    periods = -(-end_tick // CONTROL_PERIOD_TICKS)
    duration_s = seconds(periods * CONTROL_PERIOD_TICKS)
    return msgspec.structs.replace(base, name="stream", duration_s=duration_s, networks=(network,))


def script_of_stream(sent: Sequence[Transmission]) -> list[ScriptRun]:
    """(tick, network 0, bytes) of everything the stream's host sends."""
    return [(one.tick, 0, one.data) for one in sent if one.direction == DOWN]
