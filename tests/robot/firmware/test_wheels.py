"""The closed loop on the real drive: firmware, LM629, bridge, motors, encoders."""

import pytest

from miro_sim.plant.drive import DifferentialDrive
from miro_sim.plant.params import DriveParams
from tests.robot.firmware.rig import SAMPLE, Rig


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
