"""A sine about an axis, with a speed ramp along the axis.

The ramp is that of the progress along the axis, not along the path: so position, velocities and accelerations have
closed forms. The price is that the speed on the path changes: it is `speed_m_s` at the crests and greatest on the axis.
"""

import math
from typing import Annotated

import msgspec
from msgspec import Meta

from miro_exact.dmath import atan2, sincos, wrap_pi
from miro_host.posture import Posture
from miro_host.references.interface import DEGREE, Reference, SamplingPace, with_polar_form
from miro_host.references.ramp import Ramp, RampedReference

FULL_TURN = 6.283185307179586


class Sine(msgspec.Struct, frozen=True):
    """At u m along the axis, f = `amplitude_m` sin(2 pi u / `wavelength_m`) to its left.

    With u' and u'' of the ramp, and derivatives of f by u: v = u' g, g = sqrt(1 + f'^2); theta = the axis' heading +
    atan(f'); w = f'' u' / g^2; v' = u'' g + u'^2 f' f'' / g; w' = (f'' u'' + f''' u'^2) / g^2 - 2 f' f''^2 u'^2 / g^4.
    """

    ramp: Ramp = Ramp()
    amplitude_m: float = 0.05
    wavelength_m: float = 0.60
    heading_rad: float = 0.0
    start_x_m: float = 0.0
    start_y_m: float = 0.0

    def at(self, t_s: float) -> Reference:
        """The reference at `t_s`; standstill at the ends outside the ramp's time."""
        u, u_dot, u_ddot = self.ramp.at(t_s)
        k = FULL_TURN / self.wavelength_m
        sin_ku, cos_ku = sincos(k * u)
        f = self.amplitude_m * sin_ku
        slope = self.amplitude_m * k * cos_ku
        bend = -(f * k * k)
        bend_rate = -(slope * k * k)
        g2 = 1.0 + slope * slope
        g = math.sqrt(g2)
        sin, cos = sincos(wrap_pi(self.heading_rad))
        at = Posture(
            self.start_x_m + u * cos - f * sin,
            self.start_y_m + u * sin + f * cos,
            wrap_pi(self.heading_rad + atan2(slope, 1.0)),
        )
        square = u_dot * u_dot
        return with_polar_form(
            at,
            u_dot * g,
            bend * u_dot / g2,
            u_ddot * g + square * slope * bend / g,
            (bend * u_ddot + bend_rate * square) / g2 - 2.0 * slope * bend * bend * square / (g2 * g2),
        )

    def pace(self, step_m: float, step_rad: float) -> SamplingPace:
        """Steepest on the axis, where a metre of it has sqrt(1 + (2 pi A / wavelength)^2); bent most at a crest."""
        k = FULL_TURN / self.wavelength_m
        steep, bend = self.amplitude_m * k, abs(self.amplitude_m) * k * k
        along_m = step_m / math.sqrt(1.0 + steep * steep)
        step_m = min(along_m, step_rad / bend) if bend else along_m
        return self.ramp.pace(step_m, math.inf, self.wavelength_m)


class SineRef(RampedReference, frozen=True, kw_only=True, tag="sine"):
    """A sine about an axis, from the axis on. `speed_m_s`, `ramp_s` and `drive_s` are those of a line along the axis.

    `heading_deg` is that of the axis. The path begins at atan(2 pi amplitude / wavelength) to its left; with a negative
    amplitude, to its right.
    """

    amplitude_cm: Annotated[float, Meta(ge=-100.0, le=100.0)] = 5.0
    wavelength_cm: Annotated[float, Meta(ge=1.0, le=1_000.0)] = 60.0

    def trajectory(self, duration_s: float) -> Sine:
        return Sine(
            self.ramp(duration_s),
            self.amplitude_cm / 100.0,
            self.wavelength_cm / 100.0,
            self.heading_deg * DEGREE,
            self.start_x_cm / 100.0,
            self.start_y_cm / 100.0,
        )
