"""Twin of `miro_host.references` and `miro_host.laws.yang_kim`: the paper's formulas in 40-digit arithmetic.

The reference comes in Cartesian form and everything polar is derived from it numerically; the law is written
down in the order of the paper's text. Nothing is shared with the code under test.
"""

from mpmath import atan2, cos, diff, hypot, mp, mpf, pi, sin

mp.dps = 40


def wrapped(angle):
    while angle > pi:
        angle -= 2 * pi
    while angle <= -pi:
        angle += 2 * pi
    return angle


def path_length(t, speed, ramp):
    t, speed, ramp = mpf(t), mpf(speed), mpf(ramp)
    return speed * t**2 / (2 * ramp) if t < ramp else speed * (t - ramp / 2)


def arc_point(s, heading, curvature):
    heading, curvature = mpf(heading), mpf(curvature)
    if curvature == 0:
        return s * cos(heading), s * sin(heading), heading
    theta = heading + curvature * s
    return ((sin(theta) - sin(heading)) / curvature, -(cos(theta) - cos(heading)) / curvature, theta)


def reference(t, speed, ramp, heading, curvature):
    """x, y, theta, v, w, v', w', rho, phi, rho', phi', rho'' at a time inside the drive, not on a corner."""

    def point(time):
        return arc_point(path_length(time, speed, ramp), heading, curvature)

    def rho(time):
        return hypot(*point(time)[:2])

    def phi(time):
        x, y, _ = point(time)
        return atan2(y, x)

    t = mpf(t)
    x, y, theta = point(t)
    v = diff(lambda time: path_length(time, speed, ramp), t)
    w = diff(lambda time: point(time)[2], t)
    v_dot = diff(lambda time: path_length(time, speed, ramp), t, 2)
    w_dot = diff(lambda time: point(time)[2], t, 2)
    return (
        *(x, y, wrapped(theta), v, w, v_dot, w_dot),
        *(rho(t), phi(t), diff(rho, t), diff(phi, t), diff(rho, t, 2)),
    )


def sgn(x, width):
    """The sign, or with a width the saturation function."""
    x = mpf(x)
    if width is None:
        return mpf((x > 0) - (x < 0))
    return max(mpf(-1), min(mpf(1), x / mpf(width)))


def law(gains, ref, measured, v_c, w_c):
    """(s1, s2, u1, u2) of equations (13) and (16); `ref` = (rho, phi, theta, v, w, v')_r.

    `gains` is a dict: g1 g2 q1 q2 p1 p2, widths w1 w2 wt (None: sign), d (guard of 1/cos), floor (of rho_c), and
    layer_derivative: whether u2 knows that sat(theta_e / wt) has a slope.
    """
    rho_r, phi_r, theta_r, v_r, w_r, v_r_dot = map(mpf, ref)
    x, y, theta_c = map(mpf, measured)
    v_c, w_c = mpf(v_c), mpf(w_c)
    slope_known = gains["layer_derivative"]
    g = {name: None if value is None else mpf(value) for name, value in gains.items()}
    rho_c, phi_c = hypot(x, y), atan2(y, x)
    rho_e, phi_e, theta_e = rho_c - rho_r, wrapped(phi_c - phi_r), wrapped(theta_c - theta_r)
    rho_safe = max(rho_c, g["floor"])

    rho_c_dot, rho_r_dot = v_c * cos(phi_c - theta_c), v_r * cos(phi_r - theta_r)  # (9)
    phi_c_dot, phi_r_dot = -v_c / rho_safe * sin(phi_c - theta_c), -v_r / rho_r * sin(phi_r - theta_r)
    rho_e_dot, theta_e_dot = rho_c_dot - rho_r_dot, w_c - w_r
    phi_e_abs_dot = sgn(phi_e, None) * (phi_c_dot - phi_r_dot)

    s1 = rho_e_dot + g["g1"] * rho_e  # (13)
    s2 = theta_e_dot + g["g2"] * theta_e + sgn(theta_e, g["wt"]) * abs(phi_e)

    r_c = v_c**2 / rho_safe * sin(phi_c - theta_c) ** 2 + v_c * w_c * sin(phi_c - theta_c)
    r_r = v_r**2 / rho_r * sin(phi_r - theta_r) ** 2 + v_r * w_r * sin(phi_r - theta_r)
    c = cos(phi_c - theta_c)
    one_over_c = c * (1 + g["d"] ** 2) / (c**2 + g["d"] ** 2)
    u1 = (
        one_over_c
        * (
            -g["q1"] * s1
            - g["p1"] * sgn(s1, g["w1"])
            - g["g1"] * rho_e_dot
            + v_r_dot * cos(phi_r - theta_r)
            + r_r
            - r_c
        )
        - v_r_dot
    )  # (16)
    u2 = (
        -g["q2"] * s2
        - g["p2"] * sgn(s2, g["w2"])
        - g["g2"] * theta_e_dot
        - sgn(theta_e, g["wt"]) * phi_e_abs_dot
    )
    if slope_known:
        u2 -= diff(lambda dt: sgn(theta_e + dt * theta_e_dot, g["wt"]), 0) * abs(phi_e)
    return s1, s2, u1, u2
