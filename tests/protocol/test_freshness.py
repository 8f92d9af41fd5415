"""Only news acts: repeats, long steps back and a stuck host are stale; a host that comes back is fresh."""

from hypothesis import given
from hypothesis import strategies as st

from miro_exact.state import restore, snapshot
from miro_protocol.robot_receiver import Freshness

MS = 24_000


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
