"""`mirotwin replay`: what was sent, sent again, and whether the robot answers as it did."""

from __future__ import annotations

from collections.abc import Sequence

import click
from rich.table import Table

from miro_exact.bad_input import BadInput
from miro_exact.clock import seconds
from miro_protocol.transmission import DOWN
from miro_sim.periods import Period
from miro_sim.radio.downlink import TransmissionError
from miro_sim.world.world import World
from mirotwin import runner
from mirotwin.capture.frame_list import FrameLine, frame_lines
from mirotwin.capture.recorded import transmissions_of
from mirotwin.checks.expect import expectations_of, says_anything
from mirotwin.checks.watching import Checks
from mirotwin.cli.console import show
from mirotwin.cli.expectations import expect_option, report_failures
from mirotwin.cli.options import Place, engine_option, firmware_option, plain_parameters, set_option
from mirotwin.cli.program import DIVERGENCE, DONE, complain
from mirotwin.cli.progress import ProgressBar
from mirotwin.cli.replay_case import replay_case
from mirotwin.cli.replay_job import Job, load_job
from mirotwin.cli.run import report_faults
from mirotwin.replay.compare import Difference, compare
from mirotwin.report.summary import expectations_text

SHOWN = 20


@click.command(short_help="Sends recorded bytes again and compares.")
@click.argument("file", type=Place())
@firmware_option("Image to run instead of the recorded one (of the robot's own, for a text stream).")
@set_option("A key to set in the recorded scenario (or the default one, for a text stream), as for `run`.")
@expect_option
@engine_option
@click.option("--all", "everything", is_flag=True, help=f"List all frames, not only the first {SHOWN}.")
@click.option("-q", "--quiet", is_flag=True, help="No progress bar and no list of frames.")
def replay(
    file: str,
    firmware: str | None,
    settings: tuple[str, ...],
    expected: tuple[str, ...],
    engine: str | None,
    everything: bool,
    quiet: bool,
) -> int:
    """Sends the bytes of FILE (run.mcap, or a text stream) again and compares what the robot does.

    Exit code 4 when it differs from the recording, also where a firmware fault comes of it: 4 goes before 3.
    A recording that was broken off, or a part of one, is compared as far as it goes, with a note.
    A text stream runs over an ideal link in the default
    scenario, and there is nothing to compare.

    A case (a stream with `verdict` in its header) runs to its end, and the exit code is that of the check that failed:
    1, or 3 for a firmware fault; 0 if other firmware or settings cure it, 4 if it does not fail again without them.

    Where the recorded scenario or --expect expects something, that decides: the replay goes on to the end, a difference
    is only told, and the exit code is 1 if a check fails, else 0.

    The list shows the host's frames as sent, before the radio, and the robots' answers as the PC heard them.
    """
    job, image = load_job(file, firmware, engine, (*settings, *expected))
    if job.case.verdict:
        return replay_case(job, image, file, quiet)
    judged = says_anything(job.scenario)

    with plain_parameters(file, "replayed"):
        world = World(job.scenario, job.seed, image, script=job.script)
    checks = Checks(world, expectations_of(job.scenario, file))
    replayed: list[Period] = []
    difference: tuple[int, Difference] | None = None
    with ProgressBar("replaying", world.periods, quiet) as bar:

        def check(period: Period) -> bool:
            nonlocal difference
            replayed.append(period)
            bar.to(len(replayed))
            if difference is None and len(replayed) <= len(job.recorded):
                found = compare(job.recorded[period.index], period)
                difference = None if found is None else (period.index, found)
            return (difference is not None and not judged) or len(replayed) == len(job.recorded)

        try:
            with plain_parameters(file, "replayed"):
                runner.run(world, None, False, check)
        except TransmissionError as error:
            raise BadInput(file, "", f"cannot be replayed beyond tick {world.tick}: {error}") from None
    if not quiet:
        _print_frames(job, replayed, everything)
    checks.finish()
    failed = report_failures(checks)
    if judged and not quiet:
        show(expectations_text(checks.verdicts()))
    faults = report_faults(world)
    differs = _verdict(job, replayed, difference)
    return (faults or failed) if judged else (differs or faults or failed)


def _print_frames(job: Job, replayed: Sequence[Period], everything: bool) -> None:
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


def _verdict(job: Job, replayed: Sequence[Period], difference: tuple[int, Difference] | None) -> int:
    if not job.recorded:
        _print_response(replayed)
        return DONE
    if difference is not None:
        complain(f"the replay differs in control period {difference[0]}, {difference[1]}")
        return DIVERGENCE
    if len(replayed) < len(job.recorded):
        complain(f"the replay ended after {len(replayed)} of {len(job.recorded)} recorded control periods")
        return DIVERGENCE
    show(f"the robots' response equals the recorded one in all {len(replayed)} control periods")
    return DONE


def _print_response(replayed: Sequence[Period]) -> None:
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
