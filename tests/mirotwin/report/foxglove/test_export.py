"""`mirotwin export run.mcap --out foxglove.mcap`: the recording and what Foxglove draws of it, in one file."""

import base64
import io
import math
from collections import Counter
from itertools import pairwise
from types import SimpleNamespace

import msgspec
import pytest
from mcap.reader import make_reader

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, nanoseconds
from mirotwin.recording import reader
from mirotwin.recording.channels import ActionMessage
from mirotwin.recording.container import RecordingError
from mirotwin.recording.recorder import Recorder
from tests.mirotwin import synthetic
from tests.mirotwin.report.foxglove.conftest import exported, read

ROBOTS = ("net0/robot0", "net0/robot2", "net1/robot1")
FRAMES = {f"{robot}{what}" for robot in ROBOTS for what in ("", "/measured", "/reference")}
FRAMES |= {"net0/camera", "net1/camera"}


def of(shown, topic):
    return [one for one in shown if one.topic == topic]


def stamp_ns(time):
    return time["sec"] * 1_000_000_000 + time["nsec"]


def test_everything_that_was_recorded_stands_in_the_file_as_it_was_but_for_the_frames(recording, shown):
    ours = [one for one in read(recording) if one.name != "foxglove.CompressedImage"]
    assert [one for one in shown if not one.topic.startswith("/foxglove/")] == ours
    both = (recording, exported(recording)[0])
    before, after = (reader.parse(data, "x") for data in both)
    assert after == before
    names = [[one.name for one in make_reader(io.BytesIO(data)).iter_attachments()] for data in both]
    assert names[0] == names[1] != []


def test_the_frames_of_the_cameras_are_the_recorded_ones(recording, shown):
    for network in (0, 1):
        before = of(read(recording), f"/net{network}/camera/image")
        after = of(shown, f"/foxglove/net{network}/image")
        assert len(after) == 36
        assert [one.content["data"] for one in after] == [one.content["data"] for one in before]
        assert base64.b64decode(after[0].content["data"]).startswith(b"\x89PNG")
        assert {one.content["format"] for one in after} == {"png"}
        assert {one.content["frame_id"] for one in after} == {f"net{network}/camera"}
        assert [one.time_ns for one in after] == [one.time_ns for one in before]


def test_every_message_has_the_time_of_what_it_tells(shown):
    starts = {nanoseconds(index * CONTROL_PERIOD_TICKS) for index in range(36)}
    for one in shown:
        if one.name == "foxglove.FrameTransforms":
            assert {stamp_ns(part["timestamp"]) for part in one.content["transforms"]} == {one.time_ns}
        elif one.name == "foxglove.SceneUpdate":
            assert {stamp_ns(part["timestamp"]) for part in one.content["entities"]} == {one.time_ns}
        elif one.topic.startswith("/foxglove/") and one.name != "mirotwin.Error":
            assert stamp_ns(one.content["timestamp"]) == one.time_ns
        if one.topic.startswith("/foxglove/"):
            assert one.time_ns in starts


def test_the_frames_of_reference_are_one_tree(shown):
    parents = {}
    for one in of(shown, "/foxglove/transforms"):
        for part in one.content["transforms"]:
            assert parents.setdefault(part["child_frame_id"], part["parent_frame_id"]) == "pitch"
    assert set(parents) == FRAMES
    used = {one.content["frame_id"] for one in shown if "frame_id" in one.content}
    for topic in ("/foxglove/scene", "/foxglove/trails"):
        used |= {part["frame_id"] for one in of(shown, topic) for part in one.content["entities"]}
    assert used <= {"pitch", *FRAMES}


def quaternions(content):
    """Every one in a message, however deep."""
    if isinstance(content, list):
        return [found for part in content for found in quaternions(part)]
    if not isinstance(content, dict):
        return []
    if set(content) == {"x", "y", "z", "w"}:
        return [content]
    return [found for part in content.values() for found in quaternions(part)]


def test_every_quaternion_is_a_rotation_and_every_colour_is_one(shown):
    count = 0
    for one in shown:
        for q in quaternions(one.content) if one.topic.startswith("/foxglove/") else ():
            assert abs(q["x"] ** 2 + q["y"] ** 2 + q["z"] ** 2 + q["w"] ** 2 - 1.0) < 1e-14
            count += 1
    assert count > 600


