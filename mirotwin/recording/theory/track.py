"""The paper's theory along a run: values collected in each control period.

f and the surfaces of each period are stored; everything else is counted.

f is that of equation (15), f = z_r' + u - z', over one control period: z_r' + u is the change of the commanded velocity
by the command that was computed at the period's exposure, after its limits; z' is the change of the true velocity from
this exposure to the next. So f contains all effects between command and motion: mainly the dead time, then the LM629's
slope, radio, wheel radii, quantum. All other values are computed from the true posture at the exposure.

The paper's assumptions on a trajectory:

1. "Without loss of generality" all angles lie in (-pi, pi]. Nothing can break it but the seam: an angle that turns past
   pi comes back at -pi. The errors then jump by a turn, which wrapping takes away, unless the error itself passes pi.
2. Equation (11): rho_r = 0 at t = 0 only, and |rho_c| > rho_f for t > 0; rho_f is the measurement error, 2.40 cm.
3. Equation (12): ||phi_c - theta_c| - (2m+1) pi/2| >= alpha, m = 0 or 1: the heading is never across the line of sight
   from the origin. The paper gives no alpha. `across` is the left side, with the sign of the cosine.
"""

from __future__ import annotations

import math
from array import array

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_exact.dmath import atan2, wrap_pi
from miro_host.laws.yang_kim import POSITION_ERROR_M
from miro_host.posture import Posture
from miro_sim.periods import RobotPeriod
from mirotwin.recording.channels import TheoryMessage
from mirotwin.recording.theory.chattering import Chattering

PERIOD_S = seconds(CONTROL_PERIOD_TICKS)
PI = 3.141592653589793
HALF_PI = 1.5707963267948966
ALPHA_RAD = 0.1
"""Ours: the paper calls alpha "a positive constant"."""
MOVING_M_S = 0.01
"""Slower than this a robot goes neither forward nor backward: at rest its motors tremble."""


def radius(posture: Posture) -> float:
    """rho in m."""
    return math.sqrt(posture.x_m * posture.x_m + posture.y_m * posture.y_m)


def across(posture: Posture) -> float:
    """The distance in rad from a heading across the line from the origin: equation (12).

    It has the sign of cos(phi_c - theta_c), and is 0 where u1 has its 1/0. The heading may be unwrapped.
    """
    return HALF_PI - abs(wrap_pi(atan2(posture.y_m, posture.x_m) - posture.theta_rad))


class Broken:
    """In which control periods something was not as it should be: how many, and the first and last of them."""

    __slots__ = ("count", "first_tick", "last_tick")

    def __init__(self) -> None:
        self.count = 0
        self.first_tick = self.last_tick = -1

    def note(self, tick: int, broken: bool) -> bool:
        """True if all is as it should be."""
        if broken:
            self.first_tick = self.first_tick if self.count else tick
            self.last_tick = tick
        self.count += broken
        return not broken


class Turns:
    """An angle in (-pi, pi] followed without jumps; it counts how many turns the angle has left that range by."""

    __slots__ = ("_last", "turns")

    def __init__(self) -> None:
        self.turns = 0
        self._last: float | None = None

    def follow(self, angle_rad: float) -> int:
        """1 if it passed the seam at pi since the last time, else 0."""
        last, self._last = self._last, angle_rad
        if last is None or -PI <= angle_rad - last <= PI:
            return 0
        self.turns += 1 if angle_rad < last else -1
        return 1


