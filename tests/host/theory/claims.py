"""Prints what the paper claims beside what its law does on robots without delay, noise or quantum.

python -m tests.host.theory.claims [--starts 100]
"""

import argparse
import math
from itertools import pairwise

import numpy as np

from miro_host.posture import Posture
from miro_host.references.arc import StraightLine
from miro_sim.scenario.file import load
from mirotwin.recording.theory.track import HALF_PI, across
from tests.host.theory import ideal, stability
from tests.host.theory.ideal import PRINTED, ROBOT


def figures():
    for law in ideal.LAWS:
        for name in ideal.STARTS:
            distance, turn, settled = ideal.figure(law, name)
            text = f"{100 * distance:.2f} cm, {math.degrees(turn):.2f} degrees, settled after {settled:.2f} s"
            yield f"{name}, {law} law: end", text


def parallel():
    """A4: theta_e = 0, 4 cm beside the line."""
    rows = ideal.run_parallel_to_the_line()
    phi = [math.atan2(row.posture.y_m, row.posture.x_m) for row in (rows[0], rows[-1])]
    yield "4 cm beside the line with theta_e = 0: after 6 s", f"{100 * rows[-1].posture.y_m:.4f} cm beside it"
    yield ".. phi_e", f"{phi[0]:.3f} to {phi[1]:.4f} rad"


def slopes():
    """A5."""
    for law in ideal.LAWS:
        yield f"slope of final against initial lateral error, {law} law", f"{ideal.lateral_slope(law):.6f}"


def lyapunov():
    """A6."""
    for name, worst in (("a sine", False), ("the worst f", True)):
        run = ideal.lyapunov_run(StraightLine(), (0.07, 0.10, -0.38), 2.0, 5.0, (0.3, 1.0), worst)
        steps = [
            two.v - one.v
            for one, two in pairwise(run)
            if not (one.crossed_before(two) or one.near_a_surface())
        ]
        yield f"largest rise of V in a step, {name} below P", f"{max(steps):.1e} in {len(steps)} steps"
    for before, after, expected in jumps():
        yield (
            "V at a crossing of theta_e",
            f"{before:.3f} to {after:.3f}; 2 |theta_e'| |phi_e| = {expected:.3f}",
        )


def jumps():
    """V before and after each crossing of theta_e = 0 at which it jumps, and the jump that the formula gives."""
    for one, two in pairwise(ideal.run_across_theta_e_0()):
        expected = stability.jump(one.turn, one.phi_e)
        if one.crossed_before(two) and expected > 0.01:
            yield one.v, two.v, expected


def rising_shares():
    """Per cent of states near the line inside the layer of theta_e in which V rises, f = 0: of each set of gains as in
    (16), and of the first with the layer's derivative in u2.
    """
    sets = [stability.NO_GUARD, *(stability.unguarded(gains_of_scenario(name)) for name in ("fig6", "fig8"))]
    return [100 * stability.rising(gains) for gains in (*sets, stability.SLOPED)]


def gains_of_scenario(name):
    """The gains of the paper's law in a scenario."""
    return load(name).scenario.networks[0].robot[0].controller


def layer():
    """V' inside the boundary layer of theta_e, with f = 0, over states near the line."""
    whose = ("the library's gains", "fig6's", "fig8's", "the library's, with the layer's derivative")
    for what, share in zip(whose, rising_shares(), strict=True):
        yield f"states inside the layer in which V rises, {what}", f"{share:.0f} %"


def random_ends(law, count):
    """Of so many random starts: within 3 cm, parallel to the line, beyond 1 m."""
    x, y, theta = np.transpose([ideal.final_place(law, e, 0.004) for e in ideal.random_starts(count)])
    off = np.hypot(x, y)
    aside = (off >= 0.03) & (off <= 1.0) & (abs(theta) < 0.05) & (abs(x) < 0.1)
    return sum(off < 0.03), sum(aside), sum(off > 1.0)


def starts(count):
    """A7."""
    for law in ideal.LAWS:
        there, aside, opposite = random_ends(law, count)
        text = f"{there} of {count} within 3 cm, {aside} parallel to the line, {opposite} beyond 1 m"
        yield f"random starts, {law} law", text


def remark_1_of(alpha):
    """Of a robot that stands alpha off the limit 30 cm from the origin: u1 in m/s2, the greatest torque of a wheel in
    mNm and the work in mJ in half a second, and how near it gets to the limit in rad.
    """
    path, start = StraightLine(), Posture(0.3, 0.0, HALF_PI - alpha)
    rows = list(ideal.simulated(ideal.paper_law(PRINTED, path), start, (0.0, 0.0), 1.0, 1.5, 0.0002))
    turns = np.array([(row.w_rad_s * ROBOT.track_m * 0.5) for row in rows])
    speeds = np.array([row.v_m_s for row in rows])
    torques = np.array([row.torque_nm for row in rows])
    rims = np.stack([speeds - turns, speeds + turns], axis=1)
    work = 0.0002 * np.abs(torques * rims).sum() / ROBOT.wheel_radius_m
    u1 = max(abs(row.demand[0]) for row in rows)
    return u1, 1000 * abs(torques).max(), 1000 * work, min(abs(across(row.posture)) for row in rows)


def remark_1():
    """u1, torque and work from several angles."""
    for alpha in (1.0, 0.3, 0.1, 0.03, 0.01):
        u1, torque, work, nearest = remark_1_of(alpha)
        text = f"{u1:.1f} m/s2, {torque:.0f} mNm at a wheel, {work:.1f} mJ (nearest {nearest:.3f} rad)"
        if u1 > 1000.0:
            text = "above 1000 m/s2: the limit is reached"
        yield f"largest u1 in 0.5 s from alpha = {alpha:g}", text


def main():
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("--starts", type=int, default=100, help="how many random starts each law gets")
    count = arguments.parse_args().starts
    for part in (figures(), parallel(), slopes(), lyapunov(), layer(), starts(count), remark_1()):
        for what, measured in part:
            print(f"{what:72} {measured}")


if __name__ == "__main__":
    main()
