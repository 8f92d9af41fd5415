"""The comparison of answers, beside the slow one of `tests.naive.port_answers`."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol.frames import TeamFrame, TelemetryFrame, encode
from miro_protocol.transmission import DOWN, UP, Transmission, character_ticks
from miro_sim.periods import Period
from mirotwin.desk.compare import ANSWERS, _Sent, compare
from tests.naive import port_answers

MS = 24_000
ANSWER_TICKS = 19 * character_ticks(UP)
question = st.fixed_dictionaries(
    {
        "gap_ms": st.sampled_from([34, 34, 34, 34, 34, 108, 111, 130, 150, 152, 300, 499, 510]),
        "words": st.tuples(st.integers(-4000, 4000), st.integers(-4000, 4000)),
        "late_us": st.sampled_from([0, 0, 40, 900, 5000, 15_000, 21_000, 30_000]),
        "lost": st.sampled_from(["", "", "", "", "port", "twin"]),
        "went": st.tuples(st.integers(-900, 900), st.integers(-900, 900)),
        "apart": st.tuples(st.integers(-400, 400), st.sampled_from([0, 0, 60, -200])),
        "counted": st.sampled_from([0, 0, 0, 1]),
        "flags": st.sampled_from([0, 0, 8, 24]),
        "other_flags": st.sampled_from([0, 0, 0, 16]),
        "status": st.sampled_from([0, 0, 0x80, 0x20]),
    }
)


def run(transmissions, end_tick=0):
    wire = tuple(sorted(transmissions, key=lambda one: one.tick))
    return [Period(0, 0, (), wire, ""), Period(1, end_tick, (), (), "")]


@given(
    st.lists(question, min_size=4, max_size=12),
    st.integers(0, 60_000),
    st.integers(0, 65535),
    st.integers(0, 255),
    st.integers(0, 200),
)
def test_the_comparison_finds_what_the_slow_one_finds(questions, way_us, offset, count, after_ms):
    tick, sent, port, twin = 1_000_000, [], [], []
    mine = theirs = (0, 0)
    accepted = 0
    for number, one in enumerate(questions):
        tick += one["gap_ms"] * MS
        frame = TeamFrame(3, number * 3 % 64, (one["words"], (0, 0), (0, 0)))
        sent.append(Transmission(tick, DOWN, encode(frame, 3)))
        theirs = tuple(at + by for at, by in zip(theirs, one["went"], strict=True))
        mine = tuple(at + by + more for at, by, more in zip(mine, one["went"], one["apart"], strict=True))
        accepted += one["counted"]
        twins = TelemetryFrame(frame.seq, 0, one["flags"], 0, 0, *(at % 65536 for at in theirs), number % 256)
        said = TelemetryFrame(
            *(frame.seq, 0, one["flags"] ^ one["other_flags"], one["status"], 0),
            *((at + offset) % 65536 for at in mine),
            (number + accepted + count) % 256,
        )
        end = sent[-1].end_tick + 25 * MS
        if one["lost"] != "twin":
            twin.append((end, twins))
        if one["lost"] != "port":
            port.append((end + (way_us + one["late_us"]) * 24, said))
    heard = [
        [Transmission(at - ANSWER_TICKS, UP, encode(said, 3)) for at, said in side] for side in (port, twin)
    ]
    lost_tick = sent[-1].end_tick + after_ms * MS
    found = compare(run([*sent, *heard[0]], lost_tick), run([*sent, *heard[1]]), 3)
    frames = [(one.end_tick, asked["words"]) for one, asked in zip(sent, questions, strict=True)]
    wanted = port_answers.compared(port, twin, frames, lost_tick, ANSWERS.within_counts, ANSWERS.within_ticks)
    if port:
        assert (sorted((one.tick, one.channel) for one in found.differences), found.not_judged) == (
            sorted(wanted[0]),
            wanted[1],
        )
    else:
        assert (found.differences, found.silent) == ([], (0,) if twin else ())


@given(
    st.lists(
        st.tuples(st.sampled_from([34, 34, 109, 112, 300]), st.integers(-9, 9)), min_size=3, max_size=12
    ),
    st.integers(0, 900),
)
def test_what_the_velocity_rises_by_is_what_the_slow_one_says(frames, length_ms):
    tick, sent, told = 1_000_000, [], []
    for number, (gap_ms, word) in enumerate(frames):
        tick += gap_ms * MS
        data = encode(TeamFrame(0, number, ((0, word), (0, 0), (0, 0))), 3)
        sent.append(Transmission(tick, DOWN, data))
        told.append((sent[-1].end_tick, (0, word)))
    window = (tick - length_ms * MS, tick)
    found = _Sent(run(sent), 3).rise(0, 1, *window)
    assert found == port_answers.off_by(told, *window, 1, 8192 * 256)


@pytest.mark.parametrize("late", range(3, 12))
def test_an_answer_that_is_late_excuses_what_differs_up_to_two_answers_away(late):
    sent, heard = [], ([], [])
    for number in range(15):
        frame = TeamFrame(3, number * 3, ((2000, 2000), (0, 0), (0, 0)))
        sent.append(Transmission(1_000_000 + number * 100 * MS, DOWN, encode(frame, 3)))
        for side, more in enumerate((100, 0)):
            said = TelemetryFrame(frame.seq, 0, 0, 0, 0, more if number >= 7 else 0, 0, 0)
            came = sent[-1].end_tick + 25 * MS + (10 * MS if number == late and not side else 0)
            heard[side].append(Transmission(came - ANSWER_TICKS, UP, encode(said, 3)))
    found = compare(run([*sent, *heard[0]], came + 30 * MS), run([*sent, *heard[1]]), 3)
    assert (found.differences == []) == (late in (4, 5, 6, 7, 8, 9))  # answers 6 and 7 are compared


QUESTIONS = 16
LATE = 6 * MS
"""By which all answers but the first come late."""


def position(frames, tick):
    """Of a wheel that takes each velocity at once, and stops 110 ms after a frame if no other comes."""
    there = 0
    for (came, word), (until, _) in pairwise([*frames, (tick, 0)]):
        there += word * max(0, min(until, tick, came + 110 * MS) - came)
    return there // (8192 * 256)


@given(
    st.lists(st.sampled_from([34, 34, 34, 200]), min_size=QUESTIONS, max_size=QUESTIONS),
    st.lists(st.sampled_from([-8000, 8000, 1000]), min_size=QUESTIONS, max_size=QUESTIONS),
    st.lists(st.sampled_from([0, LATE]), min_size=QUESTIONS, max_size=QUESTIONS),
)
def test_what_late_frames_do_to_positions_is_no_difference(gaps_ms, words, late):
    words[0], tick, sent, heard = 0, 1_000_000, [], ([], [])
    for number, gap_ms in enumerate(gaps_ms):
        tick += gap_ms * MS
        frame = TeamFrame(3, 3 + number, ((words[number], 0), (0, 0), (0, 0)))
        sent.append(Transmission(tick, DOWN, encode(frame, 3)))
        if number % 3 == 0:
            for side, delays in enumerate((late[: number + 1], [0] * QUESTIONS)):
                frames = [
                    (one.end_tick + by, word) for one, by, word in zip(sent, delays, words, strict=False)
                ]
                at = position(frames, sent[-1].end_tick + MS + delays[number]) % 65536
                came = sent[-1].end_tick + 25 * MS + (LATE if number and not side else 0)
                said = encode(TelemetryFrame(frame.seq, 0, 0, 0, 0, at, 0, 0), 3)
                heard[side].append(Transmission(came - ANSWER_TICKS, UP, said))
    found = compare(run([*sent, *heard[0]], came + 30 * MS), run([*sent, *heard[1]]), 3)
    assert found.differences == []
