"""The tables of fuzz_time and docs/background/fuzzing.md: what a trial becomes, and each mistake as it is now."""

import csv
import io

import msgspec
import pytest

from benchmarks.fuzz_time_tables import (
    BEGIN,
    EASY,
    END,
    HARD,
    PAGE,
    hard_table,
    planted_table,
    render,
    replaced,
    rows_of,
)
from benchmarks.fuzz_time_trial import Trial, Wanted, measured
from benchmarks.processor_time import of_descendants
from tests import children
from tests.mutants.build import shipped
from tests.mutants.for_fuzzing import FOR_FUZZING
from tests.mutants.planted import PLANTED
from tests.mutants.sdcc import needs_sdcc

NAME = "takes a ninth step"


def trial(engine, seed, found_s, checks=(), seeded=False):
    wanted = Wanted("for fuzzing", NAME, FOR_FUZZING[NAME].check, engine, seed, 60.0, "folder")
    return Trial(wanted, found_s, 70.0, checks, seeded)


def row(*trials):
    (cells,) = [cells for cells in csv.reader(io.StringIO(hard_table(trials))) if cells[0] == NAME]
    return cells[3:]


def rows(text):
    return list(csv.DictReader(io.StringIO(text)))


def test_a_cell_has_one_number_a_seed_in_their_order():
    check = (FOR_FUZZING[NAME].check,)
    assert row(trial("afl", 2, None), trial("afl", 1, 3.14, check), trial("hypothesis", 1, 5.0, check)) == [
        "3.1 >60",
        "5.0",
    ]


def test_a_find_by_another_check_is_marked():
    found = (trial("afl", 1, 3.0, ("no_fault",)),)
    assert row(*found) == ["3.0*"]


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
    table = planted_table([Trial(wanted, 0.0, 0.0, refused="it comes up with a fault")])
    assert "\npushes for ever,not fuzzed,it comes up with a fault\n" in table


def test_what_was_found_is_counted_seed_by_seed():
    table = hard_table([trial("afl", 1, None), trial("afl", 2, 3.0), trial("afl", 3, 4.0)])
    assert "\nfound,,,0 1 1 of 1\n" in table
    other = msgspec.structs.replace(trial("afl", 1, 3.0).wanted, mistake="waits for standstill")
    table = hard_table([trial("afl", 1, 3.0), trial("afl", 2, None), Trial(other, None, 70.0)])
    assert '\nfound,,,"1 of 2, 0 of 1"\n' in table


def test_planted_mistakes_stand_beside_each_other_by_engine():
    def planted(engine, seed, found_s):
        checks = ("no_fault",) if found_s else ()
        return Trial(
            Wanted("planted", "swaps the wheels", "", engine, seed, 20.0, "folder"), found_s, 1.0, checks
        )

    wanted = Wanted("planted", "pushes for ever", "", "afl", 1, 20.0, "folder")
    refused = Trial(wanted, 0.0, 0.0, refused="it comes up with a fault")
    trials = [planted("afl", 1, 1.0), planted("afl", 2, None), planted("hypothesis", 1, None), refused]
    table = planted_table(trials)
    assert table.startswith("mistake,AFL++,Hypothesis,checks that failed\n")
    assert "\nswaps the wheels,1.0 >20,>20,no_fault\n" in table
    assert "\nfound,1 0 of 1,0 of 1,\n" in table
    part = render([], rows(table))
    assert (
        "The 2 planted mistakes: AFL++ found 1 0 of 1, Hypothesis found 0 of 1; 1 come up with a fault"
        in part
    )
    assert "Never found" not in part
    assert "Never found: swaps the wheels.\n" in render([], rows(planted_table(trials[1:])))


def test_the_page_shows_the_rare_mistakes_that_some_seed_missed_alone():
    missed = [trial("afl", 1, 3.0), trial("afl", 2, None)]
    needs = FOR_FUZZING[NAME].needs
    assert f"* {NAME} (needs {needs}): AFL++ 3.0* >60\n" in render(rows(hard_table(missed)), [])
    assert NAME not in render(rows(hard_table(missed[:1])), [])
    assert render(rows(hard_table([])), rows(planted_table([]))) == ""


def test_another_part_is_put_between_the_marks():
    assert replaced(f"a\n{BEGIN}old\n{END}b\n", "new\n") == f"a\n{BEGIN}new\n{END}b\n"


def test_the_tables_have_every_mistake_with_what_it_needs_and_its_check():
    hard, planted = rows_of(HARD), rows_of(EASY)
    assert [(row["mistake"], row["needs"], row["check"]) for row in hard[:-1]] == [
        (one.name, one.needs, one.check) for one in FOR_FUZZING.values()
    ]
    assert [row["mistake"] for row in planted] == [*PLANTED, "found"]


def test_the_page_says_what_the_tables_have():
    before, rest = PAGE.read_text("utf-8").split(BEGIN)
    part = rest.split(END)[0]
    assert "`*` found by another check than the mistake names" in before
    assert part == render(rows_of(HARD), rows_of(EASY))


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
