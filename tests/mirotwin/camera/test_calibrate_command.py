"""`mirotwin camera calibrate`: a camera from control points, and what is said of points that tell none."""

from pathlib import Path

import pytest

from miro_host.eye import calibration, calibration_kinds, eye_file
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.colours import ColourClasses
from miro_sim.pitch.colour_samples import colours_of
from miro_sim.pitch.picture_settings import PictureSettings

HEADER = "x_cm,y_cm,height_cm,u_px,v_px\n"
LENS = ("camera.kind=pixels", "camera.lens.tilt_x_rad=0.01", "camera.lens.turn_rad=3.14")
TRUE = CameraParameters(tilt_x_rad=0.01, turn_rad=3.14)


def settings(*pairs):
    return [word for pair in pairs for word in ("--set", pair)]


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_without_noise_the_scenarios_camera_is_found_as_it_is(mirotwin, short, tmp_path):
    out = tmp_path / "camera.toml"
    given = ("--scenario", short, *settings(*LENS), "--noise-px", 0, "--out", out)
    table = mirotwin.succeeds("camera", "calibrate", *given)
    found = calibration.read(out)
    assert calibration_kinds.worst_error_m(TRUE, found) < 1e-5
    assert abs(found.camera.tilt_x_rad - 0.01) < 1e-4
    assert found.residuals.points == len(found.residuals.px) == 72
    assert found.residuals.max_px < 1e-3
    assert "worst error   0.000 cm over the pitch" in table


def test_points_of_a_scenario_give_the_same_calibration_from_their_file(mirotwin, short, tmp_path):
    first, second, points = (tmp_path / name for name in ("first.toml", "second.toml", "points.csv"))
    given = ("--scenario", short, "--seed", 3, "--points-out", points)
    mirotwin.succeeds("camera", "calibrate", *given, "--out", first)
    read = mirotwin.succeeds("camera", "calibrate", "--points", points, "--out", second)
    assert calibration_kinds.worst_error_m(calibration.read(first).camera, calibration.read(second)) < 1e-6
    residuals = calibration.read(second).residuals
    assert 0.3 < residuals.rms_px < 0.5
    assert f"residuals     rms {residuals.rms_px:.3f} px, max {residuals.max_px:.3f} px" in read
    table = read.split("off_px\n")[1].splitlines()
    worst = residuals.px.index(max(residuals.px))
    assert table[0].split()[0] == f"{worst + 1}"
    assert table[0].split()[-1] == f"{residuals.max_px:.3f}"
    shown = [float(line.split()[-1]) for line in table]
    assert shown == sorted(shown, reverse=True)


def test_the_noise_is_that_of_the_seed_and_as_large_as_asked_for(mirotwin, short, tmp_path):
    texts = []
    for number, (seed, noise) in enumerate([(1, 0.3), (1, 0.3), (2, 0.3), (1, 1.5)]):
        points = tmp_path / f"{number}.csv"
        given = ("--scenario", short, "--seed", seed, "--noise-px", noise, "--points-out", points)
        assert mirotwin("camera", "calibrate", *given, "--out", tmp_path / f"{number}.toml")[0] == 0
        texts.append(points.read_text())
    assert texts[0] == texts[1]
    assert len(set(texts)) == 3
    residuals = [calibration.read(tmp_path / f"{number}.toml").residuals for number in (0, 3)]
    assert 4.0 < residuals[1].rms_px / residuals[0].rms_px < 6.0


def test_colours_are_those_that_the_scenarios_tracker_would_use(mirotwin, short, tmp_path):
    colours = tmp_path / "colours.toml"
    given = ("--scenario", short, "--out", tmp_path / "camera.toml", "--colours-out", colours)
    assert mirotwin("camera", "calibrate", *given)[0] == 0
    expected = colours_of(CameraParameters(), PictureSettings(), "diagonal", ball=False)
    assert eye_file.read(colours, ColourClasses) == expected


def test_sampled_pixels_of_ones_own_pictures_give_colour_classes(mirotwin, short, tmp_path):
    points, samples, colours = (tmp_path / name for name in ("points.csv", "samples.csv", "colours.toml"))
    made = ("--scenario", short, "--points-out", points, "--out", tmp_path / "first.toml")
    assert mirotwin("camera", "calibrate", *made)[0] == 0
    yellow, blue = "yellow,200,40,140\n" * 4, "blue,60,190,110\n" * 4
    samples.write_text("colour,y,cb,cr\n" + yellow + blue)
    given = ("--points", points, "--out", tmp_path / "camera.toml", "--samples", samples)
    assert mirotwin("camera", "calibrate", *given, "--colours-out", colours)[0] == 0
    assert set(eye_file.read(colours, ColourClasses).colours) == {"yellow", "blue"}
    samples.write_text("colour,y,cb,cr\n" + yellow + yellow.replace("yellow", "lime"))
    err = mirotwin.refuses("camera", "calibrate", *given, "--colours-out", colours, "--force")
    assert f"{samples}: colours.lime: cannot be told from yellow" in err
    err = mirotwin.refuses("camera", "calibrate", *given, "--force")
    assert "give both --samples and --colours-out or neither" in err


def test_what_the_points_cannot_tell_is_taken_from_the_start(mirotwin, short, tmp_path):
    points, flat, start, out = (tmp_path / name for name in ("all.csv", "flat.csv", "start.toml", "out.toml"))
    given = ("--scenario", short, *settings(*LENS, "camera.lens.height_m=2.1"), "--noise-px", 0)
    assert mirotwin("camera", "calibrate", *given, "--points-out", points, "--out", start)[0] == 0
    flat.write_text(HEADER + "".join(line for line in points.open() if line.split(",")[2] == "0"))
    assert mirotwin("camera", "calibrate", "--points", flat, "--initial", start, "--out", out)[0] == 0
    found = calibration.read(out)
    assert "height_m" not in found.free
    assert found.camera.height_m == calibration.read(start).camera.height_m
    err = mirotwin.refuses("camera", "calibrate", "--points", flat, "--out", tmp_path / "else.toml")
    assert f"{flat}: no convergence" in err


