"""`mirotwin camera look`: the picture of a frame, with what the tracker made of it."""

from pathlib import Path

import pytest
from PIL import Image

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.camera.picture import Picture, taken
from mirotwin.camera.view import views_of
from tests.mirotwin.conftest import hex_file

GAUSSIAN = ("--set", "camera.kind=gaussian")


def world_of(path, seed=0):
    return World(load(str(path)).scenario, seed, load_hex(image_path()))


def test_the_picture_with_the_overlay_is_enlarged_and_says_what_it_shows(
    mirotwin, short, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    file = Path("short-4-net0-frame-000003.png")
    assert mirotwin("camera", "look", short, "--at", "120ms", "--seed", 4)[:2] == (0, f"{file}\n")
    with Image.open(file) as image:
        assert image.size == (960, 744)
    first = file.read_bytes()
    pictures = []
    world = world_of(short, seed=4)
    views_of(world, "short")[0].shows.append(lambda view: pictures.append(view.png(plain=False)))
    world.run_to(3 * CONTROL_PERIOD_TICKS + 1)
    assert first == pictures[3] == pictures[-1]
    assert mirotwin("camera", "look", short, "--at", "2880000t", "--seed", 4, "--force")[0] == 0
    assert file.read_bytes() == first


@pytest.mark.parametrize("plain", [True, False])
def test_looking_changes_no_bit_of_a_run(short, plain):
    seen, unseen = world_of(short), world_of(short)
    pictures = []
    views_of(seen, "short")[0].shows.append(lambda view: pictures.append(view.png(plain)))
    while not unseen.finished:
        seen.step()
        unseen.step()
    assert seen.digest == unseen.digest
    assert seen.save() == unseen.save()
    assert len(set(pictures)) == len(pictures) == unseen.index


def test_a_frame_that_the_pc_never_got_is_shown_as_it_was_and_named(short):
    scenario = load(str(short), ("camera.kind=pixels", "camera.dropped_frames=0.5")).scenario
    seen, unseen = (World(scenario, 0, load_hex(image_path())) for _ in range(2))
    captions, pictures = [], []

    def keep(view):
        captions.append("not received" in view.caption())
        pictures.append(view.picture().data)
        view.png(plain=False)

    sight = seen.networks[0].sight
    views_of(seen, "short")[0].shows.append(keep)
    while not seen.finished:
        seen.step()
        unseen.step()
    assert seen.digest == unseen.digest
    assert 0 < captions.count(True) == sight.dropped < len(captions)
    assert len(set(pictures)) == len(pictures)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--at", "1s", *GAUSSIAN), "{short}: camera.kind: this camera renders no pixels; choose kind ="),
        (("--at", "0.3s"), "{short}: --at 0.3s: the run ends at 0.200 s; look earlier"),
        (("--at", "0.1s", "--network", 1), "{short}: --network 1: there is no such network; there is only 0"),
        (
            ("--at", "soon"),
            "Invalid value for '--at': 'soon' is not a time; write 2s, 20ms, 341us or 5min, or 48000t for ticks.",
        ),
        (("--at", "-1"), "Invalid value for '--at': '-1' is not a time"),
        (("--at", "1e3"), "Invalid value for '--at': '1e3' is not a time"),
        (("--at", "99999999999s"), "Invalid value for '--at': '99999999999s' is too long"),
        (
            ("--at", "1.2"),
            "Invalid value for '--at': '1.2' is not a time; it has no unit: write 1.2s for seconds, 1t for ticks",
        ),
        (("--at", "0s", "--out", "absent/x.png"), "absent/x.png: there is no folder absent;"),
        ((), "Missing option '--at'."),
    ],
)
def test_what_cannot_be_looked_at_is_refused_with_the_remedy(
    mirotwin, short, tmp_path, monkeypatch, options, expected
):
    monkeypatch.chdir(tmp_path)
    assert mirotwin.refuses("camera", "look", short, *options).startswith(expected.format(short=short))
    assert list(tmp_path.iterdir()) == []


def test_a_run_that_a_fault_stops_before_is_not_drawn(mirotwin, short, tmp_path):
    image = hex_file(tmp_path / "faulty.ihx", b"\xa5")
    out = tmp_path / "frame.png"
    err = mirotwin.ends(3, "camera", "look", short, "--at", "0.1s", "--firmware", image, "--out", out)
    assert not out.exists()
    assert "firmware fault: net0/robot0" in err


def test_windows_of_a_picture_are_its_pixels_and_none_lies_outside(short):
    world = world_of(short)
    world.step()
    eye = world.networks[0].sight.eye
    whole = taken(eye)
    assert whole.window(17, 31, 40, 9) == eye.window(17, 31, 40, 9)
    with pytest.raises(ValueError, match=r"window 2 x 1 at \(319, 0\) is not inside 320 x 240"):
        whole.window(319, 0, 2, 1)
    with pytest.raises(ValueError, match="5 bytes are not 320 x 240"):
        Picture(b"12345")
