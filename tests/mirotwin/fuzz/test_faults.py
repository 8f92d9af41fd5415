"""Inputs in which hardware breaks: the same again, and what they find a world confirms."""

import random

import pytest

from miro_protocol import stream
from miro_protocol.actions import FAULTS, Fault, fault_text
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import FAULT_WAYS, OF_BROKEN, fault_of, robot_target
from mirotwin.runs.run import Run, robot_spec


def inputs(count):
    draw = random.Random(1)
    return [bytes(draw.randrange(256) for _ in range(60)) for _ in range(count)]


def test_each_put_of_a_program_is_a_fault():
    for which in range(len(FAULT_WAYS)):
        for value in (0, 1, 2, 0x7FFF, 0xFFFF):
            assert fault_text(fault_of(which, value)) == fault_of(which, value)


def test_faults_are_actions_of_the_script_which_a_stream_file_holds():
    target = robot_target(TargetSpec(faults=True))
    scripts = [target.script(data) for data in inputs(20)]
    assert any(isinstance(item, Fault) for script in scripts for item in script)
    for script in scripts:
        assert [entry.what for entry in stream.parse(stream.format_stream(script)).entries] == script
    plain = robot_target(TargetSpec())
    assert not any(isinstance(item, Fault) for data in inputs(20) for item in plain.script(data))


@pytest.mark.slow
def test_what_is_found_is_found_again_and_a_world_confirms_firmware_faults():
    target, found, confirmed = robot_target(TargetSpec(faults=True)), 0, 0
    for data in inputs(3000):
        code = target.run(data)
        assert target.run(data) == code
        failure = target.failure
        if failure is not None and failure.check == "no_fault":
            found += 1
            spec = robot_spec(
                target.image, 3, 0, target.script(data), {"no_fault": True}, failure.tick + 24_000
            )
            confirmed += any(one.check == "no_fault" for one in Run(spec).play().failures)
        assert failure is None or failure.check in (*OF_BROKEN, "never_sleeps")
    assert found
    assert {word.split()[0] for word in FAULT_WAYS} == FAULTS.keys() - {"encoder", "rxd"}
    assert confirmed >= found // 2, (found, confirmed)
