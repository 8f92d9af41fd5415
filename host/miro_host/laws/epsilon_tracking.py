"""Epsilon-tracking by sliding mode: reconstructed, because the paper that Yang & Kim compare with is not at hand.

Yang & Kim (IEEE T-RA 15(3), 1999, section V-B, Figs. 9 and 10) compare their law with the tracking law of A. Bloch,
S. Drakunov, "Tracking in nonholonomic dynamic systems via sliding modes" (IEEE CDC 1995). **Nothing below is quoted
from it.** The law here is built from the stabiliser of the nonholonomic integrator (R. Brockett's) that the
same authors published: "Stabilization and tracking in the nonholonomic integrator via sliding modes", Systems & Control
Letters 29 (1996):

    x1' = u1    x2' = u2    x3' = x1 u2 - x2 u1
    u1 = -alpha x1 + beta x2 sgn(x3)        u2 = -alpha x2 - beta x1 sgn(x3)

There x3' = -beta (x1^2 + x2^2) sgn(x3): the rotation of (x1, x2) drives x3. To track x* with its inputs u*, x1 and x2
must not come to rest on the reference, where nothing drives x3; they are kept on a circle of radius epsilon round it:

    e_i = x_i - x_i*     n^2 = e1^2 + e2^2     pull = alpha sat((n^2 - epsilon^2) / epsilon^2)
    u1 = u1* - pull e1 + beta e2 sgn(sigma)    u2 = u2* - pull e2 - beta e1 sgn(sigma)

    sigma = x3 - x3* - (x1* e2 - x2* e1)       "invariant": sigma' = -beta n^2 sgn(sigma) + 2 (e1 u2* - e2 u1*)
    sigma = x3 - x3*                           "naive": x*, a lever of up to a metre, then enters sigma'

So n tends to epsilon, and the invariant sigma to 0 in finite time if beta epsilon > 2 |u*|: the accuracy that the law's
name promises. The unicycle becomes this integrator, in world axes and with an unwrapped heading (the law's memory), by

    z2 = (x cos(theta) + y sin(theta)) / L     z3 = (x sin(theta) - y cos(theta)) / L
    x1 = theta    x2 = z2    x3 = theta z2 - 2 z3        w = u1    v = L (u2 + z3 w)

L is ours: it says how many metres are worth a radian.

    set           epsilon  alpha  beta    L    sigma                    what it is
    THEORY          0.2     3.0   22     0.10  invariant, sgn           keeps beta epsilon > 2 |u*| = 4 at 0.2 m/s
    ILLUSTRATIVE    0.06    2.3    3.0   0.29  naive, sgn               searched for: y large and x small, as in Fig. 9
    RETUNED         0.015   2.4    3.2   0.47  invariant, sat(. / 0.01)  for this loop; breaks the theory's condition

Known limit: where the condition is kept, the rotation by beta is far too fast for a loop of 33 ms: the robot tumbles.
ILLUSTRATIVE shows what the paper shows and proves nothing; RETUNED, the default, tracks as well as the paper's law.
"""

import math
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from miro_exact.dmath import sincos, wrap_pi
from miro_host.integrator import clamp
from miro_host.laws.interface import Law, LawInput, LawParameters, Velocities
from miro_host.posture import Posture

Gain = Annotated[float, Meta(gt=0.0, le=1e3)]
Radius = Annotated[float, Meta(ge=1e-4, le=10.0)]
Length = Annotated[float, Meta(ge=1e-3, le=10.0)]
Width = Annotated[float, Meta(ge=1e-6, le=1e3)]


class EpsilonTrackingParameters(LawParameters, frozen=True, kw_only=True, tag="epsilon_tracking"):
    """epsilon, alpha, beta, L; which sigma; sgn(sigma), or sat(sigma / `layer_sigma_rad2`) in its place.

    `layer_sigma_rad2` is used with `switching` = "saturation" alone.
    """

    epsilon_rad: Radius = 0.015
    alpha_per_s: Gain = 2.4
    beta_per_s: Gain = 3.2
    length_m: Length = 0.47
    sigma: Literal["invariant", "naive"] = "invariant"
    switching: Literal["sign", "saturation"] = "saturation"
    layer_sigma_rad2: Width = 0.01
    max_v_m_s: Annotated[float, Meta(gt=0.0, le=1e6)] = 0.28
    max_w_rad_s: Annotated[float, Meta(gt=0.0, le=1e6)] = 4.0

    def law(self) -> "EpsilonTracking":
        return EpsilonTracking(self)


