"""Frames that are sealed in usual wrong ways, and what is told of a robot by them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol.frames import seal
from miro_protocol.table import DOWNLINK, TELEMETRY
from mirotwin.verify.checks.orders import Order
from mirotwin.verify.conform.hints import wheels_instead
from mirotwin.verify.conform.sealing import MISTAKES, Sealing, mistake_in
from mirotwin.verify.conform.trial_script import Frame

FORMATS = (*DOWNLINK.values(), TELEMETRY)
ENDS = st.integers(-16633, 16633)
PAIRS = st.tuples(ENDS, ENDS)


def bodies(form):
    return st.binary(min_size=form.body_size, max_size=form.body_size)


@given(st.data())
def test_without_a_mistake_a_frame_is_sealed_as_the_protocol_seals_it(data):
    form = data.draw(st.sampled_from(FORMATS))
    body = data.draw(bodies(form))
    assert Sealing().seal(form, body) == seal(form, body)


@given(st.data())
def test_a_sealing_opens_what_it_sealed(data):
    form = data.draw(st.sampled_from(FORMATS))
    body = data.draw(bodies(form))
    sealing = data.draw(st.sampled_from([one for one in MISTAKES.values() if one.sync == form.sync]))
    assert sealing.opened(form, sealing.seal(form, body)[len(form.lead) :]) == body


@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_no_two_mistakes_make_the_same_frame_and_only_the_right_layout_byte_makes_the_right_one(form):
    body = bytes(range(1, form.body_size + 1))
    made = {what: sealing.seal(form, body) for what, sealing in MISTAKES.items()}
    assert len(set(made.values())) == len(made)
    right = [what for what, sealed in made.items() if sealed == seal(form, body)]
    assert right == [f"a CRC that begins with layout byte {form.layout:02X}h"]


@given(st.data())
def test_the_mistake_in_an_answer_is_found_by_its_characters_alone(data):
    what = data.draw(st.sampled_from([one for one in MISTAKES if MISTAKES[one].sync == TELEMETRY.sync]))
    body = bytes([0x96]) + data.draw(bodies(TELEMETRY))[1:]
    characters = MISTAKES[what].seal(TELEMETRY, body)[len(TELEMETRY.lead) :]
    found = mistake_in(TELEMETRY, characters, 0x96)
    assert found
    assert (
        MISTAKES[found].seal(TELEMETRY, MISTAKES[found].opened(TELEMETRY, characters) or b"")[5:]
        == characters
    )


def told(pair):
    return [Order(0, side, "drive", word << 8) for side, word in zip(("left", "right"), pair, strict=True)]


def frame(*words):
    return Frame(0, 0, 0, 1, words, "team frame")


@given(st.lists(PAIRS, min_size=3, max_size=3), st.integers(0, 2))
def test_nothing_is_said_of_wheels_that_do_as_told(words, slot):
    assert wheels_instead(told(words[slot]), frame(*words), slot) == ""


def test_nothing_is_said_of_velocities_at_the_limit_where_one_mistake_looks_like_another():
    assert wheels_instead(told((16632, -16633)), frame((16633, -16633)), 0) == ""


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ((-978, 983), "the signs of both are turned over"),
        ((978, 983), "the right one goes the wrong way"),
        ((-983, 978), "left and right are exchanged"),
        ((-11773, 10748), "the bytes of each are exchanged: the low one comes first"),
        ((-1279, 1284), "these are the velocities of robot 2"),
        ((3912, -3932), "4 times as fast"),
        ((489, -492), "2 times as slow"),
        ((1, 2), ""),
    ],
)
def test_one_mistake_that_explains_both_wheels_is_named(found, said):
    assert wheels_instead(told(found), frame((-677, 682), (978, -983), (-1279, 1284)), 1) == said
