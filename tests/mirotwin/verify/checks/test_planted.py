"""Each check of the firmware fails for a mistake that is planted in its source, and passes for the shipped image."""

import pytest

from miro_protocol.frames import ServiceFrame, encode
from tests.mirotwin.verify.checks.rig import MS, built, finish, needs_sdcc, planted, send, silent_world, team

ALL = """
failsafe_stop_ms = true
motors_off_ms = true
moves_only_when_fresh = true
accepts_only_sent = true
acts_within_ms = true
back_in_sync_within_ms = true
frames_accepted_min = 9
answers_within_ms = 25.0
answers_only_in_turn = true
wheels_within_m_s = 1.4601
"""
MISTAKES = {
    "stops 15 ms late": {"failsafe_stop_ms"},
    "stops 1 ms late": {"failsafe_stop_ms"},
    "stops 2 ms early": {"failsafe_stop_ms"},
    "never stops": {"failsafe_stop_ms"},
    "goes off 20 ms late": {"motors_off_ms"},
    "acts on a frame that is repeated": {"moves_only_when_fresh", "failsafe_stop_ms"},
    "takes frames with a bad CRC": {"accepts_only_sent", "moves_only_when_fresh", "failsafe_stop_ms"},
    "takes the velocities of the robot before it": {
        *("acts_within_ms", "back_in_sync_within_ms", "accepts_only_sent")
    },
    "does not cut off": {"wheels_within_m_s", "accepts_only_sent", "acts_within_ms"},
    "loses sync for good after a bad CRC": {
        *("back_in_sync_within_ms", "acts_within_ms", "frames_accepted_min", "answers_within_ms"),
        "motors_off_ms",  # for it, silence began earlier
    },
    "answers in another robot's turn": {"answers_only_in_turn"},
    "never answers": {"answers_within_ms"},
    "answers with another number": {"answers_only_in_turn", "answers_within_ms"},
}
"""Mistakes of the table `tests.mutants.planted`, and the checks that each of them fails."""
ALWAYS = {
    "writes while a chip is busy": {"no_fault", "lm629_protocol"},
    "changes the acceleration in motion": {"lm629_protocol"},
    "stays in an interrupt": {"no_fault", "main_loop_alive"},
    "pushes for ever": {"no_fault", "stack_clear"},
}


def verdicts(image):
    """After a run in which the host says all kinds of things and then falls silent."""
    world, checks = silent_world(ALL, image)
    damaged = bytearray(encode(team(7, 4000, 3000), 3))
    damaged[14] ^= 0x10  # of the robot's left velocity
    begin = [team(seq, 100 * seq, 5000 + seq, ask=True) for seq in range(1, 6)]
    odd = [team(6, 16000, 32767), team(6, 5000, 5000), bytes(damaged), bytes(range(40))]
    end = [team(8, 3000, -7000), team(9, -3000, 200), team(10, 40, -40, ask=True)]
    send(world, [*begin, *odd, *end])
    return finish(world, checks)


def test_the_shipped_firmware_passes_all_checks_of_firmware():
    found = verdicts(None)
    assert {name: verdict for name, verdict in found.items() if verdict != "passed"} == {}
    assert len(found) == 15


@needs_sdcc
@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_fails_the_checks_that_it_concerns(mistake):
    found = verdicts(planted(mistake))
    assert {name for name, verdict in found.items() if verdict == "failed"} == MISTAKES[mistake]


@needs_sdcc
@pytest.mark.parametrize("mistake", ALWAYS)
@pytest.mark.parametrize("stop", [False, True])
def test_what_firmware_must_not_do_fails_a_check_that_no_scenario_asks_for(mistake, stop):
    concerned = ALWAYS[mistake]
    world, checks = silent_world("", planted(mistake), stop=stop)
    send(world, [team(1, 2000, 2000), ServiceFrame(2, 1, 2, (9000,)), team(3, 2000, 2000)])
    found = finish(world, checks)
    assert {name for name, verdict in found.items() if verdict == "failed"} == concerned
    assert all(failure.fault for failure in checks.failures) == (concerned != {"lm629_protocol"})


@needs_sdcc
def test_a_robot_may_count_the_silence_from_the_start_of_a_character():
    image = built("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS - 1)")
    assert verdicts(image)["failsafe_stop_ms"] == "passed"


def verdicts_of_two_questions(image):
    """The second question, without its preamble, ends 17.7 ms after the first: the answer takes 20 ms."""
    world, checks = silent_world("answers_within_ms = true\nanswers_only_in_turn = true", image)
    world.run_for(50 * MS)
    world.inject(encode(team(1, 100, 100, ask=True), 3))
    world.inject(encode(team(4, 200, 200, ask=True), 3)[6:])
    return finish(world, checks)


def test_a_question_while_the_robot_answers_need_not_be_answered():
    found = verdicts_of_two_questions(None)
    assert (found["answers_within_ms"], found["answers_only_in_turn"]) == ("passed", "passed")


@needs_sdcc
def test_the_first_of_two_questions_must_be_answered():
    assert verdicts_of_two_questions(planted("never answers"))["answers_within_ms"] == "failed"