class TheoryTrack:
    """One robot. `now`: the recorded values of the last added period; None before a host steers it."""

    def __init__(self) -> None:
        self.f1_m_s2 = array("d")
        self.f2_rad_s2 = array("d")
        # as the law saw them when it made the command of that f; empty if it does not say them
        self.s1_m_s = array("d")
        self.s2_rad_s = array("d")
        self.ranges, self.origin, self.perpendicular = Broken(), Broken(), Broken()  # assumptions 1, 2, 3
        self.seams = 0
        self.nearest_m = self.nearest_rad = 10.0
        self.crossings = 0
        self.reversals = self.backward = 0
        self.chattering = Chattering()
        self.now: TheoryMessage | None = None
        self._angles = Turns(), Turns(), Turns(), Turns()  # theta_c, phi_c, theta_r, phi_r
        self._side = self._way = 0
        self._tick = -1
        self._velocity = self._command = (0.0, 0.0)
        self._demand: tuple[float, float] | None = None
        self._surfaces: tuple[float, float] | None = None

    def add(self, robot: RobotPeriod, tick: int) -> None:
        """Adds the next control period."""
        f = self._disturbance(robot, tick)
        rho_c, across_rad = radius(robot.truth), across(robot.truth)
        holds = (
            self.ranges.note(tick, self._left_the_ranges(robot)),
            self.origin.note(tick, self._near_the_origin(rho_c, robot.reference, tick)),
            self.perpendicular.note(tick, self._perpendicular(across_rad)),
        )
        self._move(robot.v_m_s)
        self._steer(robot)
        self._tick = tick
        if self.chattering.commands:
            self.now = TheoryMessage(tick, *f, rho_c, across_rad, *holds)

    def _disturbance(self, robot: RobotPeriod, tick: int) -> tuple[float | None, float | None]:
        """f of the period that ends with this exposure."""
        (v, w), self._velocity = self._velocity, (robot.v_m_s, robot.w_rad_s)
        if self._demand is None or tick - self._tick != CONTROL_PERIOD_TICKS:
            return None, None
        f1 = self._demand[0] - (robot.v_m_s - v) / PERIOD_S
        f2 = self._demand[1] - (robot.w_rad_s - w) / PERIOD_S
        self.f1_m_s2.append(f1)
        self.f2_rad_s2.append(f2)
        if self._surfaces is not None:
            self.s1_m_s.append(self._surfaces[0])
            self.s2_rad_s.append(self._surfaces[1])
        return f1, f2

    def _left_the_ranges(self, robot: RobotPeriod) -> bool:
        """Assumption 1. In the origin phi is no angle."""
        truth, reference = robot.truth, robot.reference
        theta_c, phi_c, theta_r, phi_r = self._angles
        self.seams += theta_c.follow(wrap_pi(truth.theta_rad)) + theta_r.follow(reference.theta_rad)
        if truth.x_m != 0.0 or truth.y_m != 0.0:
            self.seams += phi_c.follow(atan2(truth.y_m, truth.x_m))
        if reference.x_m != 0.0 or reference.y_m != 0.0:
            self.seams += phi_r.follow(atan2(reference.y_m, reference.x_m))
        return bool(theta_c.turns or phi_c.turns or theta_r.turns or phi_r.turns)

    def _near_the_origin(self, rho_c: float, reference: Posture, tick: int) -> bool:
        """Assumption 2, equation (11)."""
        reference_there = reference.x_m == 0.0 and reference.y_m == 0.0
        if tick == 0:
            return not reference_there
        if rho_c < self.nearest_m:
            self.nearest_m = rho_c
        return reference_there or rho_c <= POSITION_ERROR_M

    def _perpendicular(self, across_rad: float) -> bool:
        """Assumption 3, equation (12)."""
        if across_rad != 0.0:
            side = 1 if across_rad > 0.0 else -1
            if side == -self._side:
                self.crossings += 1
            self._side = side
        distance = abs(across_rad)
        if distance < self.nearest_rad:
            self.nearest_rad = distance
        return distance < ALPHA_RAD

    def _move(self, v_m_s: float) -> None:
        if abs(v_m_s) > MOVING_M_S:
            way = 1 if v_m_s > 0.0 else -1
            if way == -self._way:
                self.reversals += 1
            self._way = way
            if way < 0:
                self.backward += 1

    def _steer(self, robot: RobotPeriod) -> None:
        """Stores the demand of this period's command; nothing if the host gave none."""
        control = robot.control
        if control is None:
            self._demand = None
            return
        v, w = self._command
        self._demand = (control.v_m_s - v) / PERIOD_S, (control.w_rad_s - w) / PERIOD_S
        self._command = control.v_m_s, control.w_rad_s
        inner = control.inner
        self._surfaces = (inner["s1"], inner["s2"]) if "s1" in inner and "s2" in inner else None
        self.chattering.add(control.left, control.right)
