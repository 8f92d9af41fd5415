"""The robot under its law at the level of torques, in continuous time: equations (8) or (9), (10) and (14).

    demand z_r' + u ─► (14) tau = H z_r' + G + H u ─► (10) H z' + G + tau_d = tau ─► (8) or (9) q' = S z

The law is asked in every stage of a step. Where a sign function switches, the method is of order 1, and a surface is
held within what the law does in one step.
"""

import msgspec

from miro_exact.dmath import atan2, sincos
from miro_host.integrator import clamp
from miro_host.posture import Posture
from miro_host.theory import radius
from tests.host.theory import computed_torque
from tests.host.theory.matrices import Vector, solution, times
from tests.host.theory.unicycle import cartesian_rates, inertia, polar_rates


class SimulatedStep(msgspec.Struct, frozen=True):
    """The robot at the beginning of a step, its heading unwrapped, and what was demanded and applied there."""

    t_s: float
    posture: Posture
    v_m_s: float
    w_rad_s: float
    demand: tuple[float, float]
    torque_nm: Vector


def no_disturbance(t_s):
    return [0.0, 0.0]


class BodySimulation:
    """A body with a law. `disturbance` is tau_d in Nm at the wheels; `model` the body that the law believes in.

    With `limits` demands are clamped as the host's integrator does it, and no speed is raised above its limit.
    """

    def __init__(
        self, body, demand, *, disturbance=no_disturbance, model=None, limits=None, chart="cartesian"
    ):
        self.demand = demand
        self.disturbance = disturbance
        self.limits = limits
        self.chart = chart
        self._model = inertia(model or body)
        self._inverse = solution(inertia(body), [[1.0, 0.0], [0.0, 1.0]])
        self._rates = polar_rates if chart == "polar" else cartesian_rates

    def run(self, start, z, start_s, end_s, step_s):
        """Rows from `start_s` to `end_s`, both included. Raises ValueError unless that is a whole number of steps."""
        count = round((end_s - start_s) / step_s)
        if count < 0 or abs(count * step_s - (end_s - start_s)) > 1e-6 * step_s:
            raise ValueError(f"{start_s} to {end_s} s is no whole number of steps of {step_s} s")
        state = [*self._coordinates(start), *z]
        for index in range(count + 1):
            t = start_s + index * step_s
            posture = self._posture(state)
            demanded, torque = self._drive(t, posture, state[3], state[4])
            yield SimulatedStep(t, posture, state[3], state[4], demanded, torque)
            state = self._stepped(t, state, step_s)

    def _stepped(self, t, state, step):
        half = 0.5 * step
        k1 = self._derivative(t, state)
        k2 = self._derivative(t + half, _moved(state, half, k1))
        k3 = self._derivative(t + half, _moved(state, half, k2))
        k4 = self._derivative(t + step, _moved(state, step, k3))
        sixth = step / 6.0
        return [
            x + sixth * (a + 2.0 * b + 2.0 * c + d)
            for x, a, b, c, d in zip(state, k1, k2, k3, k4, strict=True)
        ]

    def _derivative(self, t, state):
        q, v, w = state[:3], state[3], state[4]
        _, applied = self._drive(t, self._posture(state), v, w)
        against = self.disturbance(t)
        z_dot = times(
            self._inverse, [one - other for one, other in zip(applied, against, strict=True)]
        )  # (10), G = 0
        return [*self._rates(q, [v, w]), *z_dot]

    def _drive(self, t, posture, v, w):
        """What is demanded, and the torques of equation (14)."""
        v_dot, w_dot = self.demand(t, posture, v, w)
        limits = self.limits
        if limits is not None:
            v_dot = _limited(v, clamp(v_dot, limits.max_v_dot_m_s2), limits.max_v_m_s)
            w_dot = _limited(w, clamp(w_dot, limits.max_w_dot_rad_s2), limits.max_w_rad_s)
        return (v_dot, w_dot), computed_torque.torque(self._model, [0.0, 0.0], [v_dot, w_dot])

    def _coordinates(self, posture):
        if self.chart == "cartesian":
            return [posture.x_m, posture.y_m, posture.theta_rad]
        return [radius(posture), atan2(posture.y_m, posture.x_m), posture.theta_rad]

    def _posture(self, state):
        if self.chart == "cartesian":
            return Posture(state[0], state[1], state[2])
        sin, cos = sincos(state[1])
        return Posture(state[0] * cos, state[0] * sin, state[2])


def _moved(state, time, rates):
    return [x + time * rate for x, rate in zip(state, rates, strict=True)]


def _limited(speed, rate, most):
    """The rate, or 0 where it would raise a speed that is at its limit."""
    return 0.0 if abs(speed) >= most and speed * rate > 0.0 else rate
