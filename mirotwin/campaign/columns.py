"""The columns of a results file: what each run has, and which figures of `summary.json`.

    run                                    number of the run in the plan, from 0
    one column a factor and a drawn key, `draw` (where something is drawn), `seed`
    verdict, error, failure, digest
    the figures of `summary.json`; those of the first robot, as there
    check.NAME                             verdict of that check

Wall times are in a file of their own (`results`), because all the rest is the same on every machine.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args, get_type_hints

from miro_exact.clock import TICKS_PER_SECOND
from mirotwin.recording.track import Tracks
from mirotwin.report.summary import FirmwareCounts, LinkCounts, Summary, Tracking, VisionCounts, tracking_of
from mirotwin.report.theory import Assumption1, Assumption2, Assumption3, DisturbanceFigures, Theory

OWN = ("run", "draw", "seed", "verdict", "error", "failure", "digest")
"""Names that no factor can have."""
CHECK = "check."
SEEN = ("seen_x_cm", "seen_y_cm", "seen_theta_deg", "seen_position_cm")
"""As `rms_*`, of measurements against the reference at their exposure: the error that the camera shows."""
_PARTS: tuple[tuple[str, tuple[str, ...], type], ...] = (
    ("", ("tracking",), Tracking),
    ("", ("theory",), Theory),
    ("", ("theory", "disturbance"), DisturbanceFigures),
    ("assumption_1_", ("theory", "assumption_1"), Assumption1),
    ("assumption_2_", ("theory", "assumption_2"), Assumption2),
    ("assumption_3_", ("theory", "assumption_3"), Assumption3),
    ("", ("link",), LinkCounts),
    ("vision_", ("vision",), VisionCounts),
    ("", ("firmware",), FirmwareCounts),
)
"""Prefix of the columns, where the figures stand in a summary, and their struct."""


def _kinds(struct: type) -> Iterator[tuple[str, type]]:
    """The numbers among a struct's fields."""
    for name, hint in get_type_hints(struct).items():
        kinds = [kind for kind in (get_args(hint) or (hint,)) if kind is not type(None)]
        if kinds[0] in (int, float):
            yield name, kinds[0]


FIGURES: Mapping[str, type] = {
    "simulated_s": float,
    "settled": bool,
    "worst_rms_position_cm": float,
    **dict.fromkeys(SEEN, float),
    **{prefix + name: kind for prefix, _, struct in _PARTS for name, kind in _kinds(struct)},
}
"""Column -> int, float or bool. `settled`: the first robot is within 3 cm and 0.15 rad at the end.
`worst_rms_position_cm`: the largest `rms_position_cm` of all robots."""


def figures_of(summary: Summary, tracks: Tracks) -> dict[str, Any]:
    """The figures of one run; None for what it does not have."""
    found: dict[str, Any] = {
        "simulated_s": summary.simulated_s,
        **_over_robots(tracks),
        **_seen(tracks),
    }
    for prefix, place, struct in _PARTS:
        at: Any = summary
        for name in place:
            at = getattr(at, name) if at is not None else None
        for name, _ in _kinds(struct):
            found[prefix + name] = None if at is None else getattr(at, name)
    return found


def _seen(tracks: Tracks) -> dict[str, float | None]:
    """Of the first robot's measurements in the last second."""
    first = next(iter(tracks.robots.values()), None)
    if first is None:
        return dict.fromkeys(SEEN)
    after_tick = first.errors[-1].tick - TICKS_PER_SECOND
    found = tracking_of([sample for sample in first.measured_errors if sample.tick > after_tick])
    return {name: getattr(found, f"rms_{name.removeprefix('seen_')}") for name in SEEN}


def _over_robots(tracks: Tracks) -> dict[str, Any]:
    everyone = [track.errors for track in tracks.robots.values() if len(track.errors)]
    if not everyone:
        return {"settled": None, "worst_rms_position_cm": None}
    rms = [value for errors in everyone if (value := tracking_of(errors).rms_position_cm) is not None]
    return {"settled": everyone[0][-1].settled, "worst_rms_position_cm": max(rms)}
