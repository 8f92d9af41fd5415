"""Equation (15) on the host: the LM629 takes speeds, so the law's accelerations are summed up here.

The integrator's state is also the robot's velocity as the law sees it: differences of noisy postures are
useless (0.8 cm of noise is 0.34 m/s after one frame).

Integration error is the paper's first disturbance (section V-A). A law evaluated once a period has no exact integral to
compare with; there are two rules of different order, with a_k the law's output in period k:

    euler            z_(k+1) = z_k + T a_k                       first order; takes a_k to hold for the period
    adams_bashforth  z_(k+1) = z_k + T (3 a_k - a_(k-1)) / 2     second order; takes a to go on as it changed last

The second has less error where the answer is smooth, and more where it switches.
"""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from miro_exact.state import FLAG

Limit = Annotated[float, Meta(gt=0.0, le=1e6)]
Integration = Literal["euler", "adams_bashforth"]


class Limits(msgspec.Struct, frozen=True, kw_only=True):
    """Bounds of the commanded velocity and of its rate, all greater than 0.

    Both are clamped: z_cmd, which is the anti-windup, and z', so that one noisy frame near
    cos(phi_c - theta_c) = 0 does not saturate the wheels.
    """

    max_v_m_s: Limit = 0.95
    max_w_rad_s: Limit = 3.7
    max_v_dot_m_s2: Limit = 8.0
    max_w_dot_rad_s2: Limit = 120.0

    def __post_init__(self) -> None:
        for name in ("max_v_m_s", "max_w_rad_s", "max_v_dot_m_s2", "max_w_dot_rad_s2"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: must be greater than 0")


def clamp(x: float, limit: float) -> float:
    """x limited to -limit..limit."""
    return min(max(x, -limit), limit)


class Integrator:
    """z_cmd = (v, w), advanced once per control period by z' = z_r' + u (equation 15 without f).

    A law that answers velocities instead sets z_cmd by `go_to`, within the same limits.
    """

    STATE: dict[str, object] = {"v_m_s": "d", "w_rad_s": "d"}
    NOT_STATE: tuple[str, ...] = ("limits", "period_s")

    def __init__(self, limits: Limits, period_s: float) -> None:
        if not period_s > 0.0:
            raise ValueError(f"period_s = {period_s!r}: must be greater than 0")
        self.limits = limits
        self.period_s = period_s
        self.v_m_s = 0.0
        self.w_rad_s = 0.0

    def __repr__(self) -> str:
        return f"Integrator(v_m_s={self.v_m_s!r}, w_rad_s={self.w_rad_s!r})"

    def step(self, v_dot_m_s2: float, w_dot_rad_s2: float) -> None:
        """Add one period of acceleration (v_r' + u1, w_r' + u2), clamped on both levels."""
        limits = self.limits
        v_dot = clamp(v_dot_m_s2, limits.max_v_dot_m_s2)
        w_dot = clamp(w_dot_rad_s2, limits.max_w_dot_rad_s2)
        self.v_m_s = clamp(self.v_m_s + self.period_s * v_dot, limits.max_v_m_s)
        self.w_rad_s = clamp(self.w_rad_s + self.period_s * w_dot, limits.max_w_rad_s)

    def go_to(self, v_m_s: float, w_rad_s: float) -> None:
        """Take over the velocities of a law, as near as both limits allow; exactly, if they do."""
        limits = self.limits
        self.v_m_s = _near(self.v_m_s, clamp(v_m_s, limits.max_v_m_s), self.period_s * limits.max_v_dot_m_s2)
        self.w_rad_s = _near(
            self.w_rad_s, clamp(w_rad_s, limits.max_w_rad_s), self.period_s * limits.max_w_dot_rad_s2
        )

    def after_load(self) -> None:
        """Raises ValueError for a velocity that the limits do not allow."""
        v, w = self.v_m_s, self.w_rad_s
        if not (abs(v) <= self.limits.max_v_m_s and abs(w) <= self.limits.max_w_rad_s):
            raise ValueError(f"velocity ({v}, {w}) is beyond the limits")


class AdamsBashforth(Integrator):
    """An integrator of second order. The first step, and one after velocities, is an Euler step."""

    STATE: dict[str, object] = {"last_v_dot": "d", "last_w_dot": "d", "begun": FLAG}

    def __init__(self, limits: Limits, period_s: float) -> None:
        super().__init__(limits, period_s)
        self.last_v_dot = 0.0
        self.last_w_dot = 0.0
        self.begun = 0

    def step(self, v_dot_m_s2: float, w_dot_rad_s2: float) -> None:
        """Add one period of acceleration, clamped on both levels; the rule sees clamped accelerations."""
        limits = self.limits
        v_dot = clamp(v_dot_m_s2, limits.max_v_dot_m_s2)
        w_dot = clamp(w_dot_rad_s2, limits.max_w_dot_rad_s2)
        if self.begun:
            Integrator.step(self, 1.5 * v_dot - 0.5 * self.last_v_dot, 1.5 * w_dot - 0.5 * self.last_w_dot)
        else:
            Integrator.step(self, v_dot, w_dot)
        self.last_v_dot = v_dot
        self.last_w_dot = w_dot
        self.begun = 1

    def go_to(self, v_m_s: float, w_rad_s: float) -> None:
        """Take over the velocities of a law; nothing is integrated."""
        Integrator.go_to(self, v_m_s, w_rad_s)
        self.begun = 0


def integrator_of(integration: Integration, limits: Limits, period_s: float) -> Integrator:
    """The integrator of that rule, at rest."""
    return (
        AdamsBashforth(limits, period_s) if integration == "adams_bashforth" else Integrator(limits, period_s)
    )


def _near(before: float, wanted: float, most: float) -> float:
    """`wanted`, or the value that lies `most` from `before` on its side."""
    if abs(wanted - before) <= most:
        return wanted
    return before + most if wanted > before else before - most
