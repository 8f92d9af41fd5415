"""What inputs reach, and the path that tells crashes apart."""

from mirotwin.fuzz.input_coverage import InputCoverage
from mirotwin.fuzz.inputs import input_of, seeds, sent, talks
from mirotwin.fuzz.target import target_for
from tests.mirotwin.verify.checks.rig import own_image


def made():
    image = own_image()
    return InputCoverage(image, lambda: target_for(image))


def of_talk(number):
    return input_of("session", sent(talks(3, 0)[number], 3), 3)


def test_what_runs_while_the_firmware_starts_counts_in_the_total():
    reached = made()
    assert reached.names.functions
    names = reached.functions_of(reached.total)
    assert "_main" in names
    before = set(reached.total)
    reached.run(of_talk(0))
    assert before < set(reached.total)


def test_the_counts_of_an_input_do_not_depend_on_the_inputs_before():
    reached = made()
    alone = reached.run(of_talk(0))
    for data in seeds("session", 3, 0):
        reached.run(data)
    assert reached.run(of_talk(0)) == alone


def test_the_counters_see_what_the_fast_run_does():
    reached = made()
    fast = target_for(own_image())
    for data in seeds("session", 3, 0):
        reached.run(data)
        fast.run(data)
        both = [[cpu.peek_iram(at) for at in range(256)] for cpu in (fast.cpu, reached.target.cpu)]
        assert both[0] == both[1]
        assert fast.cpu.cycles == reached.target.cpu.cycles


def test_another_number_of_frames_takes_the_same_path_and_other_frames_another_one():
    reached = made()
    one, two = of_talk(0), of_talk(0) + of_talk(0)
    assert reached.path(reached.run(one)) == reached.path(reached.run(two))
    assert reached.path(reached.run(one)) != reached.path(reached.run(of_talk(5)))
