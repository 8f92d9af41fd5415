"""The tables that `replay` prints beside the differences: the frames on the air, and what robots made of a stream."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from miro_exact.clock import seconds
from miro_protocol.transmission import DOWN
from miro_sim.periods import Period
from mirotwin.recording.capture.frame_list import FrameLine, frame_lines
from mirotwin.recording.capture.recorded import transmissions_of
from mirotwin.rerun.job import Job
from mirotwin.shell.console import show

SHOWN = 20
"""Frames in the list unless all are asked for."""


def print_frames(job: Job, replayed: Sequence[Period], everything: bool) -> None:
    robots = {index: network.robots for index, network in enumerate(job.scenario.networks)}
    lines = sorted(
        frame_lines(transmissions_of(job.recorded or replayed), robots), key=lambda line: line.tick
    )
    shown: Sequence[FrameLine] = lines if everything else lines[:SHOWN]
    table = Table(box=None, pad_edge=False)
    table.add_column("tick", justify="right")
    table.add_column("t [s]", justify="right")
    table.add_column("")
    table.add_column("from")
    table.add_column("frame", overflow="fold")
    for line in shown:
        sender = "host" if line.direction == DOWN else "robot ?" if line.slot < 0 else f"robot {line.slot}"
        if len(robots) > 1:
            sender = f"net{line.network} {sender}"
        table.add_row(str(line.tick), f"{seconds(line.tick):.4f}", line.direction, sender, line.text)
    show(table)
    if len(shown) < len(lines):
        show(f"{len(lines) - len(shown)} more of {len(lines)} frames; --all lists them")


def print_response(replayed: Sequence[Period]) -> None:
    """What the robots made of a stream: there is no recording to compare with."""
    table = Table(box=None, pad_edge=False)
    for name in ("robot", "accepted", "rejected", "stale", "commands", "left [counts]", "right [counts]"):
        table.add_column(name, justify="right")
    for index, robot in enumerate(replayed[-1].robots):
        seen = [period.robots[index] for period in replayed]
        commands = sum(len(one.left.commands) + len(one.right.commands) for one in seen)
        counters = [
            str(count) if count is not None else "?"
            for count in (robot.accepted, robot.rejected, robot.stale)
        ]
        positions = (str(robot.left.real_position), str(robot.right.real_position))
        table.add_row(f"{robot.slot}", *counters, str(commands), *positions)
    show(table)
