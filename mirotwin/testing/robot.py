"""The robot fixture: motion of a robot's wheels, and content of its memory."""

from __future__ import annotations

from typing import Literal

import msgspec

from miro_host.wheels import Wheels
from miro_robot.lm629.buffers import FORWARD, STOP_ABRUPTLY, STOP_SMOOTHLY, VELOCITY_MODE
from miro_robot.lm629.buffers import MOTOR_OFF as OFF_WORD
from miro_robot.lm629.chip import Lm629
from miro_robot.lm629.signals import MOTOR_OFF
from miro_sim.world.world import World
from mirotwin.testing.device import DeviceUnderTest

Mode = Literal["drive", "stop", "off"]


class WheelState(msgspec.Struct, frozen=True):
    """The present state of a wheel. `mode`: the command of its LM629; `commanded`: velocity in 1/256 count per sample
    as in a team frame, 0 unless it drives; `speed_m_s`: true speed of the rim; `pwm`: duty in 1/128, negative backward;
    `position`: counts of the LM629 as of its last sample.
    """

    mode: Mode
    commanded: int
    speed_m_s: float
    pwm: int
    position: int


class WheelStates(msgspec.Struct, frozen=True):
    """Both wheels at one tick."""

    left: WheelState
    right: WheelState

    @property
    def mode(self) -> tuple[Mode, Mode]:
        return self.left.mode, self.right.mode

    @property
    def commanded(self) -> tuple[int, int]:
        return self.left.commanded, self.right.commanded

    @property
    def speed_m_s(self) -> tuple[float, float]:
        return self.left.speed_m_s, self.right.speed_m_s

    @property
    def pwm(self) -> tuple[int, int]:
        return self.left.pwm, self.right.pwm


class RobotUnderTest(DeviceUnderTest):
    """The robot in `slot` of `network`."""

    def __init__(self, world: World, network: int, slot: int) -> None:
        super().__init__(world, network, slot)
        self._robot = world.robot(network, slot)

    @property
    def wheels(self) -> WheelStates:
        """The present motion and commands of the wheels."""
        board, chassis = self._robot.board, self._robot.spec.drive.chassis
        left, right = Wheels(track_m=chassis.track_m).split(*self._robot.drive.velocity_at(self.world.tick))
        return WheelStates(_wheel(board.left, left), _wheel(board.right, right))

    @property
    def pose(self) -> tuple[float, float, float]:
        """(x in m, y in m, heading in rad), in truth."""
        return self._robot.drive.pose_at(self.world.tick)

    def __repr__(self) -> str:
        wheels = self.wheels
        return (
            f"RobotUnderTest(net{self.network}/robot{self.slot}, {wheels.mode}, commanded={wheels.commanded})"
        )


def _wheel(chip: Lm629, speed_m_s: float) -> WheelState:
    buffer = chip.trajectory_buffer
    control = buffer.taken_control
    mode: Mode = "drive"
    if control & OFF_WORD if chip.start_taken else chip.signals.word & MOTOR_OFF:
        mode = "off"
    elif control & (STOP_ABRUPTLY | STOP_SMOOTHLY):
        mode = "stop"
    velocity = buffer.taken_velocity >> 8 if mode == "drive" else 0
    if control & VELOCITY_MODE and not control & FORWARD:
        velocity = -velocity
    pwm = -chip.pwm_magnitude if chip.sign else chip.pwm_magnitude
    return WheelState(mode, velocity, speed_m_s, pwm, chip.real_position)
