"""From a team frame on the air to the trajectories in both LM629, and to wheels on the real drive that follow them."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from miro_sim.plant.drive import DifferentialDrive
from miro_sim.plant.params import DriveParams
from tests.robot.firmware.rig import MS, SAMPLE, Rig

STT, LTRJ = 0x01, 0x1F
VELOCITIES = st.integers(-32767, 32767)


@pytest.fixture
def rig():
    return Rig()


def cut_off(velocity):
    return max(-16633, min(velocity, 16633))


def expected(velocity):
    control = "0808" if velocity < 0 else "1808"
    return [(LTRJ, bytes.fromhex(f"{control}{abs(cut_off(velocity)) << 8:08x}")), (STT, b"")]


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


@settings(max_examples=8)
@given(
    st.lists(st.tuples(VELOCITIES, VELOCITIES), min_size=1, max_size=4),
    st.sampled_from([(0, 3), (2, 3), (4, 5)]),
)
@example([(16633, -16633), (16634, -16634)], (0, 3))
def test_any_velocities_reach_the_registers_of_any_slot_up_to_the_top_speed(pairs, place):
    slot, n = place
    rig = Rig(slot=slot, n=n)
    for seq, (left, right) in enumerate(pairs):
        rig.team(seq, left, right, slot=slot)
        assert [(c.opcode, c.data) for c in rig.told(rig.board.left)] == expected(left)
        assert [(c.opcode, c.data) for c in rig.told(rig.board.right)] == expected(right)
        assert (rig.i16("_last_left"), rig.i16("_last_right")) == (cut_off(left), cut_off(right))


def test_other_slots_velocities_are_not_its_own():
    rig = Rig(slot=1, n=5)
    rig.team(0, 3000, 3000, slot=3)
    assert (rig.i16("_last_left"), rig.i16("_last_right")) == (0, 0)
    assert rig.counters == (1, 0, 0)


def follow(rig, left_units, right_units, samples):
    """(position error left, right) at every LM629 sample, while frames keep the failsafe away."""
    errors = []
    for sample in range(samples):
        if sample % 150 == 0:
            rig.team(sample // 150 % 64, left_units, right_units)
        rig.run_to(rig.board.left.sample_tick)
        left, right = rig.board.left, rig.board.right
        errors.append(
            (left.desired_position - left.real_position, right.desired_position - right.real_position)
        )
    return errors


@pytest.mark.parametrize(
    ("left", "right"), [(2279, 2279), (11393, 11393), (-11393, -11393), (5696, -5696), (1139, 570)]
)
def test_the_wheels_follow_a_ramp_closely_and_settle(left, right):
    """Closely: 0.5 mm (65 counts). Settled: within 4 counts (30 um) of a steady error below 20."""
    rig = Rig(plant=DifferentialDrive(DriveParams()))
    ramp_samples = abs(left) * 256 // 5973 + 100
    errors = follow(rig, left, right, ramp_samples + 100)
    ramp, steady = errors[:ramp_samples], errors[ramp_samples:]
    assert max(abs(error) for pair in ramp for error in pair) <= 65
    for side in (0, 1):
        band = [pair[side] for pair in steady]
        assert max(band) - min(band) <= 4
        assert max(abs(error) for error in band) < 20


def test_a_wheel_commanded_to_zero_holds_its_position():
    rig = Rig(plant=DifferentialDrive(DriveParams()))
    rig.team(0, 0, 0)
    held = rig.board.left.real_position
    rig.run_to(rig.now + 200 * SAMPLE)
    assert rig.board.left.real_position == held
