"""Prints what the paper claims beside what its law does on robots without delay, noise or quantum.

python -m tests.host.theory.claims [--starts 100]
"""

import argparse
import math
from itertools import pairwise

from rich.console import Console
from rich.table import Table

from miro_host.posture import Posture
from miro_host.references.line import StraightLine
from miro_host.theory import HALF_PI, across
from tests.host.theory import ideal, stability
from tests.host.theory.ideal import PRINTED, ROBOT, STARTS, beside, paper_law
from tests.host.theory.layer import NO_GUARD, rising
from tests.host.theory.simulation import BodySimulation


def figures():
    for law in ideal.LAWS:
        for name in STARTS:
            distance, turn, settled = ideal.figure(law, name)
            text = f"{100 * distance:.2f} cm, {abs(math.degrees(turn)):.2f} degrees, settled after {settled:.2f} s"
            yield f"{name}, {law} law: end", text


def parallel():
    """A4: theta_e = 0, 4 cm beside the line."""
    path = StraightLine()
    _, z = beside(path, 0.75, 0.0, 0.04, 0.0)
    start = Posture(math.sqrt(path.at(0.75).rho_m ** 2 - 0.04**2), 0.04, 0.0)
    rows = list(BodySimulation(ROBOT, paper_law(PRINTED, path)).run(start, z, 0.75, 6.0, 0.001))
    phi = [math.atan2(row.posture.y_m, row.posture.x_m) for row in (rows[0], rows[-1])]
    yield "4 cm beside the line with theta_e = 0: after 6 s", f"{100 * rows[-1].posture.y_m:.4f} cm beside it"
    yield ".. phi_e", f"{phi[0]:.3f} to {phi[1]:.4f} rad"


def slopes():
    """A5."""
    for law in ideal.LAWS:
        yield f"slope of final against initial lateral error, {law} law", f"{ideal.lateral_slope(law):.6f}"


def lyapunov():
    """A6."""
    for name, f, worst in (("a sine", (0.3, 1.0), False), ("the worst f", (0.3, 1.0), True)):
        run = ideal.lyapunov_run(StraightLine(), (0.07, 0.10, -0.38), 2.0, 5.0, f, worst)
        steps = [
            two.v - one.v
            for one, two in pairwise(run)
            if not (one.crossed_before(two) or one.near_a_surface())
        ]
        yield f"largest rise of V in a step, {name} below P", f"{max(steps):.1e} in {len(steps)} steps"
    run = ideal.lyapunov_run(
        StraightLine(), (0.07, 0.30, -0.2), 2.0, 2.5, (0.0, 0.0), False, gamma2=0.3, turn=1.0, step_s=1e-4
    )
    for one, two in pairwise(run):
        expected = stability.jump(one.turn, one.phi_e)
        if one.crossed_before(two) and expected > 0.01:
            yield (
                "V at a crossing of theta_e",
                f"{one.v:.3f} to {two.v:.3f}; 2 |theta_e'| |phi_e| = {expected:.3f}",
            )


def layer():
    """V' inside the boundary layer of theta_e, with f = 0, over states near the line."""
    width = NO_GUARD.layer_theta_rad
    for what, added in (("as in (16)", False), ("with the layer's derivative", True)):
        yield (
            f"states inside the layer in which V rises, u2 {what}",
            f"{100 * rising(0.9 * width, added):.0f} %",
        )


def starts(count):
    """A7."""
    for law in ideal.LAWS:
        ends = [ideal.final_place(law, error, 0.004) for error in ideal.random_starts(count)]
        there = len([1 for x, y, _ in ends if math.hypot(x, y) < 0.03])
        opposite = len([1 for x, y, _ in ends if math.hypot(x, y) > 1.0])
        parallel = len(
            [
                1
                for x, y, theta in ends
                if 0.03 <= math.hypot(x, y) <= 1.0 and abs(theta) < 0.05 and abs(x) < 0.1
            ]
        )
        text = f"{there} of {count} within 3 cm, {parallel} parallel to the line, {opposite} beyond 1 m"
        yield f"random starts, {law} law", text


def remark_1():
    """u1, the greatest torque and the work of a robot that stands alpha off the limit 30 cm from the origin."""
    for alpha in (1.0, 0.3, 0.1, 0.03, 0.01):
        path, start = StraightLine(), Posture(0.3, 0.0, HALF_PI - alpha)
        rows = list(BodySimulation(ROBOT, paper_law(PRINTED, path)).run(start, (0.0, 0.0), 1.0, 1.5, 0.0002))
        work, step_s = 0.0, 0.0002
        for row in rows:
            half = 0.5 * ROBOT.track_m * row.w_rad_s
            left, right = row.v_m_s - half, row.v_m_s + half
            rates = row.torque_nm[0] * left, row.torque_nm[1] * right
            work += step_s * (abs(rates[0]) + abs(rates[1])) / ROBOT.wheel_radius_m
        u1 = max(abs(row.demand[0]) for row in rows)
        torque = max(abs(value) for row in rows for value in row.torque_nm)
        nearest = min(abs(across(row.posture)) for row in rows)
        text = f"{u1:.1f} m/s2, {1000 * torque:.0f} mNm at a wheel, {1000 * work:.1f} mJ (nearest {nearest:.3f} rad)"
        if u1 > 1000.0:
            text = "above 1000 m/s2: the limit is reached"
        yield f"largest u1 in 0.5 s from alpha = {alpha:g}", text


def main():
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("--starts", type=int, default=100, help="how many random starts each law gets")
    count = arguments.parse_args().starts
    table = Table(box=None, pad_edge=False)
    table.add_column("what")
    table.add_column("measured")
    for part in (figures(), parallel(), slopes(), lyapunov(), layer(), starts(count), remark_1()):
        for what, measured in part:
            table.add_row(what, measured)
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
