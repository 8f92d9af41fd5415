"""Predicts a robot's motion under the sent commands, with the derivatives of the end by the start.

    speed
      ^          to ________________        A command takes effect at time 0 and is held until the next one.
      |           /                         The rim's speed goes from `start` to `to` with the LM629's slope,
      |  start __/                          and stays there. A step of more than slope times period is not
      +---------+--+---------------+-> t    finished when the next command takes effect.
                0  ramp            period

Speeds are for wheels with the nominal radius; a wheel with a radius factor goes that way times its factor. In one arc
the robot goes v = (l fl + r fr) / 2 and turns by w = (r fr - l fl) / track. Its chord has the direction theta + w/2 and
the length v sin(w/2) / (w/2). The derivative leaves the last quotient as it is; for w = 0.1 rad it is 0.9996. While a
rim's speed changes the path is no exact circle: a change of both rims by 0.1 m/s in opposite senses at 1 m/s costs 0.07
mm.
"""

from __future__ import annotations

from miro_exact import dmath

KEPT = 16
"""Periods of commands that are remembered, 0.53 s: more than the longest age_s + dead_s + lag_s of 0.5 s."""
_KEPT = 16  # the same as a C constant
_SPEEDS = ("16d", -1e3, 1e3)


class Motion:
    """Stored commands, the latest first: `*_to_m_s` as sent, `*_start_m_s` when they took effect.

    `run` leaves its results in the other fields: the end `x_m`, `y_m`, `theta_rad`; the ways of the rims, for wheels of
    the nominal radius, `left_m`, `right_m`; their variances in m2, with `doubt` as standard deviation of the disobeyed
    share of a command's change; and derivatives, named `of_by`, by heading and factors.
    """

    STATE = {
        "left_start_m_s": _SPEEDS,
        "left_to_m_s": _SPEEDS,
        "right_start_m_s": _SPEEDS,
        "right_to_m_s": _SPEEDS,
    }
    NOT_STATE = (
        *("track_m", "slope_m_s2", "doubt", "x_m", "y_m", "theta_rad", "left_m", "right_m"),
        *("left_m2", "right_m2", "x_by_theta", "x_by_left", "x_by_right", "y_by_theta", "y_by_left"),
        *("y_by_right", "theta_by_left", "theta_by_right"),
    )

    def __init__(self, track_m: float, slope_m_s2: float, doubt: float) -> None:
        self.track_m = track_m
        self.slope_m_s2 = slope_m_s2
        self.doubt = doubt
        self.left_start_m_s = [0.0] * 16
        self.left_to_m_s = [0.0] * 16
        self.right_start_m_s = [0.0] * 16
        self.right_to_m_s = [0.0] * 16
        self.begin(0.0, 0.0, 0.0)

    def __repr__(self) -> str:
        return f"Motion(left_to_m_s={list(self.left_to_m_s)}, right_to_m_s={list(self.right_to_m_s)})"

    def remember(self, left_m_s: float, right_m_s: float, period_s: float) -> None:
        """Stores a command, which takes effect when the one before it has been held for a period."""
        left_start = self.speed(self.left_start_m_s[0], self.left_to_m_s[0], period_s)
        right_start = self.speed(self.right_start_m_s[0], self.right_to_m_s[0], period_s)
        for index in range(_KEPT - 1, 0, -1):
            self.left_start_m_s[index] = self.left_start_m_s[index - 1]
            self.left_to_m_s[index] = self.left_to_m_s[index - 1]
            self.right_start_m_s[index] = self.right_start_m_s[index - 1]
            self.right_to_m_s[index] = self.right_to_m_s[index - 1]
        self.left_start_m_s[0] = left_start
        self.left_to_m_s[0] = left_m_s
        self.right_start_m_s[0] = right_start
        self.right_to_m_s[0] = right_m_s

    def speed(self, start_m_s: float, to_m_s: float, time_s: float) -> float:
        """Speed of a rim `time_s` after a command's effect."""
        length_s = abs(to_m_s - start_m_s) / self.slope_m_s2
        if time_s >= length_s:
            return to_m_s
        return start_m_s + (to_m_s - start_m_s) * (time_s / length_s)

    def begin(self, x_m: float, y_m: float, theta_rad: float) -> None:
        """The beginning of a path: no way yet."""
        self.x_m = x_m
        self.y_m = y_m
        self.theta_rad = theta_rad
        self.left_m = self.right_m = self.left_m2 = self.right_m2 = 0.0
        self.x_by_theta = self.x_by_left = self.x_by_right = 0.0
        self.y_by_theta = self.y_by_left = self.y_by_right = 0.0
        self.theta_by_left = self.theta_by_right = 0.0

    def run(
        self,
        from_s: float,
        to_s: float,
        effect_s: float,
        period_s: float,
        left_factor: float,
        right_factor: float,
    ) -> None:
        """Goes on between two times as far as commands are remembered; the next one takes effect at `effect_s`."""
        index = _KEPT - 1
        oldest = (effect_s - from_s) / period_s
        if oldest < 15.0:
            index = int(oldest)
        while index >= 0:
            since_s = effect_s - (index + 1) * period_s
            begin_s = max(from_s - since_s, 0.0)
            end_s = min(to_s - since_s, period_s)
            if begin_s < end_s:
                self.hold(index, begin_s, end_s, left_factor, right_factor)
            index -= 1

    def hold(self, index: int, begin_s: float, end_s: float, left_factor: float, right_factor: float) -> None:
        """Integrates one command between two times after its effect, split where a ramp ends."""
        left_start = self.left_start_m_s[index]
        left_to = self.left_to_m_s[index]
        right_start = self.right_start_m_s[index]
        right_to = self.right_to_m_s[index]
        left_s = abs(left_to - left_start) / self.slope_m_s2
        right_s = abs(right_to - right_start) / self.slope_m_s2
        first_s = min(left_s, right_s)
        second_s = max(left_s, right_s)
        from_s = begin_s
        for cut in range(3):
            to_s = end_s
            if cut == 0 and first_s < end_s:
                to_s = first_s
            elif cut == 1 and second_s < end_s:
                to_s = second_s
            if to_s > from_s:
                half_s = 0.5 * (to_s - from_s)
                left = self.speed(left_start, left_to, from_s) + self.speed(left_start, left_to, to_s)
                right = self.speed(right_start, right_to, from_s) + self.speed(right_start, right_to, to_s)
                self.arc(half_s * left, half_s * right, left_factor, right_factor)
                from_s = to_s
        doubt_s = self.doubt * (end_s - begin_s)
        self.left_m2 += (doubt_s * (left_to - left_start)) * (doubt_s * (left_to - left_start))
        self.right_m2 += (doubt_s * (right_to - right_start)) * (doubt_s * (right_to - right_start))

    def arc(self, left_m: float, right_m: float, left_factor: float, right_factor: float) -> None:
        """The rims go these ways at a constant ratio."""
        length = 0.5 * (left_m * left_factor + right_m * right_factor)
        half = 0.5 * (right_m * right_factor - left_m * left_factor) / self.track_m
        sin, cos = dmath.sincos(self.theta_rad + half)
        shrink = 1.0 - half * half / 6.0  # of sin(h) / h = 1 - h^2 / 6 + h^4 / 120
        if half > 0.01 or half < -0.01:
            shrink = dmath.sin(half) / half
        dx = shrink * cos
        dy = shrink * sin
        self.x_m += length * dx
        self.y_m += length * dy
        self.theta_rad = dmath.wrap_pi(self.theta_rad + 2.0 * half)
        self.left_m += left_m
        self.right_m += right_m
        middle_left = self.theta_by_left - 0.5 * left_m / self.track_m  # of the chord's direction
        middle_right = self.theta_by_right + 0.5 * right_m / self.track_m
        self.x_by_theta -= length * dy
        self.y_by_theta += length * dx
        self.x_by_left += 0.5 * left_m * dx - length * dy * middle_left
        self.y_by_left += 0.5 * left_m * dy + length * dx * middle_left
        self.x_by_right += 0.5 * right_m * dx - length * dy * middle_right
        self.y_by_right += 0.5 * right_m * dy + length * dx * middle_right
        self.theta_by_left -= left_m / self.track_m
        self.theta_by_right += right_m / self.track_m
