"""Each mistake for fuzzing fails the check that it names, by an input that the shipped firmware passes."""

from functools import cache

import pytest

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.lm629.options import DEFAULT_OPTIONS
from tests.mutants.build import build, shipped
from tests.mutants.draw import source_files
from tests.mutants.for_fuzzing import FOR_FUZZING
from tests.mutants.heard import INPUTS, SLOW_CHIPS, input_for, verdicts
from tests.mutants.planted import PLANTED
from tests.mutants.sdcc import needs_sdcc

SOURCES = source_files()


@cache
def image_of(name):
    found = build(FOR_FUZZING[name].applied(SOURCES))
    assert not found.error, found.error
    return load_hex(found.image)


def seen(image, name):
    busy_clocks = SLOW_CHIPS.get(name, DEFAULT_OPTIONS.busy_clocks)
    return verdicts(image, input_for(name), busy_clocks)


@needs_sdcc
@pytest.mark.parametrize("name", FOR_FUZZING)
def test_a_mistake_fails_the_check_that_it_names(name):
    assert seen(image_of(name), name)[FOR_FUZZING[name].check] == "failed"


@pytest.mark.parametrize("name", FOR_FUZZING)
def test_the_shipped_firmware_fails_no_check_by_the_same_input(name):
    found = seen(load_hex(image_path()), name)
    assert [check for check, verdict in found.items() if verdict == "failed"] == []
    assert found[FOR_FUZZING[name].check] == "passed"


@needs_sdcc
def test_every_mistake_builds_to_an_image_of_its_own():
    images = {build(one.applied(SOURCES)).image.read_bytes() for one in FOR_FUZZING.values()}
    assert len(images) == len(FOR_FUZZING)
    assert shipped().image.read_bytes() not in images


def test_no_mistake_is_written_down_in_both_tables():
    sources = {name: one.applied(SOURCES[one.file]) for name, one in PLANTED.items()}
    for name, one in FOR_FUZZING.items():
        same = [other for other, text in sources.items() if text in one.applied(SOURCES).values()]
        assert same == ([name] if name in PLANTED else [])


def test_the_table_has_at_least_a_dozen_mistakes_and_an_input_for_each():
    assert set(INPUTS) == set(FOR_FUZZING)
    assert len(FOR_FUZZING) >= 12
    assert all(one.breaks.endswith(".") and not one.needs.endswith(".") for one in FOR_FUZZING.values())


def test_a_mistake_whose_text_does_not_stand_there_once_is_refused():
    name = "takes a ninth step"
    changed = SOURCES | {"failsafe.c": ""}
    with pytest.raises(ValueError, match=rf"^{name}: failsafe\.c has 0 times "):
        FOR_FUZZING[name].applied(changed)
