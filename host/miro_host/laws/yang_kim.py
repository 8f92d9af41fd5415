"""The paper's sliding-mode law: equations (13) and (16), literally, with the guards that a machine needs.

Known limits of the law, which this module does not mend (host/README.md): it has no lateral feedback on
the surface theta_e = 0, so the robot then runs parallel to the path; V = s's/2 jumps by 2 |theta_e'|
|phi_e| where theta_e crosses zero; it may settle on the path's mirror image through the origin.
"""

import math
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from miro_exact import dmath
from miro_host.laws.interface import Accelerations, Law, LawInput, LawParameters
from miro_host.posture import Posture
from miro_host.references.interface import Reference

POSITION_ERROR_M = 0.024  # rho_f of equation (11): the upper bound of the measurement error, section V-A
NOT_NEGATIVE = (
    "gamma1_per_s", "gamma2_per_s", "q1_per_s", "q2_per_s", "p1_m_s2", "p2_rad_s2", "cosine_guard",
)  # fmt: skip

Gain = Annotated[float, Meta(ge=0.0, le=1e6)]
Width = Annotated[float, Meta(gt=0.0, le=1e6)]


class Gains(LawParameters, frozen=True, tag="yang_kim"):
    """Parameters of equations (13) and (16) and of their guards.

    gamma, q and p are the paper's gamma_i, Q_i and P_i. With `switching` = "sign" every sgn is the sign
    function; with "saturation" (remark 2 after Theorem 1) sgn(x) becomes x / width limited to +-1, with the
    widths `layer_s1_m_s`, `layer_s2_rad_s`, `layer_theta_rad` for s1, s2 and theta_e. The sign of phi_e in
    d|phi_e|/dt is not a switching term and stays a sign.

    Inside the layer of theta_e, d/dt [sat(theta_e / w) |phi_e|] has a term (theta_e' / w) |phi_e| that (16)
    lacks, because sgn has no slope; V may rise there. With `layer_derivative` u2 takes it off, and
    s2' = -Q2 s2 - P2 sat(s2 / w2) holds inside the layer as well. This is not the published law; it mends
    the proof, not the lateral error.

    Guards: rho_c is taken as at least `rho_floor_m` where it is a denominator; 1/c, c = cos(phi_c - theta_c),
    becomes c (1 + d^2) / (c^2 + d^2) with d = `cosine_guard`: smooth, keeps the sign, 1 at c = 1, 0 at the
    singularity of assumption 3. d = 0 leaves 1/c as it is; a scenario cannot set that.
    ValueError for a parameter outside its range.
    """

    ORIGIN_CLEARANCE_M: ClassVar[float] = POSITION_ERROR_M

    gamma1_per_s: Gain = 1.7
    gamma2_per_s: Gain = 3.0
    q1_per_s: Gain = 0.53
    q2_per_s: Gain = 0.72
    p1_m_s2: Gain = 0.19
    p2_rad_s2: Gain = 0.69
    switching: Literal["sign", "saturation"] = "saturation"
    layer_s1_m_s: Width = 0.022
    layer_s2_rad_s: Width = 0.19
    layer_theta_rad: Width = 0.015
    layer_derivative: bool = False
    cosine_guard: Annotated[float, Meta(gt=0.0, le=1.0)] = 0.086
    rho_floor_m: Width = POSITION_ERROR_M

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.switching not in ("sign", "saturation"):
            raise ValueError(f"switching = {self.switching!r}: must be 'sign' or 'saturation'")
        positive = ["rho_floor_m"]
        if self.switching == "saturation":
            positive += ["layer_s1_m_s", "layer_s2_rad_s", "layer_theta_rad"]
        for name in positive:
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: must be greater than 0")
        if self.layer_derivative and self.switching == "sign":
            raise ValueError("layer_derivative: with switching = 'sign' theta_e has no layer; leave it out")
        for name in NOT_NEGATIVE:
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: must be 0 or greater")

    def law(self) -> "YangKim":
        return YangKim(self)


def sign(x: float) -> float:
    """sgn(x): -1, 0 or 1."""
    if x > 0.0:
        return 1.0
    if x < 0.0:
        return -1.0
    return 0.0


def saturation(x: float, width: float) -> float:
    """x / width limited to -1..1, the continuous stand-in for sgn of remark 2."""
    if x >= width:
        return 1.0
    if x <= -width:
        return -1.0
    return x / width


def curvature_term(v: float, w: float, rho: float, sin_alpha: float) -> float:
    """R(q, z) before Theorem 1 in m/s2: v^2/rho sin^2(alpha) + v w sin(alpha), alpha = phi - theta."""
    return v * v / rho * sin_alpha * sin_alpha + v * w * sin_alpha


class YangKim(Law[Gains]):
    """Equations (13) and (16) with one set of gains; without memory: the same inputs give the same output."""

    INNER = ("u1", "u2", "s1", "s2")
    NOT_STATE = ("parameters", "worked_out")

    def __init__(self, parameters: Gains) -> None:
        super().__init__(parameters)
        self.worked_out = YangKimControl(parameters)

    def step(self, given: LawInput) -> Accelerations:
        """v_r' + u1 and w_r' + u2, which equation (15) integrates."""
        r, c = given.reference, self.worked_out
        c.work_out(r, given.posture, given.v_m_s, given.w_rad_s)
        u1, u2 = c.u1, c.u2
        inner = {"u1": u1, "u2": u2, "s1": c.s1, "s2": c.s2}
        return Accelerations(r.v_dot_m_s2 + u1, r.w_dot_rad_s2 + u2, inner)


