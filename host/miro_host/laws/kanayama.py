"""The tracking law of Y. Kanayama, Y. Kimura, F. Miyazaki, T. Noguchi (IEEE ICRA 1990).

With the errors x, y, theta of the reference in the robot's own axes,

    v = v_r cos(theta) + K_x x
    w = w_r + v_r (K_y y + K_theta sin(theta))

Near a straight line y'' + v_r K_theta y' + v_r^2 K_y y = 0: critically damped over the path for K_theta^2 = 4 K_y.

Known limit: while the reference stands still, w = 0 and neither y nor theta falls.
"""

from typing import Annotated

from msgspec import Meta

from miro_exact.dmath import sincos
from miro_host.laws.interface import Law, LawInput, LawParameters, Velocities, errors

Gain = Annotated[float, Meta(ge=0.0, le=1e4)]


class KanayamaParameters(LawParameters, frozen=True, kw_only=True, tag="kanayama"):
    """K_x, K_y and K_theta."""

    kx_per_s: Gain = 3.2
    ky_per_m2: Gain = 120.0
    ktheta_per_m: Gain = 26.0

    def law(self) -> "Kanayama":
        return Kanayama(self)


class Kanayama(Law[KanayamaParameters]):
    """Velocities from errors; without memory."""

    INNER = ("x_m", "y_m", "theta_rad")

    def step(self, given: LawInput) -> Velocities:
        k, r = self.parameters, given.reference
        e = errors(r.posture, given.posture)
        sin, cos = sincos(e.theta_rad)
        v_m_s = r.v_m_s * cos + k.kx_per_s * e.x_m
        w_rad_s = r.w_rad_s + r.v_m_s * (k.ky_per_m2 * e.y_m + k.ktheta_per_m * sin)
        return Velocities(v_m_s, w_rad_s, {"x_m": e.x_m, "y_m": e.y_m, "theta_rad": e.theta_rad})
