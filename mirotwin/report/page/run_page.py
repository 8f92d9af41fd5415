"""The page of one run: the facts of its header, its sections, and the data for its JavaScript."""

from __future__ import annotations

import base64
import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import tomli_w

from miro_exact.bad_input import amount
from miro_exact.clock import CONTROL_PERIOD_TICKS, CYCLE_TICKS, TICKS_PER_SECOND
from miro_robot.image.debug_info import Sources
from miro_sim.periods import Period
from miro_sim.pitch import ground
from mirotwin.recording.difference import Difference, first_per_channel
from mirotwin.recording.track import Column, Postures
from mirotwin.report.page.document import render
from mirotwin.report.page.firmware import coverage_rows
from mirotwin.report.page.frames import CameraFrame, Extras
from mirotwin.report.page.link import LinkMark, lanes_of
from mirotwin.report.page.tracks import PageTrack, PageTracks, add_samples, tracks_of
from mirotwin.report.page.watched_run import WatchedRun
from mirotwin.runs.job import Job
from mirotwin.runs.summary import StepResults, rms_name, settling_text, tracking_of
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.verdicts import judge
from mirotwin.verify.cases.case import tables_of

SILENT = "silent"
MARGIN_CM = 3.0
ROOM_CM = 142.0 * ground.ROBOT_HALF_M - MARGIN_CM
"""Space beyond the margin for a robot at the end of its path: half its diagonal, in cm."""
MOST_POINTS = 4000
"""Largest number of points of a path; a longer one is drawn with every second point, or every third, and so on."""


class Material(msgspec.Struct, frozen=True, kw_only=True):
    """The data of a page. `kind`: run, case or failed test; `name`: of a test, with its `report`. `periods`: the drawn
    ones; `command` makes the page again; `notes`: shown first, a line each. `replayed`: name of the run compared with
    the recorded one, "" for none; `differences`: between the two.
    """

    kind: str
    job: Job
    again: WatchedRun
    periods: Sequence[Period]
    sources: Sources
    command: str
    notes: Sequence[str] = ()
    name: str = ""
    report: str = ""
    verdict: str = ""
    extras: Extras = Extras()
    replayed: str = ""
    differences: Sequence[Difference] = ()
    steps: StepResults | None = None


def run_page(material: Material) -> bytes:
    """The page. Raises BadInput where Bokeh is not installed."""
    from mirotwin.report.page.plots import KIND_COLOURS, figures_of  # loads Bokeh

    scenario, again = material.job.spec.robot_scenario, material.again
    steered = [network.host != SILENT for network in scenario.networks]
    delay_frames = getattr(scenario.camera, "delay_frames", 0)
    tracks = tracks_of(material.periods, steered, delay_frames)
    add_samples(tracks, material.extras.samples)
    marks = [mark for mark in again.marks if tracks.shows(mark.start_tick)]
    ticks = [
        *(failure.tick for failure in again.result.failures),
        *(fault.tick for _, _, fault in again.faults),
    ]
    figures = figures_of(tracks, marks, list(filter(tracks.shows, ticks)))
    kinds = {mark.kind for mark in marks}
    seen = any(steered) or bool(material.extras.frames)  # else nobody looks at what the camera measured
    values = {
        **shared(material, TICKS_PER_SECOND),
        "scenario_text": tomli_w.dumps(tables_of(scenario)),
        "told": any(value == value for robot in tracks.robots for value in robot.told_v_m_s),
        "facts": _facts(material, tracks),
        "tracks": tracks,
        "pitch": pitch_of(tracks, seen=seen),
        "seen": seen,
        "pitch_shows": "where each robot is, should be and was seen",
        "kinds": [(kind, colour) for kind, colour in KIND_COLOURS.items() if kind in kinds],
        "lanes": [
            (lane, Counter(mark.kind for mark in marks if mark.lane == lane)) for lane in lanes_of(marks)
        ],
    }
    return render("run.html", figures, page_data(tracks, marks, material.extras.frames, ticks), values)


