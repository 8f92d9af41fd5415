"""`mirotwin camera track`: the tracker on pictures from files and recordings, and what is said of others."""

import json
import math
import shutil

import pytest
from mcap.reader import make_reader
from PIL import Image

from miro_exact.clock import nanoseconds
from miro_host.eye import calibration_kinds
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.colours import FLOOR
from miro_host.eye.patterns import IDENTITIES, TEAMS
from miro_sim.pitch.colour_samples import colours_of
from miro_sim.pitch.picture_settings import PictureSettings
from mirotwin.recording import reader as recording_reader

FRAMES = 6
CAMERA = (
    *("--set", "camera.kind=pixels", "--set", "camera.calibration=exact", "--set", "camera.delay_frames=0"),
    *("--set", "network.robot.1.start_error_y_cm=40"),
)


@pytest.fixture(scope="module")
def seen(mirotwin, short, tmp_path_factory):
    """A run whose measurements arrive at once, its plain frames in a folder and in the recording; and the files."""
    folder = tmp_path_factory.mktemp("seen")
    frames = ("--frames", folder / "frames", "--record-frames")
    mirotwin.succeeds("run", short, "--out", folder / "run", "-q", "--no-figure", *CAMERA, *frames)
    (folder / "camera.toml").write_text(calibration_kinds.exact(CameraParameters()).text())
    (folder / "colours.toml").write_text(colours_of(CameraParameters(), PictureSettings(), "diagonal").text())
    return folder


def of(seen, path="frames"):
    """The words that track the robots in pictures of the run, or in others."""
    files = ("--calibration", seen / "camera.toml", "--colours", seen / "colours.toml")
    return "camera", "track", seen / path, *files


def measured(seen):
    found = {}
    for frame, period in enumerate(recording_reader.read(seen / "run" / "run.mcap").periods):
        for robot in period.robots:
            at = robot.measurement
            found[frame, robot.slot] = (at.x_m, at.y_m, at.theta_rad)
    return found


@pytest.mark.parametrize("path", ["frames", "run/run.mcap"])
def test_frames_of_a_run_give_the_postures_that_its_recording_has(mirotwin, seen, path):
    """Rounding to red, green and blue moves a few pixels over the border of a class."""
    out = mirotwin.succeeds(*of(seen, path), "--numbers", "0,2", "--json")
    lines = [json.loads(line) for line in out.splitlines()]
    expected = measured(seen)
    assert len(lines) == len(expected) == 2 * FRAMES
    for line in lines:
        x_m, y_m, theta_rad = expected[line["frame"], line["robot"]]
        assert line["lost"] is False
        assert math.hypot(line["x_m"] - x_m, line["y_m"] - y_m) < 0.002
        assert abs(math.remainder(line["theta_rad"] - theta_rad, math.tau)) < 0.06
        assert line["tick"] == 800_800 * line["frame"]
        assert 0.0 <= line["confidence"] <= 1.0


def test_the_table_has_a_row_a_robot_and_frame_and_says_who_is_lost(mirotwin, seen):
    out = mirotwin.succeeds(*of(seen), "--numbers", "2,1")
    head, *rows, last = [line.split() for line in out.splitlines()]
    assert head == ["frame", "robot", "x_cm", "y_cm", "heading_deg", "confidence", "picture"]
    assert [row[:2] for row in rows] == [[f"{n}", robot] for n in range(FRAMES) for robot in "21"]
    assert {tuple(row[2:3]) for row in rows if row[1] == "1"} == {("lost",)}
    assert float(rows[0][2]) == pytest.approx(100.0 * measured(seen)[0, 2][0], abs=0.2)
    assert rows[-1][-1] == "frame-000005.png"
    assert " ".join(last) == "6 pictures: robot 2 in 6, robot 1 in 0"


