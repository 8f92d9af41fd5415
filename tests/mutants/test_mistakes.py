"""Mistakes made by hand: each applies, is no other one, breaks the rules or fails the check that it is named with."""

import re

import pytest

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.lm629.options import DEFAULT_OPTIONS
from tests.mutants.build import build
from tests.mutants.document import rows_of
from tests.mutants.draw import source_files
from tests.mutants.for_fuzzing import FOR_FUZZING
from tests.mutants.heard import INPUTS, SLOW_CHIPS, input_for, verdicts
from tests.mutants.planted import PLANTED, Planted
from tests.mutants.score import judged
from tests.mutants.sdcc import needs_sdcc

SOURCES = source_files()
CHANGED = {name: {one.file: one.applied(SOURCES[one.file])} for name, one in PLANTED.items()}
CHANGED |= {name: one.applied(SOURCES) for name, one in FOR_FUZZING.items()}


def image_of(name):
    built = build(CHANGED[name])
    assert not built.error, built.error
    return built.image


def test_each_mistake_says_what_it_breaks_in_a_line():
    for one in (*PLANTED.values(), *FOR_FUZZING.values()):
        assert re.fullmatch(r".+\.", one.breaks), one.name


@pytest.mark.parametrize("text", ["", "x; x;"])
def test_a_text_that_does_not_stand_there_once_is_refused(text):
    with pytest.raises(ValueError, match=r"^late: a\.c has [02] times 'x;', wanted once$"):
        Planted("late", "a.c", "x;", "y;", "").applied(text)


def test_no_two_mistakes_are_one_and_what_stands_in_both_tables_is_one():
    assert len({str(sorted(changed.items())) for changed in CHANGED.values()}) == len(CHANGED)
    for name in PLANTED.keys() & FOR_FUZZING.keys():
        assert FOR_FUZZING[name].changes == (PLANTED[name][1:4],)


@needs_sdcc
def test_every_mistake_builds_to_an_image_of_its_own():
    images = {image_of(name).read_bytes() for name in CHANGED}
    assert len(images | {image_path().read_bytes()}) == len(CHANGED) + 1


@needs_sdcc
@pytest.mark.parametrize("name", PLANTED)
def test_a_mistake_breaks_the_first_rule_that_the_table_names(name):
    (row,) = [row for row in rows_of("planted.csv") if row["planted mistake"] == name]
    assert row["what it does"] == PLANTED[name].breaks
    by = row["killed by"]
    rule = "P01" if by == "all rules" else by.split()[0]
    assert judged(image_of(name), (rule,))[0] == (rule,)


def seen(image, name):
    busy_clocks = SLOW_CHIPS.get(name, DEFAULT_OPTIONS.busy_clocks)
    return verdicts(load_hex(image), input_for(name), busy_clocks)


@needs_sdcc
@pytest.mark.parametrize("name", FOR_FUZZING)
def test_a_mistake_fails_the_check_that_it_names(name):
    assert seen(image_of(name), name)[FOR_FUZZING[name].check] == "failed"


@pytest.mark.parametrize("name", FOR_FUZZING)
def test_the_shipped_firmware_fails_no_check_by_the_same_input(name):
    found = seen(image_path(), name)
    assert [check for check, verdict in found.items() if verdict == "failed"] == []
    assert found[FOR_FUZZING[name].check] == "passed"


def test_there_is_an_input_for_each_mistake_for_fuzzing_and_its_needs_are_no_sentence():
    assert set(INPUTS) == set(FOR_FUZZING)
    assert not any(one.needs.endswith(".") for one in FOR_FUZZING.values())
