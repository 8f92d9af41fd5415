"""From pictures to postures: follows the robots of one team by the two colour patches on their tops.

    prediction -> window -> patches -> pair -> centroids -> ground at the tops' height -> posture
        not found: a larger window -> not found: every fourth row of the picture, windows where the team's colour is

A pair is taken only if it is sure: within reach of the last sighting, clearly nearer to the prediction than the next
pair, and, where its patches could also belong to other robots, near enough to it. Otherwise the robot is lost in this
frame. A team patch is used by one robot only.

With a `SelfCalibration` the tracker goes on to learn how its camera hangs, from the same pictures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

from miro_exact.state import TICK
from miro_host.eye.calibration import Calibration
from miro_host.eye.colours import CLASS_OF, ColourClasses
from miro_host.eye.grabber import Pixels
from miro_host.eye.patches import Patches
from miro_host.eye.patterns import IDENTITIES, PATTERNS, TEAMS, PatternName
from miro_host.eye.regions import Regions
from miro_host.eye.self_calibration import SelfCalibration
from miro_host.eye.top import Top
from miro_host.eye.track import Sighting, Track
from miro_host.eye.weighing import Weighing

__all__ = ["CentroidKind", "Notes", "Pair", "Sighting", "Tracker", "Window"]

CentroidKind = Literal["binary", "weighted"]

LARGE_PX = 64
"""Side of the second window."""
SEARCH_PX = 56
"""Side of a window around a team patch: its identity patch lies inside, wherever it is."""
CLEARLY_M = 0.010
"""The second pair must be further from the expected posture by this much, in metres."""
CONTESTED_M = 0.025
"""A pair whose patches could be others' must be so near: a wrong one of two touching robots is 53 mm off."""


class Pair(NamedTuple):
    """A robot as found: its sighting, distance from what was expected, the centroids of both patches in the picture."""

    sighting: Sighting
    off_m: float
    u: float
    v: float
    identity_u: float
    identity_v: float


class Window(NamedTuple):
    """A window that was read, in pixels of the picture; `slot`: of the robot it is for, -1 in a search for all."""

    left: int
    top: int
    width: int
    height: int
    slot: int


class Notes:
    """The tracker's working on its last picture, for display only: it is no state and does not affect tracking.

    `tick`: of its exposure, -1 before the first. `pairs`: by slot, None: lost.
    """

    NOT_STATE = ("*",)

    def __init__(self) -> None:
        self.begin(-1)

    def __repr__(self) -> str:
        return f"Notes(tick={self.tick}, {len(self.windows)} windows, {self.pairs!r})"

    def begin(self, tick: int) -> None:
        """A new picture."""
        self.tick = tick
        self.windows: list[Window] = []
        self.pairs: list[Pair | None] = []


