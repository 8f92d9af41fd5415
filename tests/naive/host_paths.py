"""Twin of `miro_host.references`: any path from its points alone, and the planner on a fine grid.

What is a derivative there is a numerical one here; what is a formula for a polynomial there is a system of linear
equations here. Nothing is shared with the code under test.
"""

import math

from mpmath import atan, atan2, cos, diff, hypot, lu_solve, matrix, mp, mpf, pi, sin

from tests.naive.host_control import path_length, wrapped

mp.dps = 40


def reference(point, t):
    """x, y, theta, v, w, v', w', rho, phi, rho', phi', rho'' at t of a path `point(t)` = x, y, theta (40 digits)."""
    t = mpf(t)
    x, y, theta = point(t)

    def along(time):
        return diff(lambda u: point(u)[0], time) * cos(theta) + diff(lambda u: point(u)[1], time) * sin(theta)

    def speed(time):
        return hypot(diff(lambda u: point(u)[0], time), diff(lambda u: point(u)[1], time))

    def rho(time):
        return hypot(*point(time)[:2])

    def phi(time):
        return wrapped(atan2(point(time)[1], point(time)[0]) - atan2(y, x))

    assert along(t) >= 0
    return (
        *(x, y, wrapped(theta), speed(t), diff(lambda u: point(u)[2], t)),
        *(diff(speed, t, h=mpf(10) ** -12), diff(lambda u: point(u)[2], t, 2)),
        *(rho(t), atan2(y, x), diff(rho, t), diff(phi, t), diff(rho, t, 2)),
    )


def sine(t, speed, ramp, amplitude, wavelength, heading, start):
    """A point of the sine, whose progress along the axis has the ramp."""
    u = path_length(t, speed, ramp)
    k = 2 * pi / mpf(wavelength)
    f, slope = mpf(amplitude) * sin(k * u), mpf(amplitude) * k * cos(k * u)
    heading = mpf(heading)
    x = mpf(start[0]) + u * cos(heading) - f * sin(heading)
    y = mpf(start[1]) + u * sin(heading) + f * cos(heading)
    return x, y, heading + atan(slope)


def circle_heading(a, b, c):
    """The direction of travel in b on the circle through a, b and c: across its radius."""
    ax, ay, cx, cy = (mpf(v) for v in (a[0] - b[0], a[1] - b[1], c[0] - b[0], c[1] - b[1]))
    d = 2 * (ax * cy - ay * cx)
    if abs(d) < mpf(10) ** -20:
        return atan2(cy, cx)
    x = (cy * (ax**2 + ay**2) - ay * (cx**2 + cy**2)) / d  # the centre, seen from b
    y = (ax * (cx**2 + cy**2) - cx * (ax**2 + ay**2)) / d
    return atan2(-x, y) if d < 0 else atan2(x, -y)


def polynomial(conditions):
    """Coefficients of the polynomial in u with given values of derivatives: {(u, order): value}."""
    size = len(conditions)
    rows, right = matrix(size, size), matrix(size, 1)
    for row, ((u, order), value) in enumerate(conditions.items()):
        for power in range(order, size):
            factor = mpf(1)
            for k in range(order):
                factor *= power - k
            rows[row, power] = factor * mpf(u) ** (power - order)
        right[row] = value
    return list(lu_solve(rows, right))


def value(coefficients, u, order=0):
    return diff(lambda x: sum(c * x**k for k, c in enumerate(coefficients)), u, order)


def pieces(points, headings):
    """The pieces of an open path: a list of (length, x coefficients, y coefficients) by u in m."""
    lengths, bends = [], []
    for a, b, leaving, arriving in zip(points, points[1:], headings, headings[1:], strict=False):
        chord, direction = hypot(b[0] - a[0], b[1] - a[1]), atan2(mpf(b[1]) - a[1], mpf(b[0]) - a[0])
        delta = (abs(wrapped(leaving - direction)) + abs(wrapped(arriving - direction))) / 2
        delta = min(delta, mpf(2))
        lengths.append(chord * (delta / sin(delta) if delta > mpf(10) ** -6 else 1))
        slopes = {(0, 0): 0, (lengths[-1], 0): 0}
        slopes[0, 1], slopes[lengths[-1], 1] = wrapped(leaving - direction), wrapped(arriving - direction)
        over_chord = polynomial(slopes)
        bends.append([value(over_chord, u, 2) for u in (0, lengths[-1])])
    curvatures = [bends[0][0]]
    for i in range(len(lengths) - 1):
        both = lengths[i] + lengths[i + 1]
        curvatures.append((bends[i][1] * lengths[i + 1] + bends[i + 1][0] * lengths[i]) / both)
    curvatures.append(bends[-1][1])
    found = []
    for i, length in enumerate(lengths):
        coordinates = []
        for axis, normal in ((0, lambda angle: -sin(angle)), (1, cos)):
            conditions = {}
            for u, k in ((mpf(0), i), (length, i + 1)):
                conditions[u, 0] = points[k][axis]
                conditions[u, 1] = (cos, sin)[axis](headings[k])
                conditions[u, 2] = curvatures[k] * normal(headings[k])
            coordinates.append(polynomial(conditions))
        found.append((length, *coordinates))
    return found


def quickest(found, speed, accel, lateral, turn, grid=1500):
    """(times, ways) of the quickest drive from rest to rest on a grid: chords for ways, their turns for curvature."""
    xs, ys = [], []
    for length, cx, cy in found:
        fx, fy = [float(c) for c in cx], [float(c) for c in cy]
        for k in range(grid):
            u = float(length) * k / grid
            xs.append(sum(c * u**n for n, c in enumerate(fx)))
            ys.append(sum(c * u**n for n, c in enumerate(fy)))
    ways = [math.hypot(xs[k + 1] - xs[k], ys[k + 1] - ys[k]) for k in range(len(xs) - 1)]
    angles = [math.atan2(ys[k + 1] - ys[k], xs[k + 1] - xs[k]) for k in range(len(xs) - 1)]
    z = [0.0]
    for k in range(1, len(ways)):
        turned = math.remainder(angles[k] - angles[k - 1], 2 * math.pi)
        bend = abs(turned) / (0.5 * (ways[k] + ways[k - 1])) + 1e-12
        z.append(min(speed**2, lateral / bend, (turn / bend) ** 2))
    z.append(0.0)
    for k, way in enumerate(ways):
        z[k + 1] = min(z[k + 1], z[k] + 2 * accel * way)
    for k in range(len(ways) - 1, -1, -1):
        z[k] = min(z[k], z[k + 1] + 2 * accel * ways[k])
    times, covered = [0.0], [0.0]
    for k, way in enumerate(ways):
        times.append(times[-1] + 2 * way / (math.sqrt(z[k]) + math.sqrt(z[k + 1])))
        covered.append(covered[-1] + way)
    return times, covered
