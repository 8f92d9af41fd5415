"""Samson's tracking law with a filter: an example of a law that lives outside Mirotwin.

C. Samson, K. Ait-Abderrahim, "Feedback control of a nonholonomic wheeled cart in Cartesian space", IEEE ICRA 1991:
with the error (e1, e2, e3) from the robot to the reference in the robot's own axes,

    v = v_r cos e3 + k1 e1
    w = w_r + k2 v_r (sin e3 / e3) e2 + k3 e3

The camera's error is white and several times the tracking error, so e2 and e3 go through a first-order low-pass here.
The filter is the law's memory.
"""

from typing import Annotated

from msgspec import Meta

from miro_exact.dmath import sincos, wrap_pi
from miro_host.laws.interface import Law, LawInput, LawParameters, Velocities

Gain = Annotated[float, Meta(ge=0.0, le=1e3)]


class Parameters(LawParameters, frozen=True, kw_only=True, tag="samson"):
    """k1, k2, k3 of the law, and the weight of a new measurement in the filter (1 is no filter)."""

    k1_per_s: Gain = 1.0
    k2_per_m2: Gain = 30.0
    k3_per_s: Gain = 2.5
    weight: Annotated[float, Meta(gt=0.0, le=1.0)] = 0.35

    def law(self) -> "Samson":
        return Samson(self)


class Samson(Law[Parameters]):
    """Velocities from filtered errors."""

    INNER = ("e1_m", "e2_m", "e3_rad")
    STATE = {"begun": "?", "e2_m": "d", "e3_rad": "d"}

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters)
        self.begun = False
        self.e2_m = 0.0
        self.e3_rad = 0.0

    def step(self, given: LawInput) -> Velocities:
        k, at, here = self.parameters, given.reference, given.posture
        sin, cos = sincos(here.theta_rad)
        dx_m, dy_m = at.posture.x_m - here.x_m, at.posture.y_m - here.y_m
        e1_m = cos * dx_m + sin * dy_m
        self._filter(cos * dy_m - sin * dx_m, wrap_pi(at.posture.theta_rad - here.theta_rad))
        sin_e3, cos_e3 = sincos(self.e3_rad)
        ratio = sin_e3 / self.e3_rad if self.e3_rad != 0.0 else 1.0
        v_m_s = at.v_m_s * cos_e3 + k.k1_per_s * e1_m
        w_rad_s = at.w_rad_s + k.k2_per_m2 * at.v_m_s * ratio * self.e2_m + k.k3_per_s * self.e3_rad
        return Velocities(v_m_s, w_rad_s, {"e1_m": e1_m, "e2_m": self.e2_m, "e3_rad": self.e3_rad})

    def _filter(self, e2_m: float, e3_rad: float) -> None:
        weight = self.parameters.weight if self.begun else 1.0
        self.begun = True
        self.e2_m += weight * (e2_m - self.e2_m)
        self.e3_rad = wrap_pi(self.e3_rad + weight * wrap_pi(e3_rad - self.e3_rad))