class Tracker:
    """The robots of one team, as one PC follows them. `lost_frames`, `searches`: counted over all robots, and frames.

    State: `tracks`, one for each robot in the order given, the counts, and `learning`, if the camera's calibration is
    learnt while it is in use. `notes` are taken if there are any.
    """

    STATE = {"tracks": [Track], "lost_frames": TICK, "searches": TICK, "learning": SelfCalibration}
    NOT_STATE = (
        *("team", "robots", "pattern", "weighted", "window_px", "team_kind", "kinds", "top"),
        *("regions", "patches", "weighings", "table", "notes"),
    )

    def __init__(
        self,
        team: str,
        robots: Sequence[int],
        pattern: PatternName,
        calibration: Calibration | SelfCalibration,
        colours: ColourClasses,
        centroid: CentroidKind = "weighted",
        window_px: int = 32,
    ) -> None:
        """`team`: a colour of `patterns.TEAMS`; `robots`: numbers in `patterns.IDENTITIES`; a SelfCalibration learns.

        Raises ValueError for what is not one of these, and EyeError for a colour without a class.
        """
        _check(team, robots, pattern, centroid, window_px)
        self.team = team
        self.robots = tuple(robots)
        self.pattern: PatternName = pattern
        self.weighted = centroid == "weighted"
        self.window_px = window_px
        self.team_kind = CLASS_OF[team]
        self.kinds = [CLASS_OF[IDENTITIES[robot]] for robot in robots]
        self.table = colours.table
        self.regions = Regions(self.table)
        self.learning = calibration if isinstance(calibration, SelfCalibration) else None
        self._believe(calibration.begun if isinstance(calibration, SelfCalibration) else calibration)
        chroma = colours.chroma(team)
        floor = None if colours.floor is None else colours.floor.chroma()
        self.weighings = [Weighing(chroma, colours.chroma(IDENTITIES[robot]), floor) for robot in robots]
        self.tracks = [Track() for _ in robots]
        self.lost_frames = 0
        self.searches = 0
        self.notes: Notes | None = None

    def __repr__(self) -> str:
        kind = "weighted" if self.weighted else "binary"
        return f"Tracker({self.team!r}, {self.robots!r}, {self.top!r}, {kind}, lost={self.lost_frames})"

    def _believe(self, calibration: Calibration) -> None:
        """Reads pixels by this calibration from now on."""
        self.top = Top(self.pattern, calibration)
        self.patches = Patches(self.regions, self.top)

    def after_load(self) -> None:
        """The calibration follows from what was learnt."""
        if self.learning is not None:
            self._believe(self.learning.calibration)

    def track(self, frame: Pixels, tick: int) -> list[Sighting | None]:
        """The robots' postures in a picture exposed at `tick`, in their order; None: not found, or uncertain."""
        if self.notes is not None:
            self.notes.begin(tick)
        pairs = [self._followed(frame, tick, slot) for slot in range(len(self.tracks))]
        if None in pairs:
            self.searches += 1
            self._search(frame, tick, pairs)
        self._part(pairs)
        if self.notes is not None:
            self.notes.pairs = list(pairs)
        sightings: list[Sighting | None] = []
        for slot in range(len(pairs)):
            pair, track = pairs[slot], self.tracks[slot]
            if pair is None:
                self.lost_frames += 1
                sightings.append(None)
            else:
                track.remember(pair.sighting)
                sightings.append(pair.sighting)
        if self.learning is not None and self.learning.look(frame, self.tracks):
            self._believe(self.learning.calibration)
        return sightings

    # ---- where to look

    def _followed(self, frame: Pixels, tick: int, slot: int) -> Pair | None:
        """The robot in a window around where it is predicted, or in a larger one."""
        track = self.tracks[slot]
        if track.seen == 0:
            return None
        x_m, y_m, theta_rad = track.predicted(tick)
        try:
            u, v = self.top.lens.pixel(x_m, y_m, self.top.z_m)
        except ValueError:
            return None
        self.patches.expect_nothing()
        self._expect(x_m, y_m, theta_rad)
        self._expect(track.x_m, track.y_m, track.theta_rad)
        pair = self._chosen(self._look(frame, u, v, self.window_px, slot), tick, slot)
        if pair is None and self.window_px < LARGE_PX:
            pair = self._chosen(self._look(frame, u, v, LARGE_PX, slot), tick, slot)
        return pair

    def _look(self, frame: Pixels, u: float, v: float, size: int, slot: int) -> bytearray:
        """Finds the patches in a window around a pixel, moved so that it lies in the picture."""
        whole_width, whole_height = frame.width, frame.height
        width, height = min(size, whole_width), min(size, whole_height)
        left, top = _first(u, width, whole_width), _first(v, height, whole_height)
        if self.notes is not None:
            self.notes.windows.append(Window(left, top, width, height, slot))
        pixels = frame.window(left, top, width, height)
        self.patches.look(pixels, left, top, width, height)
        return pixels

    def _search(self, frame: Pixels, tick: int, pairs: list[Pair | None]) -> None:
        """Looks for the robots that are None in `pairs` in the whole picture, and puts in what it finds once."""
        missing = [slot for slot, pair in enumerate(pairs) if pair is None]
        pairs_at: dict[int, list[Pair]] = {slot: [] for slot in missing}
        for u, v in candidates(frame, self.regions, self.team_kind, self.top.side_px):
            pixels = self._look(frame, u, v, SEARCH_PX, -1)
            for slot in missing:
                track = self.tracks[slot]
                self.patches.expect_nothing()
                if track.seen:
                    self._expect(track.x_m, track.y_m, track.theta_rad)
                pair = self._chosen(pixels, tick, slot)
                if pair is not None and not any(_same_patch(pair, other) for other in pairs_at[slot]):
                    pairs_at[slot].append(pair)
        for slot in missing:
            if len(pairs_at[slot]) == 1:
                pairs[slot] = pairs_at[slot][0]

    # ---- which pair it is

    def _expect(self, x_m: float, y_m: float, theta_rad: float) -> None:
        """Tells `patches` of a posture in which the robot may be."""
        team_x, team_y, identity_x, identity_y = self.top.places(x_m, y_m, theta_rad)
        self.patches.expect(team_x, team_y, identity_x, identity_y)

    def _chosen(self, pixels: bytearray, tick: int, slot: int) -> Pair | None:
        """The robot in the window that `patches` looked at last, None if there is none for sure."""
        patches, track = self.patches, self.tracks[slot]
        if patches.choose(self.team_kind, self.kinds[slot]) == 0:
            return None
        if patches.out_next_m - patches.out_off_m < CLEARLY_M:
            return None
        if track.seen:
            if patches.out_off_m > track.reach_m(tick):
                return None
            if patches.out_contested and patches.out_off_m > CONTESTED_M:
                return None
        elif patches.out_contested:
            return None
        return self._pair(pixels, tick, slot)

    def _part(self, pairs: list[Pair | None]) -> None:
        """If two robots use one team patch, the one further from its expected place is marked lost."""
        for slot in range(1, len(pairs)):
            for other in range(slot):
                pair, rival = pairs[slot], pairs[other]
                if pair is not None and rival is not None and _same_patch(pair, rival):
                    pairs[other if pair.off_m < rival.off_m else slot] = None

    # ---- what it says

    def _pair(self, pixels: bytearray, tick: int, slot: int) -> Pair | None:
        """The pair that `patches` chose as a sighting."""
        patches, regions = self.patches, self.regions
        try:
            u, v, identity_u, identity_v = self._centroids(pixels, slot)
            x_m, y_m, theta_rad = self.top.posture(u, v, identity_u, identity_v)
        except ValueError:
            return None
        team_area, identity_area = regions.area[patches.out_team], regions.area[patches.out_identity]
        confidence = self.top.confidence(patches.out_gap_m, team_area, identity_area)
        sighting = Sighting(x_m, y_m, theta_rad, tick, confidence)
        return Pair(sighting, patches.out_off_m, u, v, identity_u, identity_v)

    def _centroids(self, pixels: bytearray, slot: int) -> tuple[float, float, float, float]:
        """u, v of the team patch and of the identity patch in the picture."""
        patches, regions = self.patches, self.regions
        team, identity = patches.out_team, patches.out_identity
        if self.weighted:
            weighing = self.weighings[slot]
            weighing.centroids(pixels, regions, team, identity, self.top.least_area)
            team_u, team_v = weighing.centroid(0)
            identity_u, identity_v = weighing.centroid(1)
        else:
            team_u, team_v = regions.centroid(team)
            identity_u, identity_v = regions.centroid(identity)
        left, top = patches.left, patches.top
        return left + team_u, top + team_v, left + identity_u, top + identity_v