def test_the_transforms_are_the_recorded_postures(shown):
    for channel, frame in (("truth", ""), ("reference", "/reference"), ("measurement", "/measured")):
        recorded = {one.time_ns: one.content for one in of(shown, f"/net0/robot2/{channel}")}
        found = {
            one.time_ns: part
            for one in of(shown, "/foxglove/transforms")
            for part in one.content["transforms"]
            if part["child_frame_id"] == f"net0/robot2{frame}"
        }
        assert found.keys() == recorded.keys()
        assert len(found) > 25
        for time_ns, part in found.items():
            at, q = recorded[time_ns], part["rotation"]
            assert part["translation"] == {"x": at["x_m"], "y": at["y_m"], "z": 0.0}
            assert (q["x"], q["y"]) == (0.0, 0.0)
            turn = 2.0 * math.atan2(q["z"], q["w"]) - at["theta_rad"]
            assert math.remainder(turn, math.tau) == pytest.approx(0.0)


def test_the_same_entities_come_again_under_the_same_names(shown):
    scenes = [[part["id"] for part in one.content["entities"]] for one in of(shown, "/foxglove/scene")]
    assert len(scenes) == 2
    assert scenes[0] == scenes[1]
    assert len(set(scenes[0])) == len(scenes[0])
    assert {"pitch", "ball", "net1/robot1", "net0/robot0/measured", "net0/robot2/path"} <= set(scenes[0])
    trails = [[part["id"] for part in one.content["entities"]] for one in of(shown, "/foxglove/trails")]
    assert len(trails) == 36
    assert all(sorted(names) == sorted(set(trails[0])) for names in trails)
    assert not set(trails[0]) & set(scenes[0])


def test_a_trail_ends_where_the_robot_is_and_a_path_holds_the_reference(shown):
    truth = of(shown, "/net0/robot0/truth")[-1].content
    trails = {part["id"]: part for part in of(shown, "/foxglove/trails")[-1].content["entities"]}
    points = trails["net0/robot0/trail/truth"]["lines"][0]["points"]
    assert len(points) == 8  # one in five control periods, and the last one
    assert (points[-1]["x"], points[-1]["y"]) == (truth["x_m"], truth["y_m"])
    scene = {part["id"]: part for part in of(shown, "/foxglove/scene")[0].content["entities"]}
    path = scene["net0/robot2/path"]["lines"][0]["points"]
    for one in of(shown, "/net0/robot2/reference"):
        ways = [math.hypot(at["x"] - one.content["x_m"], at["y"] - one.content["y_m"]) for at in path]
        assert min(ways) < 0.011


def test_errors_are_truth_against_reference(shown):
    found = of(shown, "/foxglove/net0/robot0/error")
    pairs = zip(of(shown, "/net0/robot0/truth"), of(shown, "/net0/robot0/reference"), strict=True)
    errors = [100.0 * (true.content["x_m"] - at.content["x_m"]) for true, at in pairs]
    assert [one.content["x_cm"] for one in found] == errors
    assert len(found) == 36


def test_the_log_tells_of_lost_robots_and_frames(shown):
    lines = [one.content for one in of(shown, "/foxglove/log")]
    words = Counter(line["message"].lstrip("0123456789 ") for line in lines)
    assert words["not measured: the robot or the frame was lost"] >= 3
    assert words["measured again"] >= 3
    assert words["damaged frames rejected"] + words["no frame arrived since the last exposure"] >= 3
    begun = of(shown, "/net0/robot0/truth")
    measured = {one.time_ns for one in of(shown, "/net0/robot0/measurement")}
    lost = [one.time_ns not in measured for one in begun][1:]
    begins = sum(now and not before for before, now in pairwise(lost))
    told = [
        line for line in lines if line["name"] == "net0/robot0" and line["message"].startswith("not measured")
    ]
    assert len(told) == begins > 0


def recorded(count, add, scenario=""):
    """A recording of synthetic periods, whose scenario says nothing unless told."""
    source = reader.RunSource("none", scenario, 0, b":00000001FF\n", "0" * 64)
    stream = io.BytesIO()
    with Recorder(stream, source) as recorder:
        for period in synthetic.periods(count):
            recorder.write(period)
        add(recorder)
    return stream.getvalue()


class Fault:
    kind, tick, pc, symbol = 3, 5 * CONTROL_PERIOD_TICKS + 7, 0x123, "main"

    def __str__(self):
        return "writes to a busy LM629 at main+3"


