"""`--stack-from`: where the stack begins in an image that has no linker's map."""

import pytest

from miro_robot.firmware import image_path
from tests.mirotwin.conftest import hex_file

INTO_DATA = bytes.fromhex("75817f c0e0 1581 1581 c0e0 80fe")
"""MOV SP,#7Fh; PUSH ACC at 80h; DEC SP twice, which leaves it at 7Eh; PUSH ACC at 7Fh; SJMP $."""
SAID = "firmware went below the start of its stack (SP 7Eh, its stack is 80h to FFh)"


@pytest.fixture
def image(tmp_path):
    return hex_file(tmp_path / "a.ihx", INTO_DATA)


def test_data_below_the_stack_is_guarded_where_the_option_says_where_it_begins(mirotwin, image):
    assert mirotwin("fw", "run", image)[:2] == (0, "")
    code, _, err = mirotwin("fw", "run", image, "--stack-from", "0x80")
    assert code == 3
    assert SAID in err


def test_a_robot_run_and_the_replay_of_its_recording_know_the_stack(mirotwin, image, tmp_path):
    out = tmp_path / "out"
    code, _, err = mirotwin(
        "run", "fig6", "--firmware", image, "--stack-from", "0x80", "--out", out, "--no-figure"
    )
    assert code == 3
    assert SAID in err
    code, _, err = mirotwin("replay", out / "run.mcap", "-q")
    assert code == 3
    assert SAID in err
    code, _, err = mirotwin("replay", out / "run.mcap", "-q", "--stack-from", "0x80")
    assert (code, "--stack-from needs --firmware" in err) == (2, True)


def test_conform_tells_of_it(mirotwin, image):
    code, _, err = mirotwin("conform", image, "--rule", "P53", "--stack-from", "0x80")
    assert code == 3
    assert SAID in err


@pytest.mark.parametrize("address", ["80", "0x100", "-1", "0x", "stack", "0x1g", ""])
def test_what_is_not_an_address_of_internal_ram_is_refused(mirotwin, image, address):
    code, _, err = mirotwin("fw", "run", image, "--stack-from", address)
    assert code == 2
    assert "is not an address of internal RAM; give 0x00 to 0xff." in err


@pytest.mark.parametrize("command", [["fw", "run"], ["conform"], ["run", "fig6", "--firmware"]])
def test_an_image_with_a_map_has_its_stack_from_there(mirotwin, command):
    code, _, err = mirotwin(*command, image_path(), "--stack-from", "0x80")
    assert code == 2
    assert "the .map beside the image begins its stack at" in err