def shared(material: Material, clock: int) -> dict[str, Any]:
    """The values of the sections that pages of robots and of boards have."""
    again = material.again
    return {
        "about": material,
        "again": again,
        "clock": clock,
        "cycle_us": f"{1e6 * CYCLE_TICKS / clock:.4g}",
        "file": Path(material.job.spec.origin).name,
        "scenario": material.job.spec.scenario,
        "firmware": material.job.spec.image.path.name,
        "verdict": _verdict(material),
        "interrupts": [interrupt for interrupt in again.profile.interrupts if interrupt.count],
        "coverage": coverage_rows(again.image, again.counts, material.sources),
        "channels": first_per_channel(material.differences),
    }


class Body(msgspec.Struct, frozen=True):
    """A robot on the pitch. `dots`: its measured places as one SVG path; `seen`: the last measurement is drawn."""

    colour: int
    label: str
    steered: bool
    dots: str = ""
    seen: bool = False


class Pitch(msgspec.Struct, frozen=True):
    """The pitch as SVG: field, paths, and robots that the page's JavaScript moves.

    `view_box` takes in the whole pitch and all paths. `paths`: number of the robot, truth or reference, and points as
    an SVG polyline has them.
    """

    view_box: str
    paths: list[tuple[int, str, str]]
    bodies: list[Body]
    left: float = 100.0 * ground.LEFT_M
    bottom: float = 100.0 * ground.BOTTOM_M
    length: float = 100.0 * ground.LENGTH_M
    width: float = 100.0 * ground.WIDTH_M
    half: float = 100.0 * ground.ROBOT_HALF_M


def pitch_of(tracks: PageTracks, bodies: Sequence[tuple[int, str]] = (), seen: bool = True) -> Pitch:
    """`bodies`: colour and label of each; default: the robots of one run, with camera measurements if `seen`."""
    paths, drawn = [], []
    corners = [
        (100.0 * ground.LEFT_M, 100.0 * ground.BOTTOM_M),
        (100.0 * ground.RIGHT_M, 100.0 * ground.TOP_M),
    ]
    for number, robot in enumerate(tracks.robots):
        kinds = [("truth", robot.truth), *([("reference", robot.reference)] if robot.steered else [])]
        for kind, postures in kinds:
            places = _places(postures)
            corners += [
                (x + way, y + way) for x, y in places if math.isfinite(x + y) for way in (-ROOM_CM, ROOM_CM)
            ]
            paths.append((number, kind, " ".join(f"{x:.2f},{y:.2f}" for x, y in places)))
        if bodies:
            drawn.append(Body(*bodies[number], robot.steered))
            continue
        measured = [place for place in _places(robot.measured) if seen and not math.isnan(place[0])]
        dots = "".join(f"M{x:.2f} {y:.2f}h0" for x, y in measured)
        label = f"{robot.id[1]}" if len(tracks.robots) > 1 else ""
        drawn.append(Body(number % 5, label, robot.steered, dots, seen))
    left, right = min(x for x, _ in corners) - MARGIN_CM, max(x for x, _ in corners) + MARGIN_CM
    bottom, top = min(y for _, y in corners) - MARGIN_CM, max(y for _, y in corners) + MARGIN_CM
    return Pitch(f"{left:.2f} {-top:.2f} {right - left:.2f} {top - bottom:.2f}", paths, drawn)