def test_a_fault_of_the_firmware_is_an_error_at_its_tick():
    robot = SimpleNamespace(network=0, slot=0, board=SimpleNamespace(faults=[Fault()]))
    shown = read(exported(recorded(3, lambda to: to.write_faults([robot])))[0])
    (line,) = of(shown, "/foxglove/log")
    assert line.time_ns == nanoseconds(Fault.tick)
    assert (line.content["level"], line.content["name"]) == (4, "net0/robot0")
    assert line.content["message"] == "firmware fault: writes to a busy LM629 at main+3"


def test_what_was_done_to_a_robot_stands_in_the_log():
    def add(recorder):
        recorder.write(("/net0/actions", 800_800 * 3 + 5, ActionMessage(800_800 * 3 + 5, 0, "reset", 1)))
        for period in list(synthetic.periods(4))[3:]:
            recorder.write(period)

    (line,) = of(read(exported(recorded(3, add))[0]), "/foxglove/log")
    assert (line.content["message"], line.content["name"]) == ("reset: 1", "net0/robot0")
    assert line.time_ns == nanoseconds(800_800 * 3 + 5)


def test_a_recording_whose_scenario_cannot_be_read_is_shown_without_it_and_that_is_said():
    data, result = exported(recorded(3, lambda recorder: None, "name = 'x'\nother = 1\n"))
    shown = read(data)
    (note,) = result.notes
    assert note.startswith("run.mcap: other: ")
    assert note.endswith("so there are no camera, no ball, no patches and no references in the scene")
    (scene,) = of(shown, "/foxglove/scene")
    drawn = ["pitch", "net0/robot0", "net0/robot0/measured", "net0/robot0/reference"]
    assert [part["id"] for part in scene.content["entities"]] == drawn
    assert len(of(shown, "/foxglove/transforms")) == 3


def test_a_part_is_shown_as_far_as_it_goes_and_stays_marked_as_one(recording):
    part = recording[: len(recording) * 2 // 3]
    data, result = exported(part)
    assert 10 < len(result.periods) < 36
    assert len(of(read(data), "/foxglove/transforms")) == len(result.periods)
    assert len(result.notes) == 1
    assert "the file ends in the middle of a record" in result.notes[0]
    again = reader.parse(data, "x")
    assert again.periods == reader.parse(part, "x").periods
    assert "broken off" in again.broken_off


def test_a_file_that_has_the_topics_already_is_refused(recording):
    with pytest.raises(BadInput, match="holds Foxglove's topics already"):
        exported(exported(recording)[0])


def test_a_damaged_frame_is_bad_input():
    def add(recorder):
        recorder.write_image(0, 5, b"png")
        recorder.flush()
        channel = recorder._rows.channels["/net0/camera/image"]
        recorder._writer.chunk.add(channel, 250, msgspec.Raw(b'{"tick":'))

    with pytest.raises(RecordingError, match="/net0/camera/image at 250 ns"):
        exported(recorded(2, add))


def test_the_command_writes_the_file_and_says_what_is_in_it(mirotwin, recording, tmp_path):
    given, out = tmp_path / "run.mcap", tmp_path / "fox.mcap"
    given.write_bytes(recording)
    said = mirotwin.succeeds("export", given, "--out", out)
    assert said == f"{out}: 36 control periods and 72 camera frames for Foxglove\n"
    assert out.read_bytes() == exported(recording)[0]


@pytest.mark.parametrize(
    ("content", "options", "expected"),
    [
        (b"\x80\x00\x01", (), "{given}: raw bytes, which holds no postures; give a run.mcap that `mirotwin run` wrote"),
        (b"1 > aa\n", (), "{given}: stream file, which holds no postures; give a run.mcap that `mirotwin run` wrote"),
        (b"\x89MCAP0\r\n", (), "{given}: offset 8: "),
        (b"", ("--network", "0"), "--network does not go with --as foxglove, which writes all networks."),
    ],
)  # fmt: skip
def test_what_is_no_recording_is_refused_in_one_line(mirotwin, tmp_path, content, options, expected):
    given, out = tmp_path / "given", tmp_path / "fox.mcap"
    given.write_bytes(content)
    said = mirotwin.ends(2, "export", given, "--out", out, *options)
    assert said.splitlines()[-1].startswith(f"mirotwin: error: {expected.format(given=given)}")
    assert not out.exists()
