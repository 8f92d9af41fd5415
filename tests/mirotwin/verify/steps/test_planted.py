"""Mistakes that are planted in the firmware's source are found by the example's steps files, without Python."""

from pathlib import Path

import pytest

from mirotwin.verify.steps.running import run_test
from tests.mirotwin.verify.checks.rig import built, needs_sdcc, own_image, planted

EXAMPLES = Path(__file__).parents[4] / "examples" / "hil-steps"
STEPS_ALONE = """
scenario = "silent"
duration_s = 0.5
step = [
    { pause_ms = 5 },
    { send = "team", left_m_s = 0.2, right_m_s = 0.2 },
    { wait_for = "frame", within_ms = 30 },
    { wait_for = "command", name = "STT", side = "right", within_ms = 5 },
    { never = "command", for_ms = 105 },
    { note = "110 ms", wait_for = "command", name = "STT", within_ms = 6 },
]
"""
MISTAKES = {
    "stops 15 ms late": "step 6 (110 ms): wait_for command: tick ",
    "stops 15 ms early": "step 5: never command: tick ",
    "never stops": "step 6 (110 ms): wait_for command: tick ",
}
EARLY = ("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS - 15)")


def run(path, image):
    return run_test(str(path), image)


@needs_sdcc
@pytest.mark.parametrize("mistake", MISTAKES)
def test_steps_alone_find_it_at_the_step_that_it_concerns(mistake, tmp_path):
    path = tmp_path / "alone.scenario.toml"
    path.write_text(STEPS_ALONE)
    outcome = run(path, built(*EARLY) if mistake == "stops 15 ms early" else planted(mistake))
    assert outcome.verdict == "failed"
    assert outcome.lines[0].startswith(f"step failed: {MISTAKES[mistake]}")


@needs_sdcc
def test_a_failsafe_of_125_ms_fails_a_step_and_the_checks_of_the_example(tmp_path):
    image = planted("stops 15 ms late")
    outcome = run(EXAMPLES / "failsafe.scenario.toml", image)
    step, check = outcome.lines[:2]
    assert step.startswith("step failed: step 9 (smooth stop): wait_for command: tick ")
    assert 'wanted command with name = "STT" within 6 ms, found nothing happened meanwhile' in step
    assert check.startswith("expectation failed: failsafe_stop_ms: net0/robot0: tick ")


@needs_sdcc
def test_firmware_that_takes_damaged_frames_fails_the_other_example(tmp_path):
    wrong = "take_body(rx_taken - frame_size + RX3_AT_HDR); if (0) {"
    image = built("decode.c", "if (!take_body(rx_taken - frame_size + RX3_AT_HDR)) {", wrong)
    outcome = run(EXAMPLES / "damage.scenario.toml", image)
    assert outcome.lines[0].startswith("step failed: step 3: never command: tick ")


def test_the_shipped_firmware_passes_all_of_them(tmp_path):
    path = tmp_path / "alone.scenario.toml"
    path.write_text(STEPS_ALONE)
    found = [run(one, own_image()) for one in (path, *sorted(EXAMPLES.glob("*.scenario.toml")))]
    assert [one.verdict for one in found] == 4 * ["passed"]