def test_a_lost_robot_has_no_numbers_in_json(mirotwin, seen):
    _, out, _ = mirotwin(*of(seen), "--team", "blue", "--numbers", "0", "--json")
    lost = {"lost": True, "x_m": None, "y_m": None, "theta_rad": None, "confidence": None}
    for frame, line in enumerate(out.splitlines()):
        picture = {"frame": frame, "picture": f"frame-{frame:06d}.png", "tick": 800_800 * frame, "robot": 0}
        assert json.loads(line) == {**picture, **lost}


def test_ppm_files_say_the_same_and_other_files_are_passed_over(mirotwin, seen, tmp_path):
    for number in range(FRAMES):
        with Image.open(seen / "frames" / f"frame-{number:06d}.png") as image:
            image.save(tmp_path / f"{number}.PPM", "PPM")
    (tmp_path / "notes.txt").write_text("mine")
    given = ("--numbers", "0,2", "--json", "--centroid", "weighted")
    one, other = (mirotwin.succeeds(*of(seen, path), *given).splitlines() for path in ("frames", tmp_path))
    one, other = ([{**json.loads(line), "picture": ""} for line in lines] for lines in (one, other))
    assert one == other != []


def test_of_several_networks_one_is_taken(mirotwin, seen, tmp_path):
    for number in (0, 1):
        for network in (0, 3):
            name = f"net{network}-frame-{number:06d}.png"
            shutil.copy(seen / "frames" / f"frame-{number:06d}.png", tmp_path / name)
    _, out, _ = mirotwin(*of(seen, tmp_path), "--network", 3, "--numbers", "0")
    pictures = [line.split()[-1] for line in out.splitlines()[1:3]]
    assert pictures == ["net3-frame-000000.png", "net3-frame-000001.png"]
    err = mirotwin.refuses(*of(seen, tmp_path), "--network", 1)
    assert f"{tmp_path}: --network 1: no picture of it" in err


def test_recorded_frames_are_images_for_viewers_and_change_nothing_else(mirotwin, short, seen, tmp_path):
    assert mirotwin("run", short, "--out", tmp_path / "plain", "-q", "--no-figure", *CAMERA)[0] == 0
    plain = recording_reader.read(tmp_path / "plain" / "run.mcap")
    assert recording_reader.read(seen / "run" / "run.mcap") == plain
    with (seen / "run" / "run.mcap").open("rb") as file:
        found = [*make_reader(file).iter_messages(["/net0/camera/image"])]
    assert len(found) == FRAMES
    for frame, (schema, channel, message) in enumerate(found):
        assert schema.name == "foxglove.CompressedImage"
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        content = json.loads(message.data)
        assert sorted(content) == sorted(json.loads(schema.data)["properties"])
        stamp = content["timestamp"]
        assert stamp["sec"] * 10**9 + stamp["nsec"] == message.log_time == nanoseconds(800_800 * frame)
    err = mirotwin.refuses(*of(seen, tmp_path / "plain" / "run.mcap"))
    assert "no frames of the camera of network 0; record them: mirotwin run .. --record-frames" in err


def test_a_recording_that_was_broken_off_is_tracked_as_far_as_it_goes(mirotwin, seen, tmp_path):
    part = tmp_path / "run.part.mcap"
    data = (seen / "run" / "run.mcap").read_bytes()
    part.write_bytes(data[: len(data) // 2])
    code, out, err = mirotwin(*of(seen, part), "--numbers", "0")
    assert code in (0, 2)
    assert str(part) in err
    assert len(out.splitlines()) < FRAMES + 2


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("0.png", b"", "0.png: is no PNG or PPM picture; convert it to PNG"),
        ("0.png", b"GIF89a....", "0.png: is no PNG or PPM picture; convert it to PNG"),
        ("0.ppm", b"P6\n320 240\n255\nshort", "0.ppm: is damaged: "),
        ("0.ppm", b"P6\n640 480\n255\n", "0.ppm: 640 x 480 pixels; give pictures of 320 x 240"),
        ("0.ppm", b"P6\n100000 100000\n255\n", "0.ppm: far too many pixels; give pictures of 320 x 240"),
        ("0.ppm", b"P6\n320 x\n", "0.ppm: is "),
        ("0.txt", b"", ": holds no .png and no .ppm; give a folder of pictures, or a run.mcap"),
    ],
)
def test_a_picture_that_is_none_is_named(mirotwin, seen, tmp_path, name, content, expected):
    (tmp_path / name).write_bytes(content)
    err = mirotwin.refuses(*of(seen, tmp_path))
    assert err.startswith(f"{tmp_path}{'' if expected[0] == ':' else '/'}{expected}")


