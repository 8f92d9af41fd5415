"""Checks that a robot can drive its reference under its law: speed, accelerations, and the law's origin.

Speeds and accelerations are compared with the limits that hold for the commands: the speed of a wheel, and the law's
limits of z_cmd and of its change from one camera frame to the next. The robot starts at rest.
"""

from __future__ import annotations

from collections.abc import Iterable

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_host.laws.interface import LawParameters
from miro_host.references.interface import Reference
from miro_host.wheels import Wheels

Problem = tuple[str, str]
"""An error of a reference, and the remedy."""
Places = Iterable[tuple[float, Reference]]
"""A reference at several times in s, in their order."""

SLACK = 1e-6
"""The share by which rounding may exceed a limit that a reference just keeps."""
ORIGIN_M = 1e-6
"""A path that starts this near to the origin starts in it."""


def limits_problem(frames: Places, law: LawParameters) -> Problem | None:
    """The error of a reference that exceeds speed limits at the camera frames `frames`; None if it does not."""
    period_s = seconds(CONTROL_PERIOD_TICKS)
    wheels = Wheels()
    v_before = w_before = 0.0
    for t_s, at in frames:
        v, w = at.v_m_s, at.w_rad_s
        rim_m_s = max(abs(speed) for speed in wheels.split(v, w))
        for name, value, limit, unit in (
            ("max_v_m_s", abs(v), law.max_v_m_s, "m/s"),
            ("max_w_rad_s", abs(w), law.max_w_rad_s, "rad/s"),
            ("max_v_dot_m_s2", abs(v - v_before) / period_s, law.max_v_dot_m_s2, "m/s2"),
            ("max_w_dot_rad_s2", abs(w - w_before) / period_s, law.max_w_dot_rad_s2, "rad/s2"),
            ("", rim_m_s, wheels.limit_m_s, "m/s"),
        ):
            if value > limit * (1.0 + SLACK):
                return _beyond(t_s, at, name, f"{value:.4g} {unit}", f"{limit:g}")
        v_before, w_before = v, w
    return None


def _beyond(t_s: float, at: Reference, name: str, value: str, limit: str) -> Problem:
    where = f"after {t_s:.2f} s, at {_place(at)},"
    if not name:
        return f"{where} a wheel needs {value}; it reaches {limit} m/s", "drive it more slowly, or turn less"
    return (
        f"{where} it needs {value}, more than the controller's {name} = {limit}",
        f"drive it more slowly, or raise controller.{name}",
    )


def origin_problem(places: Places, law: LawParameters) -> Problem | None:
    """The error of a path that comes too near to the origin (equation 11 of the paper).

    A path that starts in the origin must move away from it until it has reached the law's clearance.
    """
    clearance_m = law.ORIGIN_CLEARANCE_M
    if clearance_m == 0.0:
        return None
    least_m = -1.0
    nearest: tuple[float, Reference] | None = None
    for t_s, at in places:
        if least_m < 0.0:
            least_m = 0.0 if at.rho_m <= ORIGIN_M else clearance_m
        if nearest is not None and at.rho_m >= nearest[1].rho_m:
            break
        if at.rho_m < least_m - ORIGIN_M:
            nearest = (t_s, at)
        least_m = min(clearance_m, max(least_m, at.rho_m))
    if nearest is None:
        return None
    t_s, at = nearest
    problem = (
        f"passes the origin: after {t_s:.2f} s, at {_place(at)}, it is {100.0 * at.rho_m:.2f} cm away, and the law"
        f" {law.name()!r}, which has polar coordinates, needs {100.0 * clearance_m:.1f} cm"
    )
    return problem, "lead it past the origin at a greater distance, or choose another law, such as body_frame"


def _place(at: Reference) -> str:
    return f"({100.0 * at.posture.x_m:.1f}, {100.0 * at.posture.y_m:.1f}) cm"
