"""Sliding mode on errors in the robot's own axes: no origin, no heading at which the law has no answer.

The surfaces are those of Yang & Kim (IEEE T-RA 15(3), 1999), equation (13), with two changes. The errors x, y, theta
are those of Kanayama et al. (ICRA 1990) in place of polar coordinates. And the heading follows a demand h(y), which
points the robot at the path, in place of the term sgn(theta_e) |phi_e|, which does not know the side of the path:

    x' = w y - v + v_r cos(theta)       y' = -w x + v_r sin(theta)       theta' = w_r - w

    s1 = x' + gamma1 x                  s2 = e' + gamma2 e,   e = theta + h(y),   h = a y / sqrt(l^2 + y^2)

On s2 = 0 the heading follows the demand, theta -> -h(y), so that y' = -v_r sin(h(y)) - w x, and the lateral error
falls at a rate of up to v_r a / l. The law's accelerations make

    s_i' = -Q_i s_i - P_i sat(s_i / layer_i)

exactly, as long as neither a limit of z_cmd nor the guard below is met.

Known limit: a reference that stands still gives y' no v_r to fall with; a lateral error then remains.
"""

import math
from typing import Annotated

import msgspec
from msgspec import Meta

from miro_exact.dmath import sincos
from miro_host.integrator import clamp
from miro_host.laws.interface import Accelerations, Law, LawInput, LawParameters, errors
from miro_host.posture import Posture
from miro_host.references.interface import Reference

Gain = Annotated[float, Meta(ge=0.0, le=1e3)]
Width = Annotated[float, Meta(ge=1e-6, le=1e3)]
Demand = Annotated[float, Meta(ge=0.0, le=1.5)]
Guard = Annotated[float, Meta(gt=0.0, le=1.0)]


class BodyFrameParameters(LawParameters, frozen=True, kw_only=True, tag="body_frame"):
    """gamma_i, Q_i, P_i and the boundary layers of s1 and s2; the heading demand; and a guard.

    `demand_rad` is a, the largest heading demand: at a quarter turn the robot would drive straight at the path.
    `demand_width_m` is l, the lateral error at which the demand is 0.7 a. `turn_guard` is the least value of the
    denominator 1 + h'(y) x of w', which is 0 when the reference is l / a straight behind the robot.
    """

    gamma1_per_s: Gain = 5.0
    gamma2_per_s: Gain = 4.0
    q1_per_s: Gain = 6.0
    q2_per_s: Gain = 6.0
    p1_m_s2: Gain = 0.29
    p2_rad_s2: Gain = 0.15
    layer_s1_m_s: Width = 0.19
    layer_s2_rad_s: Width = 0.46
    demand_rad: Demand = 1.0
    demand_width_m: Width = 0.03
    turn_guard: Guard = 0.4

    def law(self) -> "BodyFrame":
        return BodyFrame(self)


class BodyFrameControl(msgspec.Struct, frozen=True):
    """Errors, surfaces s1 [m/s] and s2 [rad/s], and what makes them fall: v' [m/s2] and w' [rad/s2]."""

    x_m: float
    y_m: float
    theta_rad: float
    s1: float
    s2: float
    v_dot: float
    w_dot: float


class BodyFrame(Law[BodyFrameParameters]):
    """The law with one set of gains; without memory: the same inputs give the same output."""

    INNER = ("s1", "s2", "x_m", "y_m", "theta_rad")

    def step(self, given: LawInput) -> Accelerations:
        """v' and w', which equation (15) integrates."""
        c = self.control(given.reference, given.posture, given.v_m_s, given.w_rad_s)
        inner = {"s1": c.s1, "s2": c.s2, "x_m": c.x_m, "y_m": c.y_m, "theta_rad": c.theta_rad}
        return Accelerations(c.v_dot, c.w_dot, inner)

    def control(self, reference: Reference, posture: Posture, v: float, w: float) -> BodyFrameControl:
        """The answer for a robot at `posture` that moves with `v` m/s and `w` rad/s."""
        g, r = self.parameters, reference
        e = errors(r.posture, posture)
        x, y = e.x_m, e.y_m
        sin, cos = sincos(e.theta_rad)
        x_rate = w * y - v + r.v_m_s * cos
        y_rate = -w * x + r.v_m_s * sin
        theta_rate = r.w_rad_s - w

        demand, slope, bend = self.demand(y)
        s1 = x_rate + g.gamma1_per_s * x
        e_rate = theta_rate + slope * y_rate
        s2 = e_rate + g.gamma2_per_s * (e.theta_rad + demand)

        reach2 = g.q2_per_s * s2 + g.p2_rad_s2 * clamp(s2 / g.layer_s2_rad_s, 1.0)
        y_accel = -w * x_rate + r.v_dot_m_s2 * sin + r.v_m_s * cos * theta_rate  # y'' without its term -w' x
        w_dot = r.w_dot_rad_s2 + slope * y_accel + bend * y_rate * y_rate + g.gamma2_per_s * e_rate + reach2
        w_dot = clamp(w_dot / max(g.turn_guard, 1.0 + slope * x), g.max_w_dot_rad_s2)

        reach1 = g.q1_per_s * s1 + g.p1_m_s2 * clamp(s1 / g.layer_s1_m_s, 1.0)
        x_accel = w_dot * y + w * y_rate + r.v_dot_m_s2 * cos - r.v_m_s * sin * theta_rate  # x'' without -v'
        v_dot = x_accel + g.gamma1_per_s * x_rate + reach1
        return BodyFrameControl(x, y, e.theta_rad, s1, s2, v_dot, w_dot)

    def demand(self, y_m: float) -> tuple[float, float, float]:
        """The heading demand h(y) in rad, h'(y) in rad/m and h''(y) in rad/m2."""
        a, width = self.parameters.demand_rad, self.parameters.demand_width_m
        square = width * width + y_m * y_m
        root = math.sqrt(square)
        slope = a * width * width / (square * root)
        return a * y_m / root, slope, -3.0 * slope * y_m / square
