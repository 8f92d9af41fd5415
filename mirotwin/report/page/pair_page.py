"""The page of two runs, drawn over each other: their sources, the first difference, the motion of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND
from miro_sim.periods import Period, RobotId
from mirotwin.recording.compare import CompareRule, differences, only_robots, robots_of
from mirotwin.recording.difference import Difference, first_per_channel
from mirotwin.report.page.document import render
from mirotwin.report.page.run_page import SILENT, page_data, pitch_of
from mirotwin.report.page.tracks import PageTracks, tracks_of
from mirotwin.runs.job import Job
from mirotwin.runs.made_from import MadeFrom, source_differences
from mirotwin.runs.summary import rms_name, settling_text, tracking_of

NAMES = ("A", "B")
RULE = CompareRule(host=True)
"""Everything recorded, except digests: unused bytes of a stack are enough to change a digest."""


class Side(NamedTuple):
    """One of the two runs: `name` for people, and the control periods that are drawn."""

    name: str
    job: Job
    periods: Sequence[Period]

    @property
    def made_from(self) -> MadeFrom:
        source = self.job.source
        return (
            MadeFrom(self.job.spec)
            if source is None
            else MadeFrom(self.job.spec, source.state, source.plugins)
        )

    def tracks(self, robots: Sequence[RobotId]) -> PageTracks:
        scenario = self.job.spec.robot_scenario
        steered = [network.host != SILENT for network in scenario.networks]
        delay_frames = getattr(scenario.camera, "delay_frames", 0)
        return tracks_of(only_robots(self.periods, robots), steered, delay_frames)


def pair_page(first: Side, other: Side) -> bytes:
    """The page. Raises BadInput for runs without a robot or a time in common, and where Bokeh is not installed."""
    from mirotwin.report.page.pair_plots import pair_figures  # loads Bokeh

    sides = (first, other)
    robots, notes = _common(first, other)
    tracks = [side.tracks(robots) for side in sides]
    here, there = (only_robots(side.periods, robots) for side in sides)
    parted = [difference for difference in differences(here, there, RULE) if not _of_one_law(difference)]
    origins = [*source_differences(first.made_from, other.made_from)]
    if origins:
        more = f" and {len(origins) - 1} more" if len(origins) > 1 else ""
        notes.insert(0, f"They were not made from the same: {origins[0].key}{more}.")
    marked = [parted[0].tick] if parted else []
    longer = max(tracks, key=lambda track: len(track.ticks))
    both = PageTracks(longer.first, longer.ticks, [robot for track in tracks for robot in track.robots])
    count = len(robots)
    several = count > 1
    labels = [
        f"{name}{robot.id[1] if several else ''}"
        for name, track in zip(NAMES, tracks, strict=True)
        for robot in track.robots
    ]
    colours = [0] * count + [1] * count
    figures = pair_figures(tracks[0], tracks[1], marked)
    values = {
        "sides": [*zip(NAMES, sides, strict=True)],
        "names": NAMES,
        "notes": notes,
        "tracks": tracks[0],
        "periods": len(longer.ticks),
        "pitch": pitch_of(both, [*zip(colours, labels, strict=True)]),
        "pitch_shows": "where each robot of both runs is and should be",
        "origins": origins,
        "told": [origin for origin in origins if "code" not in origin.key][:3],
        "rows": _rows(sides, tracks),
        "differences": parted,
        "channels": first_per_channel(parted),
    }
    return render("pair.html", figures, page_data(both, [], [], marked, count), values)


def _of_one_law(difference: Difference) -> bool:
    """True if it is an inner value that only the law or the estimator of one run has."""
    inner = difference.channel.startswith(("control inner.", "control estimate."))
    return inner and None in (difference.recorded, difference.replayed)


def _common(first: Side, other: Side) -> tuple[list[RobotId], list[str]]:
    """The robots that both runs have, and remarks on the others. Raises BadInput."""
    here, there = robots_of(first.periods), robots_of(other.periods)
    common = [robot for robot in here if robot in there]
    if not common:
        raise BadInput(
            other.job.spec.origin,
            "",
            f"has no robot in common with {first.job.spec.origin}",
            "give two runs of the same robots",
        )
    if first.periods[0].index != other.periods[0].index:
        begins = " and ".join(f"{side.periods[0].index}" for side in (first, other))
        raise BadInput(
            other.job.spec.origin,
            "",
            f"the runs begin with control periods {begins}",
            "give --from a time that both have",
        )
    notes = []
    for name, robots in zip(NAMES, (here, there), strict=True):
        alone = [f"net{network}/robot{slot}" for network, slot in robots if (network, slot) not in common]
        notes += [f"Only {name} has {', '.join(alone)}."] if alone else []
    lengths = [len(side.periods) for side in (first, other)]
    if lengths[0] != lengths[1]:
        notes.append(f"A has {amount(lengths[0], 'control period')}, B has {lengths[1]}.")
    return common, notes


def _rows(sides: Sequence[Side], tracks: Sequence[PageTracks]) -> list[tuple[str, list[str]]]:
    """Name of a property, and its value for each run."""
    images = [side.job.spec.image for side in sides]
    rows = [
        ("scenario", [side.job.spec.scenario.name for side in sides]),
        ("seed", [f"{side.job.spec.seed}" for side in sides]),
        ("firmware", [image.sha256[:12] or "no file" for image in images]),
        (
            "duration",
            [f"{len(track.ticks) * CONTROL_PERIOD_TICKS / TICKS_PER_SECOND:.2f} s" for track in tracks],
        ),
    ]
    for pair in zip(*(track.robots for track in tracks), strict=True):
        if all(robot.steered for robot in pair):
            of = [tracking_of(robot.errors) for robot in pair]
            rms = [f"{summary.rms_position_cm:.2f} cm, {summary.rms_theta_deg:.2f}\u00b0" for summary in of]
            rows.append((f"{pair[0].name} {rms_name(pair[0].errors)}", rms))
            rows.append((f"{pair[0].name} settling", [settling_text(robot.errors) for robot in pair]))
    for robot in tracks[0].robots:
        last = [only_robots(side.periods[-1:], [robot.id])[0].robots[0] for side in sides]
        counts = [
            " / ".join(
                "?" if count is None else f"{count}"
                for count in (robot.accepted, robot.rejected, robot.stale)
            )
            for robot in last
        ]
        rows.append((f"{robot.name} frames accepted / rejected / stale", counts))
    return rows
