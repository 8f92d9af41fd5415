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


def noisy(
    command: WheelCommand, bounds: ControlNoise, wheels: Wheels, draws: Stream, period: int
) -> tuple[int, int]:
    """(left, right) in 1/256 count per sample, of a command sent in control period `period`."""
    if bounds.v_m_s == 0.0 and bounds.w_rad_s == 0.0:
        return command.left, command.right
    v_m_s = command.v_m_s + bounds.v_m_s * (2.0 * draws.uniform(2 * period) - 1.0)
    w_rad_s = command.w_rad_s + bounds.w_rad_s * (2.0 * draws.uniform(2 * period + 1) - 1.0)
    return wheels.command(v_m_s, w_rad_s, command.left_factor, command.right_factor)
