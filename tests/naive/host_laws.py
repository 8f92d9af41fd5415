"""Twins of the laws beside the paper's: their published formulas with complex numbers, in 40-digit arithmetic.

A vector of the plane is a complex number, so that turning it is a product, and the derivatives that the laws need are
taken numerically along the motion. Nothing is shared with the code under test.
"""

from mpmath import cos, diff, expj, mp, mpc, mpf, sin, sqrt

from tests.naive.host_control import sgn as switched
from tests.naive.host_control import wrapped

mp.dps = 40


def seen_from(robot, reference):
    """The reference's posture in the robot's axes."""
    x, y, theta = map(mpf, robot)
    x_r, y_r, theta_r = map(mpf, reference)
    vector = mpc(x_r - x, y_r - y) * expj(-theta)
    return vector.real, vector.imag, wrapped(theta_r - theta)


def kanayama(kx, ky, ktheta, robot, reference, v_r, w_r):
    x, y, theta = seen_from(robot, reference)
    return v_r * cos(theta) + kx * x, w_r + v_r * (ky * y + ktheta * sin(theta))


def dynamic_feedback(kp, kd, robot, v, reference, v_r, w_r, v_dot_r):
    """v' and w for v > 0: the acceleration u in world axes, turned into the robot's."""
    along = expj(mpf(reference[2]))
    u = (v_dot_r + mpc(0, 1) * v_r * w_r) * along
    u += kd * (v_r * along - v * expj(mpf(robot[2])))
    u += kp * mpc(mpf(reference[0]) - mpf(robot[0]), mpf(reference[1]) - mpf(robot[1]))
    u *= expj(-mpf(robot[2]))
    return u.real, u.imag / v


def surfaces(gamma1, gamma2, a, width, robot, z, reference, z_r):
    """s1, s2 of the body-frame law for a robot at `robot` with z = (v, w); the same for the reference.

    The rates come from two postures a moment later, each moved along its own tangent.
    """

    def moved(posture, velocities, dt):
        x, y, theta = map(mpf, posture)
        v, w = velocities
        return x + dt * v * cos(theta), y + dt * v * sin(theta), theta + dt * w

    def errors(dt):
        x, y, theta = seen_from(moved(robot, z, dt), moved(reference, z_r, dt))
        return x, theta + a * y / sqrt(width**2 + y**2)

    x, e = errors(mpf(0))
    s1 = diff(lambda dt: errors(dt)[0], 0) + gamma1 * x
    s2 = diff(lambda dt: errors(dt)[1], 0) + gamma2 * e
    return s1, s2


def epsilon_tracking(gains, robot, reference, z_r):
    """v and w of the epsilon-tracking law for unwrapped headings; z_r = (v_r, w_r).

    `gains` is a dict: epsilon, alpha, beta, length, invariant, width (None: sign). With X = x1 + i x2 and E = X - X*
    the law is U = U* - (pull + i beta sgn(sigma)) E; U* and v follow from X's numerical derivative along the motion.
    """
    g = {name: value if value is None else mpf(value) for name, value in gains.items()}

    def state(posture, z, dt):
        x, y, theta = map(mpf, posture)
        v, w = map(mpf, z)
        vector = mpc(x + dt * v * cos(theta), y + dt * v * sin(theta)) * expj(-theta - dt * w) / g["length"]
        heading = theta + dt * w
        return mpc(heading, vector.real), heading * vector.real + 2 * vector.imag

    (x_c, x3_c), (x_r, x3_r) = state(robot, (0, 0), mpf(0)), state(reference, (0, 0), mpf(0))
    u_r = (
        diff(lambda dt: state(reference, z_r, dt)[0].real, 0),
        diff(lambda dt: state(reference, z_r, dt)[0].imag, 0),
    )
    e = x_c - x_r
    sigma = x3_c - x3_r - (x_r.conjugate() * e).imag * gains["invariant"]
    near = (abs(e) ** 2 - g["epsilon"] ** 2) / g["epsilon"] ** 2
    pull = g["alpha"] * max(mpf(-1), min(mpf(1), near))
    u = mpc(*u_r) - (pull + mpc(0, 1) * g["beta"] * switched(sigma, g["width"])) * e

    def rate_of_x2(v):
        return diff(lambda dt: state(robot, (v, u.real), dt)[0].imag, 0)

    v = (u.imag - rate_of_x2(0)) / (rate_of_x2(1) - rate_of_x2(0))  # x2' is linear in v
    return v, u.real, sigma
