"""Pure pursuit of a moving reference: a second law that lives outside Mirotwin, without a memory.

R. C. Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm", CMU-RI-TR-92-01: the robot drives on the
arc that leads it to a goal point ahead on the path. With the goal at (x, y) in the robot's own axes, l metres away, the
arc has the curvature

    kappa = 2 y / l^2

The report takes the goal from the path near the robot. Here the path has a timetable: the goal is where the reference
will be `lookahead_s` from now, and the speed is that of a robot which keeps that distance,

    v = l / lookahead_s        w = v kappa

so the robot comes to the reference along the path as well as across. With the goal behind it kappa is 2 / l on the
goal's side, as for a goal abeam: it turns round, and never follows backwards. Below `shortest_m` nothing is divided by
l: the robot has arrived at a goal that stands still.
"""

import math
from typing import Annotated

from msgspec import Meta

from miro_exact.dmath import sincos
from miro_host.laws.interface import Law, LawInput, LawParameters, Velocities


class Parameters(LawParameters, frozen=True, kw_only=True, tag="pure_pursuit"):
    """How far ahead in time the goal is, and the least distance to it."""

    lookahead_s: Annotated[float, Meta(gt=0.0, le=10.0)] = 0.5
    shortest_m: Annotated[float, Meta(gt=0.0, le=1.0)] = 0.005

    def law(self) -> "PurePursuit":
        return PurePursuit(self)


class PurePursuit(Law[Parameters]):
    """Velocities towards a goal ahead; nothing is remembered, so `STATE` is empty."""

    INNER = ("goal_x_m", "goal_y_m")

    def step(self, given: LawInput) -> Velocities:
        k, here = self.parameters, given.posture
        goal = given.path.at(given.t_s + k.lookahead_s).posture
        sin, cos = sincos(here.theta_rad)
        dx_m, dy_m = goal.x_m - here.x_m, goal.y_m - here.y_m
        x_m, y_m = cos * dx_m + sin * dy_m, cos * dy_m - sin * dx_m
        far_m = math.sqrt(x_m * x_m + y_m * y_m)
        v_m_s = w_rad_s = 0.0
        if far_m >= k.shortest_m:
            aside_m = y_m if x_m > 0.0 else math.copysign(far_m, y_m)
            v_m_s = far_m / k.lookahead_s
            w_rad_s = v_m_s * 2.0 * aside_m / (far_m * far_m)
        return Velocities(v_m_s, w_rad_s, {"goal_x_m": x_m, "goal_y_m": y_m})
