"""A part of what `python -m tests.mirotwin.debug.proofs` compares with brute force."""

import shutil

import pytest

from tests.mirotwin.debug.proofs import LIBRARY, MIX, assembled, compiled, stacks, wrong_writers
from tests.mirotwin.debug.runs import SECOND, robot_run
from tests.mirotwin.debug.test_debug_command import ASM


def test_the_last_writer_is_that_of_brute_force():
    wrong, asked = wrong_writers(SECOND // 50, SECOND // 40, 40)
    assert wrong == []
    assert asked > 10


def test_stacks_of_the_robots_firmware_are_those_of_the_calls():
    shadow = stacks(robot_run(), SECOND // 10, 0.1)
    assert shadow.compared > 1000
    assert shadow.wrong == []


def test_stacks_of_a_firmware_in_assembler_are_those_of_the_calls():
    shadow = stacks(assembled(ASM), SECOND // 50, 0.1)
    assert shadow.compared > 1000
    assert shadow.wrong == []


@pytest.mark.skipif(shutil.which("sdcc") is None, reason="needs SDCC")
@pytest.mark.parametrize(
    "program", [(MIX,), (LIBRARY,), (LIBRARY, "--stack-auto")], ids=["mix", "library", "stack-auto"]
)
def test_stacks_of_a_program_of_sdcc_are_those_of_the_calls(tmp_path, program):
    shadow = stacks(compiled(tmp_path, *program), SECOND // 10, 0.1)
    assert shadow.compared > 1000
    assert shadow.wrong == []