class Point(msgspec.Struct, frozen=True):
    """A posture as a state of the nonholonomic integrator: x1, x2, x3, and z3."""

    x1: float
    x2: float
    x3: float
    z3: float


def point(posture: Posture, theta_rad: float, length_m: float) -> Point:
    """The state of `posture`, whose unwrapped heading is `theta_rad`."""
    sin, cos = sincos(posture.theta_rad)
    z2 = (posture.x_m * cos + posture.y_m * sin) / length_m
    z3 = (posture.x_m * sin - posture.y_m * cos) / length_m
    return Point(theta_rad, z2, theta_rad * z2 - 2.0 * z3, z3)


class EpsilonTracking(Law[EpsilonTrackingParameters]):
    """Velocities from the integrator's state. It remembers both headings unwrapped, robot's and reference's.

    In the first period the robot's is taken within half a turn of the reference's.
    """

    INNER = ("n_rad", "sigma_rad2", "e1_rad", "e2_rad")
    STATE = {"begun": "?", "theta_rad": "d", "reference_rad": "d"}

    def __init__(self, parameters: EpsilonTrackingParameters) -> None:
        super().__init__(parameters)
        self.begun = False
        self.theta_rad = 0.0
        self.reference_rad = 0.0

    def step(self, given: LawInput) -> Velocities:
        g, r = self.parameters, given.reference
        self._unwrap(given.posture.theta_rad, r.posture.theta_rad)
        here = point(given.posture, self.theta_rad, g.length_m)
        there = point(r.posture, self.reference_rad, g.length_m)
        e1, e2 = here.x1 - there.x1, here.x2 - there.x2
        sigma = here.x3 - there.x3
        if g.sigma == "invariant":
            sigma -= there.x1 * e2 - there.x2 * e1
        square = e1 * e1 + e2 * e2
        epsilon2 = g.epsilon_rad * g.epsilon_rad
        pull = g.alpha_per_s * clamp((square - epsilon2) / epsilon2, 1.0)
        turn = g.beta_per_s * self._switch(sigma)
        u1 = r.w_rad_s - pull * e1 + turn * e2
        u2 = r.v_m_s / g.length_m - there.z3 * r.w_rad_s - pull * e2 - turn * e1
        v_m_s = g.length_m * (u2 + here.z3 * u1)
        inner = {"n_rad": math.sqrt(square), "sigma_rad2": sigma, "e1_rad": e1, "e2_rad": e2}
        return Velocities(v_m_s, u1, inner)

    def _unwrap(self, theta_rad: float, reference_rad: float) -> None:
        """Both headings a whole number of turns away from what is given, and near their last values."""
        if not self.begun:
            self.begun = True
            self.reference_rad = wrap_pi(reference_rad)
            self.theta_rad = self.reference_rad
        self.reference_rad += wrap_pi(reference_rad - self.reference_rad)
        self.theta_rad += wrap_pi(theta_rad - self.theta_rad)

    def _switch(self, sigma: float) -> float:
        if self.parameters.switching == "saturation":
            return clamp(sigma / self.parameters.layer_sigma_rad2, 1.0)
        return float((sigma > 0.0) - (sigma < 0.0))


THEORY = EpsilonTrackingParameters(
    epsilon_rad=0.2, alpha_per_s=3.0, beta_per_s=22.0, length_m=0.1, switching="sign", max_v_m_s=0.95
)
ILLUSTRATIVE = EpsilonTrackingParameters(
    epsilon_rad=0.06,
    alpha_per_s=2.3,
    beta_per_s=3.0,
    length_m=0.29,
    sigma="naive",
    switching="sign",
    max_v_m_s=0.95,
    max_w_rad_s=3.7,
)
RETUNED = EpsilonTrackingParameters()
