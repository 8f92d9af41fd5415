"""The robot fixture: what a robot does at its wheels, and what stands in its memory."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from miro_exact.clock import ms
from miro_host.wheels import Wheels
from miro_protocol.table import TICKS_PER_MS
from miro_robot.faults import FirmwareFault
from miro_robot.inspect.values import read_value, write_value
from miro_robot.lm629.buffers import FORWARD, STOP_ABRUPTLY, STOP_SMOOTHLY, VELOCITY_MODE
from miro_robot.lm629.buffers import MOTOR_OFF as OFF_WORD
from miro_robot.lm629.chip import Lm629
from miro_robot.lm629.signals import MOTOR_OFF
from miro_sim.world.conditions import Condition, Reached, When
from miro_sim.world.events import Event
from miro_sim.world.waits import WaitExpired, Waits
from miro_sim.world.world import World
from mirotwin.shell.firmware_image import is_up
from mirotwin.testing.waiting import WaitFailed, shown_where_it_was_called

RESET_TICKS = ms(1)
"""An AT89C52 needs its pin high for two machine cycles, 24 ticks; both LM629 are reset by the firmware."""
UP_TICKS = ms(267)
Mode = Literal["drive", "stop", "off"]


class WheelState(msgspec.Struct, frozen=True):
    """One wheel now. `mode`: the command of its LM629; `commanded`: the velocity, in 1/256 count per sample as a
    team frame has it, 0 unless it drives; `speed_m_s`: of the rim, in truth; `pwm`: duty in 1/128, negative backward;
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


class RobotUnderTest:
    """The robot in `slot` of `network`. `written`: whether the test has changed its memory by itself."""

    def __init__(self, world: World, network: int, slot: int) -> None:
        self.world = world
        self.network = network
        self.slot = slot
        self.written = False
        self._robot = world.robot(network, slot)
        self._waits = Waits(world)

    @property
    def wheels(self) -> WheelStates:
        """What the wheels do now, and what was commanded."""
        board, chassis = self._robot.board, self._robot.spec.drive.chassis
        left, right = Wheels(track_m=chassis.track_m).split(*self._robot.drive.velocity_at(self.world.tick))
        return WheelStates(_wheel(board.left, left), _wheel(board.right, right))

    @property
    def pose(self) -> tuple[float, float, float]:
        """(x in m, y in m, heading in rad), in truth."""
        return self._robot.drive.pose_at(self.world.tick)

    @property
    def faults(self) -> list[FirmwareFault]:
        """What the firmware did that it must not."""
        return list(self._robot.board.faults)

    @shown_where_it_was_called
    def read(self, name: str, as_type: str = "") -> Any:
        """The firmware's variable `name` by its C type: `read("last_left")`, `read("motion:state")`, `read("body[3]")`,
        `read("pt.x")`. An array is a list, a struct a dict. `as_type`, `int16` or `uint8[4]`, is for images without
        .cdb. Raises BadInput with the names that come close.
        """
        return read_value(self._robot.board.cpu, self.world.image, name, as_type)

    @shown_where_it_was_called
    def write(self, name: str, value: Any, as_type: str = "") -> None:
        """Changes a variable in internal RAM. No recording holds that: a failure after it leaves no case."""
        self.written = True
        write_value(self._robot.board.cpu, self.world.image, name, value, as_type)

    @shown_where_it_was_called
    def break_at(self, place: int | str, within: int | None = None) -> Event:
        """Runs on until the instruction at `place`, an address or a symbol, is the next. `within`: ticks from now;
        None: the limit of virtual time. Raises WaitFailed, and BadInput for a symbol that is not there.
        """
        symbol, address = (place, None) if isinstance(place, str) else (None, place)
        condition = Reached(symbol=symbol, address=address, network=self.network, slot=self.slot)
        return self._until(condition, within, f"{place} was not reached")

    def _until(self, condition: Condition, within: int | None, wanted: str) -> Event:
        try:
            return self._waits.until([condition], within)
        except WaitExpired as expired:
            limit = "" if within is None else f" within {within / TICKS_PER_MS:g} ms"
            raise WaitFailed.of(expired, self.world, f"{wanted}{limit}") from None

    # Its switches

    @shown_where_it_was_called
    def reset(self, for_ticks: int = RESET_TICKS) -> None:
        """Holds the processor in reset for so long, and lets it go; `wait_until_up` is for what comes then."""
        self.world.run_to(self.world.set_reset(1, self.network, self.slot))
        self.world.run_for(for_ticks)
        self.world.run_to(self.world.set_reset(0, self.network, self.slot))

    def power_off(self) -> None:
        """Switches the robot off: its memory is lost, its wheels roll out."""
        self.world.run_to(self.world.set_power(0, self.network, self.slot))

    def power_on(self) -> None:
        """Switches it on again; it begins from reset."""
        self.world.run_to(self.world.set_power(1, self.network, self.slot))

    @shown_where_it_was_called
    def wait_until_up(self, within: int = UP_TICKS) -> int:
        """Runs on until the firmware has turned its serial receiver on, and returns the tick. Raises WaitFailed."""
        up = When(predicate=lambda robot: is_up(robot.board.cpu), network=self.network, slot=self.slot)
        return self._until(up, within, "the firmware has not turned its serial receiver on").tick

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
