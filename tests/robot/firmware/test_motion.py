"""From a team frame on the air to the trajectories in both LM629."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.robot.firmware.rig import MS, SAMPLE, Rig

STT, LTRJ = 0x01, 0x1F
VELOCITIES = st.integers(-32767, 32767)


@pytest.fixture
def rig():
    return Rig()


def register(velocity):
    return f"{min(abs(velocity), 16633) << 8:08x}"


def expected(velocity):
    control = "0808" if velocity < 0 else "1808"
    return [(LTRJ, bytes.fromhex(control + register(velocity))), (STT, b"")]


def test_a_team_frame_sets_velocity_mode_in_both_chips(rig):
    rig.team(7, 4000, -2500)
    left, right = rig.told(rig.board.left), rig.told(rig.board.right)
    assert [(command.opcode, command.data) for command in left] == expected(4000)
    assert [(command.opcode, command.data) for command in right] == expected(-2500)
    assert rig.counters == (1, 0, 0)
    assert (rig.u8("_last_hdr"), rig.i16("_last_left"), rig.i16("_last_right")) == (7, 4000, -2500)


def test_both_wheels_start_in_the_same_sample(rig):
    last = rig.team(1, 1000, 1000)
    left, right = rig.told(rig.board.left)[-1], rig.told(rig.board.right)[-1]
    assert left.opcode == right.opcode == STT
    assert left.tick == right.tick
    assert rig.board.left.sample_tick == rig.board.right.sample_tick
    assert left.tick < last + 4 * MS


def test_the_trajectory_begins_within_two_and_a_half_milliseconds_of_the_last_character(rig):
    last = rig.team(1, 1000, 1000)
    stop_bit = last + 9 * 2500
    assert rig.told(rig.board.left)[-1].tick + SAMPLE - stop_bit < 2.5 * MS


def test_the_desired_velocity_reaches_the_command_with_the_default_acceleration(rig):
    rig.team(0, 4000, -4000)
    start = rig.told(rig.board.left)[-1].tick
    samples = -(-(4000 << 8) // 5973)
    rig.run_to(start + (samples + 1) * SAMPLE)
    assert rig.board.left.desired_velocity == 4000 << 8
    assert rig.board.right.desired_velocity == -(4000 << 8)


def test_zero_is_a_velocity_and_not_a_stop(rig):
    rig.team(0, 500, 0)
    assert [(c.opcode, c.data) for c in rig.told(rig.board.right)] == expected(0)
    assert not rig.board.right.status & 0x80  # the loop is closed


@pytest.mark.parametrize(("sent", "used"), [(16633, 16633), (16634, 16633), (32767, 16633), (-16634, -16633)])
def test_velocities_saturate_at_the_top_speed(rig, sent, used):
    rig.team(0, sent, -sent)
    assert (rig.i16("_last_left"), rig.i16("_last_right")) == (used, -used)
    assert [(c.opcode, c.data) for c in rig.told(rig.board.left)] == expected(used)


@settings(max_examples=8)
@given(
    st.lists(st.tuples(VELOCITIES, VELOCITIES), min_size=1, max_size=4),
    st.sampled_from([(0, 3), (2, 3), (4, 5)]),
)
def test_any_velocities_reach_the_registers_of_any_slot(pairs, place):
    slot, n = place
    rig = Rig(slot=slot, n=n)
    for seq, (left, right) in enumerate(pairs):
        rig.team(seq, left, right, slot=slot)
        assert [(c.opcode, c.data) for c in rig.told(rig.board.left)] == expected(left)
        assert [(c.opcode, c.data) for c in rig.told(rig.board.right)] == expected(right)


def test_other_slots_velocities_are_not_its_own():
    rig = Rig(slot=1, n=5)
    rig.team(0, 3000, 3000, slot=3)
    assert (rig.i16("_last_left"), rig.i16("_last_right")) == (0, 0)
    assert rig.counters == (1, 0, 0)


def test_a_slot_beyond_the_network_listens_and_never_moves():
    rig = Rig(slot=4, n=3)
    rig.team(0, 3000, 3000, slot=1)
    rig.team(1, 3000, 3000, ask=True, slot=1)
    assert rig.counters == (2, 0, 0)
    assert rig.told(rig.board.left) == rig.told(rig.board.right) == []
    assert rig.sent() == []