def _places(postures: Postures) -> list[tuple[float, float]]:
    step = -(-len(postures.x_m) // MOST_POINTS) or 1
    places = [(100.0 * x, 100.0 * y) for x, y in zip(postures.x_m, postures.y_m, strict=True)]
    last = places[-1:] if (len(places) - 1) % step else []
    return [*places[::step], *last]


def _verdict(material: Material) -> tuple[str, str]:
    """A word for the badge, and how many checks it comes from."""
    again, steps = material.again, material.steps
    verdicts = [*again.result.expectations, *(steps.expectations if steps else ())]
    failed = [verdict for verdict in verdicts if verdict.verdict == "failed"]
    count = amount(len(verdicts), "check")
    of = f"{len(failed)} of {count} failed" if failed else count
    if material.verdict and not again.faults:
        return material.verdict, f"no check, but what its report says; {count}"
    parts = [again.result.verdict]
    if again.faults:
        parts.append("fault")
    if steps is not None:
        parts += [
            "failed" if steps.failed else "passed",
            *(verdict.verdict for verdict in steps.expectations),
        ]
    verdict = judge(parts)
    if material.extras.broken_off and verdict not in ("fault", "failed"):
        return "broken off", of
    return verdict, of


def _facts(material: Material, tracks: PageTracks) -> list[tuple[str, str, str]]:
    """Name, displayed text, and the full text if that is shortened."""
    digest, image = material.again.digest, material.job.spec.image
    if material.periods and material.replayed:
        digest = material.periods[-1].digest
    facts = [
        ("seed", f"{material.job.spec.seed}", ""),
        ("firmware", image.sha256[:12] or "no file", f"{image.path.name} {image.sha256}"),
        ("digest", digest[:12], digest),
        ("simulated", f"{len(tracks.ticks) * CONTROL_PERIOD_TICKS / TICKS_PER_SECOND:.2f} s", ""),
    ]
    for robot in tracks.robots[:1]:
        if robot.steered:
            tracking = tracking_of(robot.errors)
            rms = f"{tracking.rms_position_cm:.2f} cm, {tracking.rms_theta_deg:.2f}\u00b0"
            facts.append((rms_name(robot.errors), rms, f"of {robot.name}, position and heading"))
            facts.append(("settling", settling_text(robot.errors), "within 3 cm and 0.15 rad"))
    return facts


def page_data(
    tracks: PageTracks,
    marks: Sequence[LinkMark],
    frames: Sequence[CameraFrame],
    ticks: Sequence[int],
    pairs: int = 0,
) -> bytes:
    """The data of the page's JavaScript: postures as 64-bit floats in base64, so that none is rounded.

    `ticks`: of failures. `pairs`: number of compared robots; robot i is compared with robot i + `pairs`.
    """
    lanes = lanes_of(marks)
    kinds = list(dict.fromkeys(mark.kind for mark in marks))
    return json_bytes(
        {
            "first": tracks.first,
            "ticks": tracks.ticks,
            "period_ticks": CONTROL_PERIOD_TICKS,
            "ticks_per_s": TICKS_PER_SECOND,
            "robots": [_robot(robot, len(tracks.ticks)) for robot in tracks.robots],
            "pairs": pairs,
            "failures": sorted(set(ticks)),
            "lanes": lanes,
            "kinds": kinds,
            "marks": [
                (mark.start_tick, mark.end_tick, lanes.index(mark.lane), kinds.index(mark.kind), mark.text)
                for mark in sorted(marks, key=lambda mark: mark.start_tick)
            ],
            "frames": [(frame.network, frame.tick, frame.jpeg) for frame in frames],
        }
    )


def _robot(robot: PageTrack, count: int) -> dict[str, Any]:
    return {
        "name": robot.name,
        "network": robot.id[0],
        "steered": robot.steered,
        "truth": _packed(robot.truth, count),
        "reference": _packed(robot.reference, count),
        "measured": _packed(robot.measured, count),
        "v": _base64(robot.v_m_s, count),
        "w": _base64(robot.w_rad_s, count),
    }


def _packed(postures: Postures, count: int) -> list[str]:
    return [_base64(column, count) for column in (postures.x_m, postures.y_m, postures.theta_rad)]


def _base64(numbers: Column, count: int) -> str:
    """`count` little-endian numbers; NaN after the end of the shorter run of a page with two runs."""
    values = np.asarray(numbers, "<f8")
    return base64.b64encode(
        np.append(values, np.full(count - len(values), np.nan)).astype("<f8").tobytes()
    ).decode()