def _first(middle: float, size: int, whole: int) -> int:
    """The first of `size` pixels around a place, moved so that all of them are among the `whole` picture's."""
    return int(max(0, min(math.floor(middle) - size // 2, whole - size)))


def _same_patch(first: Pair, other: Pair) -> bool:
    return abs(first.u - other.u) < 2.0 and abs(first.v - other.v) < 2.0


def _check(team: str, robots: Sequence[int], pattern: str, centroid: str, window_px: int) -> None:
    """Raises ValueError for what a tracker cannot be made of."""
    if team not in TEAMS:
        raise ValueError(f"team = {team!r}: must be {' or '.join(TEAMS)}")
    if not robots or len(set(robots)) != len(robots) or not all(0 <= n < len(IDENTITIES) for n in robots):
        raise ValueError(f"robots = {robots!r}: must be different numbers from 0 to {len(IDENTITIES) - 1}")
    if pattern not in PATTERNS:
        raise ValueError(f"pattern = {pattern!r}: must be {' or '.join(PATTERNS)}")
    if centroid not in ("binary", "weighted"):
        raise ValueError(f"centroid = {centroid!r}: must be binary or weighted")
    if not 16 <= window_px <= LARGE_PX:
        raise ValueError(f"window_px = {window_px}: must be 16 to {LARGE_PX}")


ROW_STEP = 4
"""Rows from one that is looked at to the next: a patch of 8 pixels cannot lie between two."""


def candidates(frame: Pixels, regions: Regions, team: int, side_px: float) -> list[tuple[int, int]]:
    """(u, v) of what may be patches of class `team`, whose sides are `side_px` long; rows from the top."""
    squares: list[tuple[float, int, int]] = []  # middle of the first run, first row, last row
    for row in range(ROW_STEP // 2, frame.height, ROW_STEP):
        count = regions.find(frame.window(0, row, frame.width, 1), frame.width, 1)
        for index in range(count):
            run = regions.region(index)
            if run.kind == team and 0.4 * side_px <= run.area <= 1.5 * side_px + 4.0:
                _add(squares, 0.5 * (run.left + run.right), row, side_px)
    return [(int(u), (first + last) // 2) for u, first, last in squares]


def _add(squares: list[tuple[float, int, int]], u: float, row: int, side_px: float) -> None:
    """Extends a square found in the last rows by a run, or begins a new one."""
    for place, (first_u, first, last) in enumerate(squares):
        if row - last <= ROW_STEP and row - first <= 2.0 * side_px and abs(u - first_u) <= side_px:
            squares[place] = (first_u, first, row)
            return
    squares.append((u, row, row))
