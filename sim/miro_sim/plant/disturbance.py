"""The force and the yaw torque that disturb one robot's body, as a function of the tick.

Noise is uniform within +- its bound and holds for a period: draws 2 k (force) and 2 k + 1 (torque) in period k.
"""

from __future__ import annotations

from miro_exact import dmath
from miro_exact.rng import Stream
from miro_sim.plant.params import Disturbance

TURN = 6.283185307179586
TICKS_PER_S = 24e6


class DisturbingForce:
    """`at` puts force (N, forward) and torque (Nm, counter-clockwise) of a tick into `force_n` and `torque_nm`."""

    NOT_STATE = ("*",)

    def __init__(self, params: Disturbance, stream: Stream) -> None:
        self.stream = stream
        self.period_ticks = int(params.period_s * TICKS_PER_S + 0.5)
        self.constant_n = params.force_n
        self.constant_nm = params.torque_nm
        self.sine_n = params.sine_force_n
        self.sine_nm = params.sine_torque_nm
        self.noise_n = params.noise_force_n
        self.noise_nm = params.noise_torque_nm
        self.is_on = params.is_on()
        self.varies = self.sine_n != 0.0 or self.sine_nm != 0.0
        self.force_n = 0.0
        self.torque_nm = 0.0

    def at(self, tick: int) -> None:
        """Works out both for this tick."""
        if not self.is_on:
            return
        force = self.constant_n
        torque = self.constant_nm
        if self.varies:
            share = float(tick % self.period_ticks) / float(self.period_ticks)
            sine, _ = dmath.sincos(TURN * share)
            force = force + self.sine_n * sine
            torque = torque + self.sine_nm * sine
        if self.noise_n != 0.0 or self.noise_nm != 0.0:
            period = tick // self.period_ticks
            force = force + self.noise_n * (2.0 * self.stream.uniform(2 * period) - 1.0)
            torque = torque + self.noise_nm * (2.0 * self.stream.uniform(2 * period + 1) - 1.0)
        self.force_n = force
        self.torque_nm = torque

    def __repr__(self) -> str:
        return f"DisturbingForce({self.force_n!r} N, {self.torque_nm!r} Nm)"