GRID = [(x, y, 0, 16 + 2.28 * (x + 10), 219 - 2.24 * (y + 10)) for x in (-10, 50, 110) for y in (-10, 35, 80)]


def csv(rows):
    return HEADER + "".join(",".join(map(str, row)) + "\n" for row in rows)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (csv(GRID[:4]), ": 4 points for 8 parameters; give at least 5, better 20 all over the pitch"),
        (csv([(x, 0, 0, 2 * x, 100) for x in range(0, 90, 10)]), ": the points lie on one line; add points"),
        (csv([*GRID, (50, 35, 250, 160, 120)]), ": point 10: the point (0.500, 0.350, 2.500) m is not in front"),
        (csv([(y, x, h, u, v) for x, y, h, u, v in GRID]), ": no convergence"),
        (csv([(*row[:3], 1e4 * row[3], row[4]) for row in GRID]), ":2: u_px: '160000.0'; write a number within"),
        (csv(GRID) + "1,2,three,4,5\n", ":11: height_cm: 'three' is no number; write a number"),
        (csv(GRID) + "1,2,nan,4,5\n", ":11: height_cm: 'nan'; write a number within +-100000"),
        (csv(GRID) + "1,2,3\n", ":11: 3 cells; a line must have 5"),
        ("x,y\n1,2\n", ":1: the columns are x, y; they must be x_cm, y_cm, height_cm, u_px, v_px"),
        ("", ":1: the columns are ; they must be"),
        (HEADER, ": 0 points for 8 parameters; give at least 5"),
        (HEADER + "9" * 200_000, ":2: is no CSV: field larger than field limit"),
        ("\0" * 50, ":1: the columns are "),
    ],
)  # fmt: skip
def test_points_that_tell_no_camera_are_refused_with_file_place_and_remedy(
    mirotwin, tmp_path, text, expected
):
    points = tmp_path / "points.csv"
    points.write_text(text)
    err = mirotwin.refuses("camera", "calibrate", "--points", points, "--out", tmp_path / "camera.toml")
    assert err.startswith(f"{points}{expected}")
    assert names(tmp_path) == ["points.csv"]


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ((), "Give either --points or --scenario."),
        (("--points", "p.csv", "--scenario", "fig6"), "--points does not go with --scenario."),
        (("--points", "p.csv", "--seed", 1), "--seed needs --scenario."),
        (("--points", "p.csv", "--set", "duration_s=1"), "--set needs --scenario."),
        (
            ("--points", "p.csv", "--colours-out", "c.toml"),
            "With --points, give both --samples and --colours-out or neither.",
        ),
        (("--points", "absent.csv"), "absent.csv: cannot be read: No such file or directory"),
        (("--points", "."), ".: is a folder"),
        (("--points", "bytes"), "bytes: not UTF-8 text; give a text file"),
        (("--points", "p.csv", "--initial", "p.csv"), "p.csv: line 1, column 5: not TOML: "),
        (("--points", "out.toml"), "out.toml: is the input itself; choose another file with --out"),
        (("--scenario", "fig5"), "fig5: no such scenario"),
        (("--scenario", "fig6", "--points-out", "./out.toml"), "out.toml: is the file of --out and of --points-out"),
        (("--scenario", "fig6", "--noise-px", -1), "Invalid value for '--noise-px': -1.0 is not in the range"),
        (("--scenario", "fig6", "--noise-px", "nan"), "Invalid value for '--noise-px': 'nan' is not a number."),
    ],
)  # fmt: skip
def test_what_cannot_be_calibrated_is_refused_and_nothing_is_written(
    mirotwin, tmp_path, monkeypatch, options, expected
):
    monkeypatch.chdir(tmp_path)
    Path("p.csv").write_text(csv(GRID))
    Path("bytes").write_bytes(b"\xff\xfe")
    if "out.toml" in options:
        Path("out.toml").write_text(csv(GRID))
    before = names(tmp_path)
    assert mirotwin.refuses("camera", "calibrate", *options, "--out", "out.toml").startswith(expected)
    assert names(tmp_path) == before


def test_a_camera_without_a_lens_is_refused_after_the_note_of_what_its_kind_leaves_out(mirotwin, tmp_path):
    out = tmp_path / "out.toml"
    given = ("--scenario", "fig6", "--set", "camera.kind=gaussian")
    code, printed, err = mirotwin("camera", "calibrate", *given, "--out", out)
    note, error = err.splitlines()
    assert (code, printed, out.exists()) == (2, "", False)
    assert note.startswith("mirotwin: note: --set camera.kind=gaussian leaves out calibration")
    assert error.startswith("mirotwin: error: fig6: camera.kind: this camera has no lens")


@pytest.mark.parametrize("kind", ["gaussian", "geometric"])
def test_a_camera_without_pixels_has_no_colours_and_one_without_a_lens_no_points(
    mirotwin, short, tmp_path, kind
):
    given = ("--scenario", short, "--set", f"camera.kind={kind}", "--out", tmp_path / "camera.toml")
    err = mirotwin.refuses("camera", "calibrate", *given, "--colours-out", tmp_path / "colours.toml")
    assert f"{short}: camera.kind: this camera {'has no lens' if kind == 'gaussian' else 'renders no'}" in err
    assert names(tmp_path) == []
    assert mirotwin("camera", "calibrate", *given)[0] == (2 if kind == "gaussian" else 0)
