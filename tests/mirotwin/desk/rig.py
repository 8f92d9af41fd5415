"""Streams for a robot at a port, and a port of a world that is the robot: `miro://` in virtual time is the hardware."""

import os
from bisect import bisect_left
from contextlib import suppress

from miro_protocol.frames import TeamFrame, encode
from miro_protocol.transmission import Transmission
from mirotwin.recording import reader
from mirotwin.runs.job import script_of

PERIOD = 800_800
CLEAN = "set=network.radio.bit_error_rate=0"
ROBOT = f"miro://fig6?{CLEAN}"
"""The shipped robot in slot 0, with an ideal radio."""
QUIET = ("--set", "network.radio.bit_error_rate=0", "--set", 'camera={kind="gaussian"}')
"""The same for `serve`, with a camera that takes no time."""

ABOVE_THE_PC = 2


def as_hardware():
    """In the process of a served robot: it comes before all others, also before the PC that talks to it."""
    with suppress(AttributeError, OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(ABOVE_THE_PC))


def words(number):
    """Velocities that change all the time, different for each wheel, up to 0.26 m/s."""
    left = 2000 - abs(number * 130 % 8000 - 4000)
    return (left, 900 - left // 3)


def stream_text(frames, first_tick=1_000_000, change=lambda number, data: data):
    """A stream that asks a robot of three in turn and drives the one in slot 0."""
    lines = ["# mirotwin stream 1"]
    for number in range(frames):
        frame = TeamFrame(3, (5 + number) % 64, (words(number), (100, -100), (300, 300)))
        data = change(number, encode(frame, 3))
        if data:
            lines.append(f"{first_tick + number * PERIOD} > {data.hex(' ')}")
    return "\n".join(lines) + "\n"


NEAR = 4
"""Frames before and after an answer."""


def moved_at(ticks, desk, session):
    """How far from each other frames around each of these ticks came too early or too late to a served robot.

    A process that does not run for some milliseconds does that, and no real robot. `desk`, `session`: the recordings of
    the PC and of the robot's process.
    """
    sent, came = ([one.tick for one in frames(recording)] for recording in (desk, session))
    apart = [theirs - mine for mine, theirs in zip(sent, came, strict=False)]
    near = [apart[max(0, at - NEAR) : at + NEAR] for at in (bisect_left(sent, tick) for tick in ticks)]
    return [max(some) - min(some) for some in near]


def frames(recording):
    script = script_of(reader.read(recording).periods)
    return [one for one in script if isinstance(one, Transmission)]
