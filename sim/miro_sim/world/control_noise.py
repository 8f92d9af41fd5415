"""Noise in the control signal: what the paper's analogue link added to a command, as a valid frame carries it.

Yang & Kim, section V-A, disturbance 2: "The control commands are sent to the mobile robot as the RF signal,
which is inevitably contaminated with added noises ... the upper bounds of the noises were set
heuristically." A digital frame has no such noise, so it is put where that signal had it: behind controller
and integrator, which never see it, and before the frame is made, so that its CRC is good.

Chosen, because the paper gives neither bounds nor distribution: v and w of every robot get a draw each, once a
control period, uniform within +- the bound and independent. Wheel limits and rounding follow, so what is sent is
always a command that might have been meant.
"""

from __future__ import annotations

from miro_exact.rng import Stream
from miro_host.pilot import WheelCommand
from miro_host.wheels import Wheels
from miro_sim.scenario.keys import ControlNoise


class NoisyCommands:
    """The noise of one robot: command and number of the control period in, wheel speeds to send out."""

    def __init__(self, bounds: ControlNoise, wheels: Wheels, seed: int, name: str) -> None:
        self.bounds = bounds
        self.wheels = wheels
        self.stream = Stream(seed, name)

    def __repr__(self) -> str:
        return f"NoisyCommands({self.bounds!r}, {self.stream!r})"

    def wheels_of(self, command: WheelCommand, period: int) -> tuple[int, int]:
        """(left, right) in 1/256 count per sample, of a command sent in control period `period`."""
        if self.bounds.v_m_s == 0.0 and self.bounds.w_rad_s == 0.0:
            return command.left, command.right
        v_m_s = command.v_m_s + self._draw(2 * period, self.bounds.v_m_s)
        w_rad_s = command.w_rad_s + self._draw(2 * period + 1, self.bounds.w_rad_s)
        return self.wheels.command(v_m_s, w_rad_s, command.left_factor, command.right_factor)

    def _draw(self, index: int, bound: float) -> float:
        return bound * (2.0 * self.stream.uniform(index) - 1.0)
