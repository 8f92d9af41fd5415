"""`mirotwin camera track`: runs the tracker on pictures in a folder or a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, get_args

import click
import msgspec

from miro_exact.bad_input import amount
from miro_host.eye import calibration as calibrations
from miro_host.eye import eye_file
from miro_host.eye.colours import ColourClasses
from miro_host.eye.eye_file import EyeError
from miro_host.eye.patterns import IDENTITIES, PATTERNS, TEAMS, PatternName
from miro_host.eye.tracker import CentroidKind, Sighting, Tracker
from mirotwin.shell.command import Argument, Option, Options, Word, command_of
from mirotwin.shell.options import JSON, NETWORK, PATH, Engine
from mirotwin.shell.program import complain, show_line

_DEGREES = 57.29577951308232
_LAST_ROBOT = len(IDENTITIES) - 1
DEFAULT_NUMBERS = (0, 1, 2)
HEADING = f"{'frame':>6} {'robot':>6} {'x_cm':>9} {'y_cm':>9} {'heading_deg':>12} {'confidence':>11}  picture"


def robot_numbers(text: str) -> tuple[int, ...]:
    """Numbers of robots, separated by commas."""
    words = [word.strip() for word in text.split(",")]
    for word in words:
        if word not in [str(number) for number in range(_LAST_ROBOT + 1)]:
            raise ValueError(f"{word!r} is no robot's number: 0 to {_LAST_ROBOT}, separated by commas.")
        if words.count(word) > 1:
            raise ValueError(f"two robots have the number {word}; name each once.")
    return tuple(map(int, words))


NUMBERS = Word("numbers", robot_numbers, lambda numbers: ",".join(map(str, numbers)))


class TrackOptions(Options, frozen=True, kw_only=True):
    COMMAND = "camera track"
    path: Annotated[Path, Argument("PATH", PATH)]
    calibration: Annotated[Path, Option(type=PATH, help="TOML file: the camera.")]
    colours: Annotated[Path, Option(type=PATH, help="TOML file: the colour classes.")]
    team: Annotated[str, Option(type=click.Choice(TEAMS), help="Colour of the team patch.")] = TEAMS[0]
    numbers: Annotated[
        tuple[int, ...] | None, Option(type=NUMBERS, help="Robots to look for. Default: 0,1,2.")
    ] = None
    pattern: Annotated[PatternName, Option(type=click.Choice(list(PATTERNS)), help="Of the patches.")] = (
        "diagonal"
    )
    centroid: Annotated[
        CentroidKind,
        Option(
            type=click.Choice(get_args(CentroidKind)),
            help="Of a patch: each of its pixels counts the same, or by its chroma.",
        ),
    ] = "binary"
    network: Annotated[
        int, NETWORK.saying("Whose camera, in a recording or among files called netN-frame-..")
    ] = 0
    as_json: Annotated[bool, JSON.saying("JSON lines, in m and rad, instead of a table.")] = False
    engine: Engine = None


@command_of(TrackOptions)
def track(options: TrackOptions) -> None:
    """Prints where the tracker finds each robot in each picture of PATH, or that it is lost there.

    PATH is a folder of PNG or PPM files of 320 x 240 pixels, taken in the order of their names at 30000/1001 a second;
    or a recording with frames (`run --record-frames`). `calibrate` writes the files of --calibration and --colours,
    and both may be written by hand:

    \b
        mirotwin run fig6 --frames frames
        mirotwin camera calibrate --scenario fig6 --out camera.toml --colours-out colours.toml
        mirotwin camera track frames --calibration camera.toml --colours colours.toml --numbers 0
    """
    robots, as_json = options.numbers or DEFAULT_NUMBERS, options.as_json
    tracker = _tracker(options, robots)
    from mirotwin.camera.stills import stills  # loads the pictures' library

    counts_by_robot = dict.fromkeys(robots, 0)
    frames = 0
    for frame, still in enumerate(stills(options.path, options.network, complain)):
        if not frame and not as_json:
            click.echo(HEADING)
        for robot, sighting in zip(robots, tracker.track(still.picture, still.tick), strict=True):
            counts_by_robot[robot] += sighting is not None
            line = _json_line if as_json else _row
            show_line(line(frame, _utf8(still.name), still.tick, robot, sighting))
        frames = frame + 1
    if not as_json:
        counts = ", ".join(f"robot {robot} in {count}" for robot, count in counts_by_robot.items())
        click.echo(f"{amount(frames, 'picture')}: {counts}")


def _tracker(options: TrackOptions, robots: tuple[int, ...]) -> Tracker:
    """Raises BadInput for files that make none."""
    believed = calibrations.read(options.calibration)
    classes = eye_file.read(options.colours, ColourClasses)
    with EyeError.at(options.colours):  # a colour that these robots need has no class
        return Tracker(options.team, robots, options.pattern, believed, classes, options.centroid)


def _utf8(name: str) -> str:
    """A file's name in characters that JSON has: other bytes are escaped."""
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def _json_line(frame: int, name: str, tick: int, robot: int, sighting: Sighting | None) -> str:
    """A line of JSON; the measured values of a lost robot are null."""
    line = {"frame": frame, "picture": name, "tick": tick, "robot": robot, "lost": sighting is None}
    measured = {field: getattr(sighting, field, None) for field in ("x_m", "y_m", "theta_rad", "confidence")}
    return msgspec.json.encode(line | measured).decode()


def _row(frame: int, name: str, tick: int, robot: int, sighting: Sighting | None) -> str:
    place = f"{'lost':>9} {'':>9} {'':>12} {'':>11}"
    if sighting is not None:
        degrees = _DEGREES * sighting.theta_rad
        place = f"{100.0 * sighting.x_m:9.2f} {100.0 * sighting.y_m:9.2f} {degrees:12.2f} {sighting.confidence:11.2f}"
    return f"{frame:6d} {robot:6d} {place}  {name}"
