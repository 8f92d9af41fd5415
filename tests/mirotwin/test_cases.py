"""Files that once got the wrong answer (`tests/vectors/cases/`), through the commands that gave it."""

import pytest

from mirotwin.shell.verdicts import VERDICTS
from tests.vectors.paths import CASES


@pytest.fixture(autouse=True)
def in_tmp(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", ["bare-no-end.stream", "bare-with-end.stream"])
@pytest.mark.parametrize("command", ["replay", "test"])
def test_a_stream_whose_last_character_makes_firmware_jump_out_of_its_image_is_a_fault(
    mirotwin, name, command
):
    code, out, err = mirotwin(command, CASES / name, "--firmware", CASES / "jumps-out.ihx")
    assert code == VERDICTS["fault"].code
    assert (
        "no_fault: tick 3011208 (272.281 ms): firmware executed outside the loaded image at 0x1800"
        in out + err
    )


@pytest.mark.parametrize("command", ["replay", "test"])
def test_a_safety_case_on_firmware_that_hears_nothing_of_use_is_not_judged(mirotwin, command):
    code, out, err = mirotwin(command, CASES / "silent-case.stream")
    assert code == VERDICTS["not judged"].code
    assert "expectation not judged: moves_only_when_fresh: the run had no occasion for it" in out + err


@pytest.mark.parametrize("command", ["run", "profile"])
def test_an_interrupt_routine_that_ends_in_ret_is_a_fault_that_the_profile_shows(mirotwin, command):
    image, pins = CASES / "ret-in-interrupt.ihx", CASES / "int0.pins"
    code, out, err = mirotwin("fw", command, image, "--pins", pins, "--max-cycles", 300_000)
    assert code == VERDICTS["fault"].code
    assert (
        "firmware ended an interrupt routine with RET, not RETI (its level stays blocked) at 0x0042, tick 2400108"
        in err
    )
    assert ("never left  2400024" in out) == (command == "profile")
