"""Streams for a robot at a port, and a port of a world that is the robot: `miro://` in virtual time is the hardware."""

import os
from contextlib import suppress

from miro_protocol.frames import TeamFrame, encode

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
