"""Dynamic feedback linearisation: A. De Luca, G. Oriolo, M. Vendittelli, "Stabilization of the unicycle via dynamic
feedback linearization", IFAC SYROCO 2000.

With the speed v as a state of the controller, the position obeys x'' = u_x, y'' = u_y exactly for

    v' = u_x cos(theta) + u_y sin(theta)
    w  = (u_y cos(theta) - u_x sin(theta)) / v

and two chains of two integrators are steered along the reference by

    u = p_r'' + k_d (p_r' - p') + k_p (p_r - p),        p = (x, y)

The commanded speed that the last period ended with is v: it is the controller's state after the limits, so that nothing
winds up. At v = 0 the law has no answer for w. The guard: where v is divided by, it is taken as at least `v_floor_m_s`,
and the speed demanded is never less than that while the reference moves forwards. So a robot that points away from the
path turns round on a small circle in place of driving backwards for the rest of the path.

Known limit: the linearisation does not know the heading's error. A reference that stands still leaves the heading as
it is; a reference that drives backwards is not followed.
"""

from typing import Annotated

from msgspec import Meta

from miro_exact.dmath import sincos
from miro_host.laws.interface import Law, LawInput, LawParameters, Velocities

Gain = Annotated[float, Meta(ge=0.0, le=1e3)]
Speed = Annotated[float, Meta(ge=1e-6, le=1.0)]


class DynamicFeedbackParameters(LawParameters, frozen=True, kw_only=True, tag="dynamic_feedback"):
    """k_p, k_d, and the least speed that is divided by. ValueError for one above `max_v_m_s`."""

    kp_per_s2: Gain = 9.0
    kd_per_s: Gain = 6.0
    v_floor_m_s: Speed = 0.05

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.v_floor_m_s > self.max_v_m_s:
            raise ValueError(
                f"v_floor_m_s: {self.v_floor_m_s!r} is more than max_v_m_s = {self.max_v_m_s!r}; no speed would be left"
            )

    def law(self) -> "DynamicFeedback":
        return DynamicFeedback(self)


class DynamicFeedback(Law[DynamicFeedbackParameters]):
    """Velocities from position and speed; its state is the commanded speed, which the pilot keeps."""

    INNER = ("u_x_m_s2", "u_y_m_s2")

    def step(self, given: LawInput) -> Velocities:
        k, r, here, v = self.parameters, given.reference, given.posture, given.v_m_s
        sin, cos = sincos(here.theta_rad)
        sin_r, cos_r = sincos(r.posture.theta_rad)
        across_r = r.v_m_s * r.w_rad_s  # p_r'' across the path
        u_x = r.v_dot_m_s2 * cos_r - across_r * sin_r
        u_x += k.kd_per_s * (r.v_m_s * cos_r - v * cos) + k.kp_per_s2 * (r.posture.x_m - here.x_m)
        u_y = r.v_dot_m_s2 * sin_r + across_r * cos_r
        u_y += k.kd_per_s * (r.v_m_s * sin_r - v * sin) + k.kp_per_s2 * (r.posture.y_m - here.y_m)

        floor = k.v_floor_m_s
        w_rad_s = (u_y * cos - u_x * sin) / max(v, floor)
        v_m_s = v + given.period_s * (u_x * cos + u_y * sin)
        if r.v_m_s > 0.0:
            v_m_s = max(v_m_s, floor)
        return Velocities(v_m_s, w_rad_s, {"u_x_m_s2": u_x, "u_y_m_s2": u_y})
