"""A question that comes while the robot still answers need not be answered; the one before it must."""

from miro_protocol.frames import encode
from tests.mirotwin.verify.checks.rig import finish, needs_sdcc, planted, silent_world, team

ANSWERS = "answers_within_ms = true\nanswers_only_in_turn = true"


def ask_twice(world):
    """The second question, without its preamble, ends 17.7 ms after the first: the answer takes 20 ms."""
    world.run_for(24_000 * 50)
    world.inject(encode(team(1, 100, 100, ask=True), 3))
    world.inject(encode(team(4, 200, 200, ask=True), 3)[6:])
    world.run_for(24_000 * 200)


def verdicts(image):
    world, checks = silent_world(ANSWERS, image)
    ask_twice(world)
    return finish(world, checks)


def test_a_question_while_the_robot_answers_need_not_be_answered():
    found = verdicts(None)
    assert (found["answers_within_ms"], found["answers_only_in_turn"]) == ("passed", "passed")


@needs_sdcc
def test_the_first_of_two_questions_must_be_answered():
    assert verdicts(planted("never answers"))["answers_within_ms"] == "failed"