def test_a_damaged_picture_is_named(mirotwin, seen, tmp_path):
    data = (seen / "frames" / "frame-000000.png").read_bytes()
    for number, broken in enumerate((data[:5000], data[:60] + b"\0" * 90 + data[150:], data[:20])):
        file = tmp_path / f"{number}" / "x.png"
        file.parent.mkdir()
        file.write_bytes(broken)
        assert mirotwin.refuses(*of(seen, file.parent)).startswith(f"{file}: is ")


def same_colour(text):
    """The class of magenta, once more as violet."""
    _, _, rest = text.partition("[colours.magenta]\n")
    means = rest.partition("\n\n")[0]
    before, _, after = text.partition("[colours.violet]\n")
    return f"{before}[colours.violet]\n{means}\n\n{after.partition(chr(10) * 2)[2]}"


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (same_colour, ": colours.violet: cannot be told from magenta: hues too near for the noise"),
        (lambda text: text.replace("magenta", "pink"), ": colours.pink: unknown colour; use yellow, blue,"),
        (lambda text: text.replace("magenta", "orange", 1), ": line 46, column 16: not TOML: "),
        (lambda text: "[colours.yellow]\ny = 200\ncb = 32\ncr = 147\n", ": colours.magenta: no class of this"),
        (lambda text: "", ": colours: this key is missing"),
        (lambda text: "[colours]\n", ": colours: there is no colour; sample"),
        (lambda text: text.replace("spread", "sprawl", 1), ": colours.yellow.sprawl: unknown key"),
    ],
)  # fmt: skip
def test_colours_that_cannot_be_used_are_named_with_file_and_key(mirotwin, seen, tmp_path, change, expected):
    colours = tmp_path / "colours.toml"
    colours.write_text(change((seen / "colours.toml").read_text()))
    given = ("--calibration", seen / "camera.toml", "--colours", colours)
    assert mirotwin.refuses("camera", "track", seen / "frames", *given).startswith(f"{colours}{expected}")


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--numbers", "0,1,0"), "Invalid value for '--numbers': two robots have the number 0; name each once."),
        (("--numbers", "5"), "Invalid value for '--numbers': '5' is no robot's number: 0 to 4"),
        (("--numbers", ""), "Invalid value for '--numbers': '' is no robot's number"),
        (("--team", "red"), "Invalid value for '--team': 'red' is not one of 'yellow', 'blue'."),
        (("--calibration", "absent"), "absent: "),
        (("--calibration", "."), ".: is a folder"),
    ],
)  # fmt: skip
def test_what_cannot_be_tracked_is_refused(mirotwin, seen, options, expected):
    err = mirotwin.refuses(*of(seen), *options)
    assert err.startswith(expected)


@pytest.mark.parametrize("path", ["absent", "camera.toml"])
def test_a_path_that_is_neither_folder_nor_recording_is_named(mirotwin, seen, path):
    assert mirotwin.refuses(*of(seen, path)).startswith(f"{seen / path}: ")


def test_every_colour_of_the_tracker_is_in_the_file_that_calibrate_writes(seen):
    text = (seen / "colours.toml").read_text()
    for name in (*TEAMS, *IDENTITIES):
        assert f"[colours.{name}]" in text
    assert f"[{FLOOR}]" in text
