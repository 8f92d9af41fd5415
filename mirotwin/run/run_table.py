"""The table that `mirotwin run` prints at its end."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from miro_exact.bad_input import amount
from mirotwin.recording.theory.figures import theory_text
from mirotwin.recording.track import Tracks
from mirotwin.runs.board_summary import AnySummary
from mirotwin.runs.learnt import calibration_text, wheels_text
from mirotwin.runs.result import expectations_text
from mirotwin.runs.summary import Summary, off_pitch_text, rms_name, settling_text, vision_text
from mirotwin.shell.console import facts_table


def table_of(summary: Summary, tracks: Tracks, folder: Path, polar: bool) -> Table:
    """`polar`: whether the first robot's law is one that the paper's theory is about."""
    tracking, link = summary.tracking, summary.link
    table = begun_table(summary, "errors, theory and checks from there; camera, link and firmware from 0 s")
    if tracking.rms_position_cm is not None:
        errors = next(iter(tracks.robots.values())).errors
        table.add_row(
            "tracking",
            f"{rms_name(errors)} {tracking.rms_position_cm:.2f} cm (x {tracking.rms_x_cm:.2f}, "
            f"y {tracking.rms_y_cm:.2f}), {tracking.rms_theta_deg:.2f} deg; {settling_text(errors)}",
        )
    theory = theory_text(summary.theory) if summary.theory is not None else ""
    if theory and polar:
        table.add_row("theory", theory)
    off_pitch = off_pitch_text(summary)
    if off_pitch:
        table.add_row("pitch", off_pitch)
    if summary.vision is not None:
        table.add_row("camera", vision_text(summary.vision))
    for learnt in summary.calibrations:
        table.add_row("calibration", calibration_text(learnt))
    for wheels in summary.wheels:
        table.add_row("wheels", wheels_text(wheels))
    table.add_row(
        "link",
        f"{amount(link.frames_sent, 'frame')} sent, {_known(link.frames_accepted)} accepted, "
        f"{_known(link.frames_rejected)} rejected, {_known(link.frames_stale)} stale; "
        f"{amount(link.bit_errors, 'bit error')}",
    )
    return ended_table(table, summary, folder)


def begun_table(summary: AnySummary, covered: str, *more: tuple[str, str]) -> Table:
    """The first rows, for robots and boards. `covered`: the part of a resumed run that the figures cover.

    `more`: rows of a board.
    """
    table = facts_table()
    table.add_row("scenario", f"{summary.scenario}, seed {summary.seed}")
    for row in more:
        table.add_row(*row)
    if summary.set:
        table.add_row("set", " ".join(summary.set))
    began = f"{summary.resumed_s:.2f} s to " if summary.resumed_s is not None else ""
    table.add_row(
        "time",
        f"{began}{summary.simulated_s:.2f} s in {summary.wall_s:.2f} s ({summary.realtime_factor:.1f} x real time, "
        f"engine {summary.engine})",
    )
    if summary.resumed_s is not None:
        table.add_row("resumed", f"at {summary.resumed_s:.2f} s: {covered}")
    return table


def ended_table(table: Table, summary: AnySummary, folder: Path, image: str = "") -> Table:
    """Adds the last rows: firmware, faults, files."""
    firmware = summary.firmware
    idle = 100.0 * firmware.idle_cycles / firmware.machine_cycles if firmware.machine_cycles else 0.0
    table.add_row(
        "firmware",
        f"{image}{firmware.instructions} instructions, {firmware.machine_cycles} cycles ({idle:.0f} % idle), "
        f"{amount(firmware.faults, 'fault')}",
    )
    table.add_row("expected", expectations_text(summary.expectations))
    table.add_row("digest", summary.digest)
    table.add_row("files", str(folder))
    return table


def _known(count: int | None) -> str:
    return "?" if count is None else str(count)
