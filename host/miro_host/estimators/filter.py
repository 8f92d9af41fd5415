"""A Kalman filter of posture, wheel radii, and the deviations of encoders and camera.

    0  x      m    posture at the time `at_s`
    1  y      m
    2  theta  rad
    3  left        radius of the left wheel over the nominal one
    4  right
    5  extra left  m    way of the left rim since the last encoder count minus the commanded way
    6  extra right m
    7  warp x m    displacement of the robot in the camera's measurement at this place
    8  warp y m

`size` is how many of them are estimated: 5 without encoders, or 9. The camera measures x + warp x, y + warp y and
theta, an encoder the way of a rim. Measurements with independent errors are taken one number after another, each in
Joseph's form P = (1 - k h) P (1 - k h)^T + k r k^T, of which only one half is computed: the covariance stays symmetric
and positive.
"""

from __future__ import annotations

import math

from miro_exact import dmath
from miro_exact.state import FLAG
from miro_host.estimators.motion import Motion

_N = 9
_LARGEST = 1.5
"""A wheel factor stays between this and its inverse."""
NONE = -1
_LARGE = 1e6


class Filter:
    """State and covariance (row by row, 9 x 9) at `at_s`, once a first measurement made them `known`.

    Drift is given as standard deviations per square root of a second: `position_m` per axis, `heading_rad`, `wheel` of
    each factor; `rim_m_s` is the standard deviation of a rim's mean speed in one period from what was commanded. The
    warp has the standard deviation `warp_m` and decorrelates over `warp_length_m` of way.
    """

    STATE = {
        "known": FLAG,
        "at_s": ("d", -_LARGE, _LARGE),
        "state": ("9d", -_LARGE, _LARGE),
        "covariance": ("81d", -_LARGE, _LARGE),
        "left_m": ("d", -_LARGE, _LARGE),
        "right_m": ("d", -_LARGE, _LARGE),
        "motion": Motion,
    }
    NOT_STATE = (
        *("size", "position_m", "heading_rad", "wheel", "rim_m_s", "warp_m", "warp_length_m"),
        *("effect_s", "period_s", "column", "lower"),
    )

    def __init__(
        self,
        size: int,
        motion: Motion,
        wheel_spread: float,
        drifts: tuple[float, float, float, float],
        warp_m: float = 0.0,
        warp_length_m: float = 1.0,
    ) -> None:
        """`drifts`: the four above, in their order."""
        self.size = size
        self.motion = motion
        self.position_m, self.heading_rad, self.wheel, self.rim_m_s = drifts
        self.warp_m = warp_m
        self.warp_length_m = warp_length_m
        self.effect_s = 0.0
        self.period_s = 1.0
        self.known = 0
        self.at_s = 0.0
        self.left_m = 0.0  # commanded way of the rim since its last count
        self.right_m = 0.0
        self.state = [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]
        self.covariance = [0.0] * 81
        self.column = [0.0] * 9
        self.lower = [0.0] * 25
        self.covariance[3 * _N + 3] = wheel_spread * wheel_spread
        self.covariance[4 * _N + 4] = wheel_spread * wheel_spread

    def __repr__(self) -> str:
        return f"Filter(known={self.known}, at_s={self.at_s}, state={list(self.state)})"

    def after_load(self) -> None:
        """Raises ValueError for values that no step can produce."""
        for index in (3, 4):
            if not 1.0 / _LARGEST <= self.state[index] <= _LARGEST:
                raise ValueError(f"the wheel factors {list(self.state)[3:5]} are those of no robot")
        if not -dmath.PI <= self.state[2] <= dmath.PI:
            raise ValueError(f"the heading {self.state[2]!r} is not between -pi and pi")
        for i in range(_N):
            for j in range(i):
                if self.covariance[i * _N + j] != self.covariance[j * _N + i]:
                    raise ValueError("the covariance is not symmetric")
        if self.known:  # the covariance of the first five is positive definite (Cholesky)
            for i in range(5):
                for j in range(i + 1):
                    self.lower[5 * i + j] = self.covariance[i * _N + j]
            self.factorise(5)

    def factorise(self, size: int) -> None:
        """Replaces a symmetric matrix in `lower`, row by row, by its Cholesky triangle. ValueError if there is none."""
        lower = self.lower
        for i in range(size):
            for j in range(i + 1):
                rest = lower[size * i + j]
                for k in range(j):
                    rest -= lower[size * i + k] * lower[size * j + k]
                if i > j:
                    lower[size * i + j] = rest / lower[size * j + j]
                elif rest > 0.0:
                    lower[size * i + i] = math.sqrt(rest)
                else:
                    raise ValueError("the covariance is not positive definite")

    def finite(self) -> bool:
        """True if every number is one."""
        total = self.at_s
        for index in range(_N):
            total += abs(self.state[index])
        for index in range(_N * _N):
            total += abs(self.covariance[index])
        return total - total == 0.0

    def command(self, left_m_s: float, right_m_s: float, effect_s: float, period_s: float) -> None:
        """A new period: the rim speeds that were sent a period ago, and when the next command takes effect."""
        self.motion.remember(left_m_s, right_m_s, period_s)
        self.effect_s = effect_s
        self.period_s = period_s

    def start(
        self, x_m: float, y_m: float, theta_rad: float, at_s: float, position_m2: float, heading_rad2: float
    ) -> None:
        """Posture as measured, with the variances of the measurement; the wheel factors as they are."""
        for index in range(_N):
            if index != 3 and index != 4:
                self.forget(index)
        self.covariance[0] = position_m2
        self.covariance[_N + 1] = position_m2
        self.covariance[2 * _N + 2] = heading_rad2
        if self.size == _N:
            self.covariance[7 * _N + 7] = self.warp_m * self.warp_m
            self.covariance[8 * _N + 8] = self.warp_m * self.warp_m
        self.state[0] = x_m
        self.state[1] = y_m
        self.state[2] = dmath.wrap_pi(theta_rad)
        self.at_s = at_s
        self.known = 1

    def forget(self, index: int) -> None:
        """A state that is 0 for certain, and has to do with no other."""
        self.state[index] = 0.0
        for other in range(_N):
            self.covariance[index * _N + other] = 0.0
            self.covariance[other * _N + index] = 0.0

    def run(self, to_s: float) -> None:
        """Predicts a copy of the posture to `to_s`; the result is in `motion`."""
        motion = self.motion
        motion.begin(self.state[0], self.state[1], self.state[2])
        motion.run(self.at_s, to_s, self.effect_s, self.period_s, self.state[3], self.state[4])

    def predict(self, to_s: float) -> None:
        """Moves state and covariance on to a later time: P = F P F^T + Q."""
        self.run(to_s)
        motion = self.motion
        time_s = to_s - self.at_s
        middle = self.state[2] + 0.5 * dmath.wrap_pi(motion.theta_rad - self.state[2])
        p = self.covariance
        n = self.size
        self.move(_N, 1)  # F P
        self.move(1, _N)  # (F P) F^T
        p[0] += self.position_m * self.position_m * time_s
        p[_N + 1] += self.position_m * self.position_m * time_s
        p[2 * _N + 2] += self.heading_rad * self.heading_rad * time_s
        p[3 * _N + 3] += self.wheel * self.wheel * time_s
        p[4 * _N + 4] += self.wheel * self.wheel * time_s
        rim_m2 = self.rim_m_s * self.rim_m_s * self.period_s * time_s
        sin, cos = dmath.sincos(middle)
        self.spread(5, motion.left_m2 + rim_m2, 0.5 * self.state[3], -self.state[3], cos, sin)
        self.spread(6, motion.right_m2 + rim_m2, 0.5 * self.state[4], self.state[4], cos, sin)
        if n == _N:
            self.warp_on(0.5 * (abs(motion.left_m) + abs(motion.right_m)))
        for i in range(n):
            for j in range(i):
                p[i * _N + j] = 0.5 * (p[i * _N + j] + p[j * _N + i])
                p[j * _N + i] = p[i * _N + j]
        self.state[0] = motion.x_m
        self.state[1] = motion.y_m
        self.state[2] = motion.theta_rad
        self.left_m += motion.left_m
        self.right_m += motion.right_m
        self.at_s = to_s

    def move(self, state: int, other: int) -> None:
        """Multiplies the covariance by F, whose rows (or columns) of x, y and theta change in this order.

        `state`: distance of the numbers of two neighbouring states; `other`: distance of those of one state with two
        others.
        """
        p = self.covariance
        motion = self.motion
        for index in range(self.size):
            x = index * other
            y, theta, left, right = x + state, x + 2 * state, x + 3 * state, x + 4 * state
            p[x] += motion.x_by_theta * p[theta] + motion.x_by_left * p[left] + motion.x_by_right * p[right]
            p[y] += motion.y_by_theta * p[theta] + motion.y_by_left * p[left] + motion.y_by_right * p[right]
            p[theta] += motion.theta_by_left * p[left] + motion.theta_by_right * p[right]

    def loosen(self, position_m2: float, heading_rad2: float) -> None:
        """Adds variances to the posture: something unknown moved the robot."""
        self.covariance[0] += position_m2
        self.covariance[_N + 1] += position_m2
        self.covariance[2 * _N + 2] += heading_rad2

    def spread(self, extra: int, variance: float, along: float, turn: float, cos: float, sin: float) -> None:
        """Adds g g^T times the variance of a rim's way: it moves the robot along, turns it, and is an extra."""
        p = self.covariance
        column = self.column
        column[0] = along * cos
        column[1] = along * sin
        column[2] = turn / self.motion.track_m
        for i in range(3):
            for j in range(3):
                p[i * _N + j] += column[i] * column[j] * variance
        if self.size == _N:
            for i in range(3):
                p[i * _N + extra] += column[i] * variance
                p[extra * _N + i] += column[i] * variance
            p[extra * _N + extra] += variance

    def warp_on(self, way_m: float) -> None:
        """Updates the warp after a way: a part of it decays and is replaced by new variance, so the total stays the
        same.
        """
        kept = max(1.0 - way_m / self.warp_length_m, 0.0)
        p = self.covariance
        for index in range(7, 9):
            self.state[index] *= kept
            for other in range(_N):
                p[index * _N + other] *= kept
                p[other * _N + index] *= kept
            p[index * _N + index] += (1.0 - kept * kept) * self.warp_m * self.warp_m

    def decompose(self, position_m2: float, heading_rad2: float) -> None:
        """The lower triangle l l^T = S of the camera's innovation. Raises ValueError unless S is positive."""
        p = self.covariance
        lower = self.lower
        for i in range(3):
            for j in range(i + 1):
                rest = p[i * _N + j]
                if i < 2:
                    rest += p[(i + 7) * _N + j]
                if j < 2:
                    rest += p[i * _N + j + 7]
                    if i < 2:
                        rest += p[(i + 7) * _N + j + 7]
                if i == j:
                    rest += position_m2 if i < 2 else heading_rad2
                lower[3 * i + j] = rest
        self.factorise(3)

    def distance2(
        self, x_m: float, y_m: float, theta_rad: float, position_m2: float, heading_rad2: float
    ) -> float:
        """e^T S^-1 e, the square of a measurement's distance in standard deviations."""
        self.decompose(position_m2, heading_rad2)
        lower = self.lower
        a = (x_m - self.state[0] - self.state[7]) / lower[0]
        b = (y_m - self.state[1] - self.state[8] - lower[3] * a) / lower[4]
        c = (dmath.wrap_pi(theta_rad - self.state[2]) - lower[6] * a - lower[7] * b) / lower[8]
        return a * a + b * b + c * c

    def along_m2(self, cos: float, sin: float, position_m2: float) -> float:
        """Variance of the camera's innovation in one direction, apart from that of the warp."""
        p = self.covariance
        return cos * cos * p[0] + 2.0 * cos * sin * p[1] + sin * sin * p[_N + 1] + position_m2

    def see(self, x_m: float, y_m: float, theta_rad: float, position_m2: float, heading_rad2: float) -> None:
        """Corrects by a measurement of the camera."""
        warp = self.size == _N
        self.correct(0, 7 if warp else NONE, x_m - self.state[0] - self.state[7], position_m2)
        self.correct(1, 8 if warp else NONE, y_m - self.state[1] - self.state[8], position_m2)
        self.correct(2, NONE, dmath.wrap_pi(theta_rad - self.state[2]), heading_rad2)
        self.tidy()

    def count(self, extra: int, extra_m: float, variance: float, gate: float) -> bool:
        """Corrects by the way of a rim beyond the commanded one since its last count, then restarts counting.

        Returns False, and only restarts counting, if the way is more than `gate` standard deviations from expectation.
        """
        innovation = extra_m - self.state[extra]
        believed = innovation * innovation <= gate * gate * (self.covariance[extra * _N + extra] + variance)
        if believed:
            self.correct(extra, NONE, innovation, variance)
            self.tidy()
        self.forget(extra)
        if extra == 5:
            self.left_m = 0.0
        else:
            self.right_m = 0.0
        return believed

    def correct(self, first: int, other: int, innovation: float, variance: float) -> None:
        """Takes one number that measures a state, or the sum of two."""
        p = self.covariance
        column = self.column
        n = self.size
        for i in range(n):
            column[i] = p[i * _N + first]
            if other >= 0:
                column[i] += p[i * _N + other]
        whole = column[first] + variance
        if other >= 0:
            whole += column[other]
        for i in range(n):
            gain = column[i] / whole
            self.state[i] += gain * innovation
            for j in range(i + 1):
                against = column[j] / whole
                p[i * _N + j] += gain * against * whole - gain * column[j] - column[i] * against
                p[j * _N + i] = p[i * _N + j]

    def tidy(self) -> None:
        """Heading and wheel factors in their ranges."""
        self.state[2] = dmath.wrap_pi(self.state[2])
        for index in range(3, 5):
            self.state[index] = min(max(self.state[index], 1.0 / _LARGEST), _LARGEST)
