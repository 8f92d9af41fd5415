"""A test of a frame that puts the stop off does so however many characters come before it is over."""

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from mirotwin.fuzz.target import target_for
from tests.mutants.heard import verdicts


def test_characters_behind_the_tested_frame_do_not_end_the_time_that_its_test_has():
    target = target_for(load_hex(image_path()))
    # A frame, repeated until its test falls into the end of the 110 ms, and the next frame without a pause behind it.
    data = bytes.fromhex("0000000088889a8888888800")
    assert target.run(data) == 0, target.failure
    found = verdicts(target.image, target.script(data))
    assert [name for name, verdict in found.items() if verdict == "failed"] == []
