"""`mirotwin camera calibrate`: a camera's parameters from control points, of a real camera or of a scenario's."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

import click
from rich.table import Table

from miro_exact.bad_input import BadInput
from miro_exact.rng import Stream
from miro_host.eye import calibration as calibrations
from miro_host.eye import calibration_kinds as kinds
from miro_host.eye.calibration import Calibration
from miro_host.eye.camera_parameters import HEIGHT, WIDTH, CameraParameters
from miro_host.eye.colours import classes_of, read_samples
from miro_host.eye.fit import COLUMNS, ControlPoint, fit, parse_points, read_points
from miro_host.eye.lens import Lens
from miro_sim.pitch.colour_samples import colours_of
from miro_sim.scenario.camera_keys import PixelCamera, SeeingCamera
from miro_sim.scenario.file import load
from mirotwin.shell.command import Option, Options, command_of
from mirotwin.shell.console import facts_table, plain_table, show
from mirotwin.shell.options import FORCE, OUT, PATH, SEED, SET, Engine, FiniteNumber, ScenarioName
from mirotwin.shell.outputs import OutputError, check_new, whole_file
from mirotwin.shell.program import tell_notes

SHOWN = 20
"""Points in the table; the file has them all."""


class _Found(NamedTuple):
    """The result of a calibration: control points and calibration, and the further texts to write."""

    points: list[ControlPoint]
    calibration: Calibration
    points_text: str = ""
    colours_text: str = ""
    worst_m: float | None = None


class CalibrateOptions(Options, frozen=True, kw_only=True):
    COMMAND = "camera calibrate"
    points: Annotated[
        Path | None,
        Option(
            type=PATH, help="CSV file: x_cm, y_cm, height_cm, u_px, v_px of each point.", apart="scenario"
        ),
    ] = None
    scenario: Annotated[
        str | None,
        Option(type=ScenarioName(), help="Take the points from the camera of this scenario instead."),
    ] = None
    out: Annotated[Path, OUT.saying("TOML file for the calibration.")]
    initial: Annotated[
        Path | None,
        Option(
            type=PATH,
            help="Calibration file to begin with, for what the points cannot tell. Default: 2 m above the middle of the"
            " pitch; with --scenario its camera, without tilt and distortion.",
        ),
    ] = None
    seed: Annotated[int, SEED.saying("Of the points' noise.", needs="scenario")] = 0
    noise_px: Annotated[
        float,
        Option(
            type=FiniteNumber(0.0, 10.0),
            help="Standard deviation of a point's u, and of its v: how well somebody finds a mark in the picture.",
            needs="scenario",
        ),
    ] = 0.3
    settings: Annotated[tuple[str, ...], SET.saying(SET.help, needs="scenario")] = ()
    points_out: Annotated[
        Path | None,
        Option(type=PATH, help="CSV file for the points of the scenario's camera.", needs="scenario"),
    ] = None
    samples: Annotated[
        Path | None,
        Option(
            type=PATH,
            help="CSV file of pixels sampled from one's own pictures: colour, r, g, b (or y, cb, cr).",
            needs="points",
        ),
    ] = None
    colours_out: Annotated[
        Path | None,
        Option(
            type=PATH,
            help="TOML file for the colour classes of --samples, or sampled from pictures of the scenario's camera.",
        ),
    ] = None
    force: Annotated[bool, FORCE.saying("Replace files that are there.")] = False
    engine: Engine = None

    @property
    def outputs(self) -> dict[str, Path | None]:
        return {"--out": self.out, "--points-out": self.points_out, "--colours-out": self.colours_out}


@command_of(CalibrateOptions)
def calibrate(options: CalibrateOptions) -> None:
    """Finds the camera that draws control points nearest to where they were measured, and writes it as a calibration.

    A control point is a place on the pitch (cm, in the axes of the scenarios) and its height, and the pixel that shows
    it. Points at one height determine lens and tilt well enough for that height; points on the floor and on robots'
    tops determine all parameters. Points of a simulated camera show the form:

    \b
        mirotwin camera calibrate --scenario fig6 --out camera.toml --points-out points.csv
        mirotwin camera calibrate --points points.csv --out camera.toml --force

    With --samples the colour classes are found from pixels that you sampled from your pictures: at least 4 of each
    patch's colour, of the floor, and of the ball if there is one. Names: yellow, blue, magenta, cyan, green, violet,
    lime, orange, floor.

    Prints the remaining distance between measured and drawn pixels. `track` takes the files of --out and --colours-out.
    """
    points, scenario, samples = options.points, options.scenario, options.samples
    if points is None and scenario is None:
        raise click.UsageError("Give either --points or --scenario.")
    if points is not None and (samples is None) != (options.colours_out is None):
        raise click.UsageError("With --points, give both --samples and --colours-out or neither.")
    _check_outputs(options)
    first = None
    if options.initial is not None:
        first = calibrations.read(options.initial).camera
    if scenario is not None:
        result = _of_scenario(scenario, first, options)
    else:
        assert points is not None
        measured = read_points(points)
        calibration = fit(measured, first or CameraParameters(), f"{points}")
        colours = "" if samples is None else classes_of(read_samples(samples), f"{samples}").text()
        result = _Found(measured, calibration, colours_text=colours)
    texts = (result.calibration.text(), result.points_text, result.colours_text)
    for (option, path), text in zip(options.outputs.items(), texts, strict=True):
        if path is not None:
            with whole_file(path, option) as staging:
                staging.write_text(text, encoding="utf-8")
    _print(result, [path for path in options.outputs.values() if path is not None])


def _check_outputs(options: CalibrateOptions) -> None:
    """Raises OutputError for files that cannot be written, or that are the same."""
    inputs = (options.points, options.initial, options.scenario, options.samples)
    options_by_path: dict[Path, str] = {}
    for option, path in options.outputs.items():
        if path is None:
            continue
        check_new(path, option, options.force, *inputs)
        other = options_by_path.setdefault(path.resolve(), option)
        if other != option:
            raise OutputError(path, f"is the file of {other} and of {option}", "give two files")


def _of_scenario(name: str, initial: CameraParameters | None, options: CalibrateOptions) -> _Found:
    """Points, calibration and perhaps colours of a scenario's camera.

    Raises BadInput for a camera without a picture.
    """
    colours = options.colours_out is not None
    text = load(name, options.settings)
    tell_notes(text.notes)
    camera = text.scenario.camera
    if not isinstance(camera, SeeingCamera):
        remedy = 'choose kind = "pixels" or "geometric" in [camera]'
        raise BadInput(text.origin, "camera.kind", "this camera has no lens", remedy)
    if colours and not isinstance(camera, PixelCamera):
        remedy = 'choose kind = "pixels" in [camera], or leave out --colours-out'
        raise BadInput(text.origin, "camera.kind", "this camera renders no pixels, so no colours", remedy)

    points_text = marks_text(camera.lens, options.noise_px, options.seed)
    points = parse_points(points_text, text.origin)
    calibration = fit(points, initial or kinds.none(camera.lens).camera, text.origin)
    worst_m = kinds.worst_error_m(camera.lens, calibration)
    classes = ""
    if colours and isinstance(camera, PixelCamera):
        classes = colours_of(camera.lens, camera.picture, camera.pattern, camera.ball is not None).text()
    return _Found(points, calibration, points_text, classes, worst_m)


def _print(result: _Found, files: Sequence[Path]) -> None:
    residuals = result.calibration.residuals
    assert residuals is not None
    table = facts_table()
    table.add_row("points", f"{residuals.points}")
    table.add_row("residuals", f"rms {residuals.rms_px:.3f} px, max {residuals.max_px:.3f} px")
    if result.worst_m is not None:
        table.add_row("worst error", f"{100.0 * result.worst_m:.3f} cm over the pitch, at the robots' tops")
    for name in result.calibration.free:
        table.add_row(name, f"{getattr(result.calibration.camera, name):.6g}")
    table.add_row("files", ", ".join(map(str, files)))
    show(table)
    show(_by_residual(result.points, residuals.px))


def _by_residual(points: Sequence[ControlPoint], off_px: Sequence[float]) -> Table:
    """The points that fit worst, the worst first."""
    names = ("point", "x_cm", "y_cm", "height_cm", "u_px", "v_px", "off_px")
    table = plain_table(*names, justify="right")
    order = sorted(range(len(points)), key=lambda number: -off_px[number])
    for number in order[:SHOWN]:
        x_m, y_m, z_m, u, v = points[number]
        place = (f"{100.0 * x_m:.2f}", f"{100.0 * y_m:.2f}", f"{100.0 * z_m:.2f}")
        table.add_row(f"{number + 1}", *place, f"{u:.2f}", f"{v:.2f}", f"{off_px[number]:.3f}")
    if len(order) > SHOWN:
        table.add_row("..", *[""] * 5, f"<= {off_px[order[SHOWN]]:.3f}")
    return table


FLOOR_CM = (range(-10, 121, 26), range(-10, 81, 18), 0.0)
"""Columns, rows and height of the marks on the floor: from edge to edge of the pitch."""
TOPS_CM = (range(-5, 116, 24), range(-5, 76, 16), 7.5)
"""Points on robots' tops: x range, y range, height, in cm. They reach as near to the edge as a robot can get."""


def marks_text(camera: CameraParameters, noise_px: float, seed: int) -> str:
    """The marks that the camera sees, as CSV; `noise_px`: standard deviation of u and of v, normal."""
    stream = Stream(seed, "calibrate/marks")
    lens = Lens(camera)
    rows = [",".join(COLUMNS)]
    marks = [(x, y, height) for columns, lines, height in (FLOOR_CM, TOPS_CM) for y in lines for x in columns]
    for number, (x_cm, y_cm, height_cm) in enumerate(marks):
        u, v = lens.pixel(x_cm / 100.0, y_cm / 100.0, height_cm / 100.0)
        if 0.0 <= u <= WIDTH and 0.0 <= v <= HEIGHT:
            u += noise_px * stream.gauss(2 * number)
            v += noise_px * stream.gauss(2 * number + 1)
            rows.append(f"{x_cm},{y_cm},{height_cm:g},{u:.4f},{v:.4f}")
    return "\n".join(rows) + "\n"