class YangKimControl:
    """Errors and output of the law, with one set of gains.

    Errors c - r in polar coordinates (m, rad, wrapped), surfaces s1 [m/s], s2 [rad/s] of equation (13),
    inputs u1 [m/s2], u2 [rad/s2] of equation (16).
    """

    NOT_STATE = ("*",)

    def __init__(self, gains: Gains) -> None:
        self.gamma1, self.gamma2 = gains.gamma1_per_s, gains.gamma2_per_s
        self.q1, self.q2 = gains.q1_per_s, gains.q2_per_s
        self.p1, self.p2 = gains.p1_m_s2, gains.p2_rad_s2
        self.smooth = gains.switching != "sign"
        self.layer_s1, self.layer_s2 = gains.layer_s1_m_s, gains.layer_s2_rad_s
        self.layer_theta = gains.layer_theta_rad
        self.layer_derivative = gains.layer_derivative
        self.cosine_guard = gains.cosine_guard
        self.rho_floor = gains.rho_floor_m
        self.rho_e_m = self.phi_e_rad = self.theta_e_rad = self.s1 = self.s2 = self.u1 = self.u2 = 0.0

    def __repr__(self) -> str:
        return f"YangKimControl(s1={self.s1!r}, s2={self.s2!r}, u1={self.u1!r}, u2={self.u2!r})"

    def work_out(self, r: Reference, measured: Posture, v_m_s: float, w_rad_s: float) -> None:
        """u1, u2 for a robot at `measured` that moves with (v_c, w_c) = (`v_m_s`, `w_rad_s`).

        ValueError at c = 0 exactly when there is no cosine guard (equation 12 is violated).
        """
        x, y, theta = measured.x_m, measured.y_m, measured.theta_rad
        rho_r, phi_r, theta_r = r.rho_m, r.phi_rad, r.posture.theta_rad
        rho_r_rate, phi_r_rate, w_r = r.rho_rate_m_s, r.phi_rate_rad_s, r.w_rad_s
        v_r_dot, rho_r_accel = r.v_dot_m_s2, r.rho_accel_m_s2
        rho = math.sqrt(x * x + y * y)
        phi = dmath.atan2(y, x)
        sin_alpha, cos_alpha = dmath.sincos(phi - theta)
        rho_floor = self.rho_floor
        if not rho_floor > rho:
            rho_floor = rho
        rho_e = rho - rho_r
        phi_e = dmath.wrap_pi(phi - phi_r)
        theta_e = dmath.wrap_pi(theta - theta_r)
        # rates by equation (9)
        rho_e_rate = v_m_s * cos_alpha - rho_r_rate
        phi_e_rate = -(v_m_s / rho_floor) * sin_alpha - phi_r_rate
        theta_e_rate = w_rad_s - w_r
        abs_phi_e_rate = sign(phi_e) * phi_e_rate  # d|phi_e|/dt, not |phi_e'|
        side = self._switch(theta_e, self.layer_theta)
        s1 = rho_e_rate + self.gamma1 * rho_e  # (13)
        s2 = theta_e_rate + self.gamma2 * theta_e + side * abs(phi_e)  # (13)
        braces = (
            -self.q1 * s1
            - self.p1 * self._switch(s1, self.layer_s1)
            - self.gamma1 * rho_e_rate
            + rho_r_accel  # v_r' cos(phi_r - theta_r) + R(q_r, z_r)
            - curvature_term(v_m_s, w_rad_s, rho_floor, sin_alpha)
        )
        u1 = guarded_inverse(cos_alpha, self.cosine_guard) * braces - v_r_dot  # (16)
        u2 = (  # (16)
            -self.q2 * s2
            - self.p2 * self._switch(s2, self.layer_s2)
            - self.gamma2 * theta_e_rate
            - side * abs_phi_e_rate
        )
        if self.layer_derivative and abs(theta_e) < self.layer_theta:
            u2 -= theta_e_rate / self.layer_theta * abs(phi_e)
        self.rho_e_m, self.phi_e_rad, self.theta_e_rad = rho_e, phi_e, theta_e
        self.s1, self.s2, self.u1, self.u2 = s1, s2, u1, u2

    def _switch(self, x: float, width: float) -> float:
        return saturation(x, width) if self.smooth else sign(x)


def guarded_inverse(cos_alpha: float, d: float) -> float:
    """The factor 1/cos(phi_c - theta_c) of equation (16), guarded by d."""
    if d == 0.0:
        if cos_alpha == 0.0:
            raise ValueError("cos(phi_c - theta_c) = 0: assumption 3 (equation 12) is violated")
        return 1.0 / cos_alpha
    return cos_alpha * (1.0 + d * d) / (cos_alpha * cos_alpha + d * d)
