"""A robot that does at once what the law says: unicycle (8), dynamics (15), no delay, noise, limit or quantum."""

import math
from dataclasses import dataclass

from miro_host.laws.interface import LawInput
from miro_host.posture import Posture


@dataclass
class Row:
    """One step: time, posture, reference, what the law saw and answered."""

    t: float
    posture: Posture
    reference: object
    control: object


def drive(law, path, posture, z, start_s, end_s, step_s=0.001, disturbance=lambda t: (0.0, 0.0)):
    """Rows from `start_s` on; z = (v, w) at the start; `disturbance` is f of equation (15)."""
    x, y, theta = posture
    v, w = z
    rows = []
    for index in range(round((end_s - start_s) / step_s)):
        t = start_s + index * step_s
        reference, here = path.at(t), Posture(x, y, theta)
        control = law.control(reference, here, v, w)
        rows.append(Row(t, here, reference, control))
        f1, f2 = disturbance(t)
        v_dot = reference.v_dot_m_s2 + control.u1 - f1
        w_dot = reference.w_dot_rad_s2 + control.u2 - f2
        middle = theta + 0.5 * step_s * (w + 0.5 * step_s * w_dot)
        x += step_s * (v + 0.5 * step_s * v_dot) * math.cos(middle)
        y += step_s * (v + 0.5 * step_s * v_dot) * math.sin(middle)
        theta += step_s * (w + 0.5 * step_s * w_dot)
        v += step_s * v_dot
        w += step_s * w_dot
    return rows


def drive_at_velocities(law, path, posture, start_s, end_s, step_s=0.001):
    """The same for a law that answers velocities; a row's `control` is the answer."""
    x, y, theta = posture
    v, w, rows = 0.0, 0.0, []
    for index in range(round((end_s - start_s) / step_s)):
        t = start_s + index * step_s
        reference, here = path.at(t), Posture(x, y, theta)
        answer = law.step(LawInput(t, step_s, reference, path, here, v, w))
        rows.append(Row(t, here, reference, answer))
        v, w = answer.v_m_s, answer.w_rad_s
        middle = theta + 0.5 * step_s * w
        x += step_s * v * math.cos(middle)
        y += step_s * v * math.sin(middle)
        theta += step_s * w
    return rows
