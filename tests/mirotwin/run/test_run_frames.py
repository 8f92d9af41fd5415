"""`mirotwin run --frames`: every frame as a picture, nothing half-written, and not a bit of the run changed."""

import json
from pathlib import Path

import pytest
from PIL import Image

from tests.mirotwin.conftest import SHORT

FRAMES = [f"frame-{number:06d}.png" for number in range(6)]


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_every_frame_is_saved_and_the_run_is_the_same(mirotwin, short, finished, tmp_path):
    arguments = ("run", short, "--seed", 5, "-q", "--out", tmp_path / "out")
    assert mirotwin(*arguments, "--frames", tmp_path / "frames") == (0, "", "")
    assert names(tmp_path / "frames") == FRAMES
    assert (tmp_path / "out" / "run.mcap").read_bytes() == (finished / "run.mcap").read_bytes()
    for name in FRAMES:
        with Image.open(tmp_path / "frames" / name) as image:
            image.load()
            assert image.size == (320, 240)
    out = tmp_path / "look.png"
    at = ("--at", "0.167s", "--seed", 5, "--out", out)
    assert mirotwin("camera", "look", short, *at, "--plain")[0] == 0
    assert out.read_bytes() == (tmp_path / "frames" / FRAMES[5]).read_bytes()


def test_frames_of_several_networks_have_the_network_in_their_names(mirotwin, tmp_path):
    two = tmp_path / "two.toml"
    two.write_text(
        SHORT.replace("duration_s = 0.2", "duration_s = 0.04")
        + '[[network]]\nhost = "silent"\n[[network.robot]]\nslot = 1\nstart_error_x_cm = 60.0\n'
        + 'reference.kind = "line"\n'
    )
    mirotwin.succeeds("run", two, "--out", tmp_path / "out", "--frames", tmp_path / "out" / "frames", "-q")
    assert names(tmp_path / "out" / "frames") == [
        *("net0-frame-000000.png", "net0-frame-000001.png"),
        *("net1-frame-000000.png", "net1-frame-000001.png"),
    ]


def test_a_folder_with_content_is_left_alone_unless_it_is_to_be_replaced(mirotwin, short, tmp_path):
    folder = tmp_path / "frames"
    folder.mkdir()
    for name in ("frame-000000.png", "frame-000999.png", "frame-000003.part.png", "mine.png"):
        (folder / name).write_text("before")
    arguments = ("run", short, "-q", "--no-figure", "--out", tmp_path / "out", "--frames", folder)
    code, out, err = mirotwin(*arguments)
    assert (code, out) == (2, "")
    assert err == (
        f"mirotwin: error: {folder}: the folder is not empty (frame-000000.png, frame-000003.part.png,"
        " frame-000999.png, ..); choose another with --frames, or replace frame-*.png in it with --force\n"
    )
    assert (len(names(folder)), (tmp_path / "out").exists()) == (4, False)
    assert mirotwin(*arguments, "--force") == (0, "", "")
    assert names(folder) == [*FRAMES, "mine.png"]
    assert (folder / "mine.png").read_text() == "before"


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--frames", "{short}"), "{short}: exists and is not a folder; choose another folder with --frames"),
        (
            ("--frames", "frames", "--set", "camera.kind=gaussian"),
            "{short}: camera.kind: this camera renders no pixels; choose kind =",
        ),
        (
            ("--frames", "--record-frames"),
            "Invalid value for '--frames': the path is missing before --record-frames; a file of this name is ./--rec",
        ),
        (("--frames", ""), "Invalid value for '--frames': the path is empty."),
    ],
)
def test_frames_that_cannot_be_saved_are_refused_before_anything_is_written(
    mirotwin, short, tmp_path, monkeypatch, options, expected
):
    monkeypatch.chdir(tmp_path)
    err = mirotwin.refuses("run", short, *(option.format(short=short) for option in options))
    assert err.startswith(expected.format(short=short))
    assert names(tmp_path) == []


@pytest.mark.parametrize("raised", [KeyboardInterrupt(), OSError(28, "No space left on device")])
def test_a_run_that_breaks_off_leaves_whole_frames_only(mirotwin, short, tmp_path, monkeypatch, raised):
    write = Path.write_bytes

    def breaking(path, data):
        if path.name == "frame-000003.part.png":
            write(path, data[:100])
            raise raised
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", breaking)
    folder = tmp_path / "frames"
    code, _, err = mirotwin("run", short, "-q", "--out", tmp_path / "out", "--frames", folder)
    if isinstance(raised, OSError):
        assert code == 2
        ending = (
            f"error: {folder}: No space left on device; make room, or choose another folder with --frames\n"
        )
        assert err.endswith(ending)
    else:
        assert code == 130
    assert names(folder) == FRAMES[:3]
    assert json.loads((tmp_path / "out" / "summary.part.json").read_bytes())["complete"] is False
