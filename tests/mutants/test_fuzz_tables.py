"""The tables of docs/fuzzing.md: what a trial becomes, and that the page has each mistake as it is now."""

import msgspec
import pytest

from benchmarks.fuzz_time_tables import BEGIN, END, PAGE, render, replaced
from benchmarks.fuzz_time_trial import Trial, Wanted, measured
from benchmarks.processor_time import of_descendants
from tests import children
from tests.mutants.build import shipped
from tests.mutants.for_fuzzing import FOR_FUZZING
from tests.mutants.sdcc import needs_sdcc

NAME = "takes a ninth step"


def trial(engine, seed, found_s, checks=(), seeded=False):
    wanted = Wanted("for fuzzing", NAME, FOR_FUZZING[NAME].check, engine, seed, 60.0, "folder")
    return Trial(wanted, found_s, 70.0, checks, seeded)


def row(*trials):
    lines = [line for line in render(trials).splitlines() if line.startswith(f"| {NAME} ")]
    return [cell.strip() for cell in lines[0].split("|")[4:-1]]


def test_a_cell_has_one_number_a_seed_in_their_order():
    check = (FOR_FUZZING[NAME].check,)
    assert row(trial("afl", 2, None), trial("afl", 1, 3.14, check), trial("hypothesis", 1, 5.0, check)) == [
        "3.1 >60",
        "5.0",
    ]


def test_a_find_by_another_check_is_marked():
    found = (trial("afl", 1, 3.0, ("no_fault",)),)
    assert row(*found) == ["3.0*"]
    assert "* is not by the check that the mistake names" in render(found)


def test_what_a_seed_shows_is_said_once():
    check = (FOR_FUZZING[NAME].check,)
    assert row(*(trial("afl", seed, 0.0, check, seeded=True) for seed in (1, 2, 3))) == ["0.0 (a seed)"]


def test_a_find_answers_for_any_limit_and_none_for_shorter_ones_of_the_same_image():
    found, none = trial("afl", 1, 3.0), trial("afl", 1, None)
    longer, shorter = (msgspec.structs.replace(none.wanted, limit_s=limit_s) for limit_s in (90.0, 30.0))
    assert (found.answers(longer), none.answers(longer), none.answers(shorter)) == (True, False, True)
    assert not found.answers(msgspec.structs.replace(none.wanted, image="other"))


def test_firmware_that_does_not_come_up_is_told_with_what_was_said_of_it():
    wanted = Wanted("planted", "pushes for ever", "", "afl", 1, 15.0, "folder")
    table = render([Trial(wanted, 0.0, 0.0, refused="it comes up with a fault")])
    assert "| pushes for ever | not fuzzed | it comes up with a fault |" in table


def test_what_was_found_is_counted_seed_by_seed():
    table = render([trial("afl", 1, None), trial("afl", 2, 3.0), trial("afl", 3, 4.0)])
    assert "| found |  |  | 0 1 1 of 1 |" in table
    other = msgspec.structs.replace(trial("afl", 1, 3.0).wanted, mistake="waits for standstill")
    table = render([trial("afl", 1, 3.0), trial("afl", 2, None), Trial(other, None, 70.0)])
    assert "| found |  |  | 1 of 2, 0 of 1 |" in table


def test_planted_mistakes_stand_beside_each_other_by_engine():
    def planted(engine, seed, found_s):
        checks = ("no_fault",) if found_s else ()
        return Trial(
            Wanted("planted", "swaps the wheels", "", engine, seed, 20.0, "folder"), found_s, 1.0, checks
        )

    wanted = Wanted("planted", "pushes for ever", "", "afl", 1, 20.0, "folder")
    refused = Trial(wanted, 0.0, 0.0, refused="it comes up with a fault")
    table = render([planted("afl", 1, 1.0), planted("afl", 2, None), planted("hypothesis", 1, None), refused])
    assert "| planted mistake | AFL++ | Hypothesis | checks that failed |" in table
    assert "| swaps the wheels | 1.0 >20 | >20 | `no_fault` |" in table
    assert "| found | 1 0 of 1 | 0 of 1 |  |" in table


def test_another_part_is_put_between_the_marks():
    assert replaced(f"a\n{BEGIN}old\n{END}b\n", "new\n") == f"a\n{BEGIN}new\n{END}b\n"


def test_the_page_has_every_mistake_with_what_it_needs_and_its_check():
    page = PAGE.read_text("utf-8")
    for one in FOR_FUZZING.values():
        assert f"| {one.name} | {one.needs} | `{one.check}` |" in page


def test_the_processor_time_of_a_child_is_counted_while_it_lives():
    before_s = of_descendants()
    with children.start(["python3", "-c", "while True: pass"]) as busy:
        while of_descendants() <= before_s:
            assert busy.poll() is None
        busy.kill()


@pytest.mark.slow
@needs_sdcc
def test_a_trial_of_firmware_without_a_mistake_finds_nothing_until_its_time_is_over():
    trial = measured(Wanted("none", "none", "", "hypothesis", 1, 1.0, shipped().image.parent.name))
    assert (trial.found_s, trial.checks, trial.unconfirmed) == (None, (), 0)
    assert trial.executions > 0
