"""Which frames are fresh, and the rules by which robots are judged, beside their slow twins on histories of chance."""

from hypothesis import example, given
from hypothesis import strategies as st

from miro_protocol.robot_receiver import Freshness
from miro_protocol.robot_rules import TO_TI_TICKS, AnswerRule, DrivingRule, OriginRule, SilenceRule
from tests.naive import robot_rules as naive
from tests.states import restore, snapshot

MS = 24_000
TICKS = st.integers(0, 40).map(lambda half: half * MS // 2)
NEAR = st.integers(-5, 5)


@given(
    st.integers(0, 200).map(lambda ms: ms * MS),
    st.integers(11, 60).map(lambda ms: ms * MS),
    st.integers(0, 70).map(lambda half: half * MS // 2),
    st.lists(st.tuples(st.integers(-8, 8), NEAR).map(lambda one: one[0] * MS // 2 + one[1])),
)
def test_silence_is_over_at_its_deadline_and_early_before_its_window(last_tick, after, tolerance, around):
    rule = SilenceRule(after, tolerance)
    assert not rule.is_over(last_tick + 1000 * MS)
    rule.last_tick = last_tick
    due = rule.end_tick() + after
    received = sorted(due + offset for offset in around)
    for tick in received:
        rule.received(tick)
    deadline = naive.silence_deadline(last_tick, after, tolerance, received)
    assert rule.deadline() == deadline
    assert [rule.is_over(deadline + more) for more in (-1, 0, 1)] == [False, False, True]
    for tick in (*received, rule.earliest_tick() - 1, rule.earliest_tick()):
        assert rule.is_early(tick) == naive.silence_is_early(last_tick, after, tolerance, tick)
    rule.last_tick = -1
    assert not rule.is_over(deadline + 1)


EVENTS = st.lists(st.tuples(st.booleans(), st.integers(1, 30), st.sampled_from([(0, 0), (1, 2), (2, 1)])))


@given(EVENTS, st.integers(1, 50))
def test_frames_that_are_not_obeyed_in_time_are_missed(events, within):
    rule = DrivingRule(within)
    frames, orders, missed = [], [], []
    now = 0
    for is_frame, step, words in events:
        now += step
        while (found := rule.missed(now)) is not None:
            missed.append(naive.Said(found[0] - within, found[1:]))
        (frames if is_frame else orders).append(naive.Said(now, words))
        if is_frame:
            rule.fresh_tick = now
            rule.team(now, *words)
        else:
            rule.told(*words)
        assert rule.may_move(now) == any(now - frame.tick <= within for frame in frames)
    while (found := rule.missed(now + 1)) is not None:
        missed.append(naive.Said(found[0] - within, found[1:]))
    assert missed == naive.missed(frames, orders, within, now + 1)


@given(EVENTS, st.integers(1, 60))
def test_velocities_come_from_a_frame_of_late(events, within):
    rule = OriginRule(within)
    frames, now = [], 0
    for is_frame, step, words in events:
        now += step
        if is_frame:
            frames.append(naive.Said(now, words))
            rule.team(now, *words)
        else:
            assert rule.allows(now, *words) == naive.is_sent(frames, now, words, within)


KINDS = st.sampled_from(["asked", "answer", "character", "character", "look"])


@given(st.lists(st.tuples(KINDS, st.integers(1, 30 * MS), st.integers(0, 3)), max_size=60))
def test_answers_are_in_turn_and_in_time(drawn):
    rule, within = AnswerRule(), 30 * MS
    events, found, now = [], [], 0
    for kind, step, seq in drawn:
        now += step
        events.append((kind, now, seq))
        if kind == "character" and not rule.character():
            found.append(("unasked", now))
        if kind == "answer" and not rule.in_turn(seq):
            found.append(("wrong", now))
        deadline = rule.missed(now)
        if deadline >= 0:
            found.append(("missing", deadline))
        if kind == "answer" and rule.late(now, seq):
            found.append(("late", now))
        if kind == "asked":
            rule.question(now, seq)
    assert found == naive.answer_fails(events, within, TO_TI_TICKS)


def after_first(seq):
    fresh = Freshness()
    assert fresh.judge(seq, 0)
    return fresh


def test_the_first_frame_is_fresh_whatever_its_number():
    assert all(Freshness().judge(seq, 0) for seq in range(64))


def test_steps_of_one_to_eight_are_fresh_and_all_others_stale():
    for last in range(64):
        assert [step for step in range(64) if after_first(last).judge((last + step) % 64, 149 * MS)] == [
            *range(1, 9)
        ]


def test_from_150_ms_on_any_step_but_none_is_fresh():
    for step in range(64):
        assert after_first(40).judge((40 + step) % 64, 150 * MS) == (step != 0)
        assert after_first(40).judge((40 + step) % 64, 150 * MS - 1) == (1 <= step <= 8)


def test_a_stuck_host_never_becomes_fresh_again():
    fresh = after_first(3)
    assert not any(fresh.judge(3, k * 800_800) for k in range(1, 1000))
    assert (fresh.accepted, fresh.stale) == (1, 999)


def test_stale_frames_neither_move_the_window_nor_restart_the_clock():
    fresh = after_first(0)
    assert not fresh.judge(20, 10 * MS)
    assert not fresh.judge(21, 149 * MS)
    assert fresh.judge(1, 149 * MS)
    fresh = after_first(0)
    assert not fresh.judge(20, 149 * MS)
    assert fresh.judge(20, 150 * MS)


@given(st.lists(st.tuples(st.integers(0, 63), st.integers(0, 200 * MS))), st.integers(0, 50))
@example(frames=[(0, 0)], place=0)  # of one that has judged none
def test_a_restored_snapshot_judges_the_rest_alike(frames, place):
    fresh, other, tick, verdicts = Freshness(), Freshness(), 0, []
    for number, (seq, pause) in enumerate(frames):
        tick += pause
        if number == place:
            restore(other, snapshot(fresh))
        verdict = fresh.judge(seq, tick)
        verdicts.append(verdict)
        if number >= place:
            assert other.judge(seq, tick) == verdict
    assert fresh.accepted == sum(verdicts)
    assert fresh.accepted + fresh.stale == len(frames)
