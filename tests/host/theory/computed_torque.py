"""Computed torque and the disturbance that it leaves: equations (10), (14), (15) and the matching condition.

    (10)  H z' + G + tau_d = tau      (14)  tau = H z_r' + G + H u      (15)  z' + f = z_r' + u,  tau_d = H f

The matching condition holds for any tau_d, as the paper says, because H is regular: f = H^-1 tau_d. That f is bounded
by a number known beforehand does not follow where the model itself is wrong: with the model's H^ in (14) and the real H
in (10), f = (1 - H^-1 H^) (z_r' + u) + H^-1 tau_d contains u, and so the gain P that is to exceed it.
"""

from tests.host.theory.matrices import added, solution, solved, times


def torque(h, g, demanded):
    """tau of equation (14) in Nm; `demanded` is z_r' + u."""
    return added(times(h, demanded), g)


def acceleration(h, g, applied, disturbance):
    """z' of equation (10) under the torques `applied` and tau_d = `disturbance`, in Nm."""
    rest = [one - two - three for one, two, three in zip(applied, g, disturbance, strict=True)]
    return solved(h, rest)


def matched(h, disturbance):
    """f of the matching condition tau_d = H f, in m/s2 and rad/s2. ValueError for a singular H."""
    return solved(h, disturbance)


def mismatch(h, disturbance, f):
    """tau_d - H f: what of a disturbance no f accounts for, in Nm."""
    return [one - other for one, other in zip(disturbance, times(h, f), strict=True)]


def bounds(h, largest):
    """f_m1, f_m2: the largest |f_i| under disturbances of up to `largest` Nm at each wheel, with any signs."""
    size = range(len(h))
    inverse = solution(h, [[1.0 if i == j else 0.0 for j in size] for i in size])
    return times([[abs(value) for value in row] for row in inverse], largest)


def disturbance(demanded, happened):
    """f_i of equation (15): the demanded z_r' + u less the z' that came of it."""
    return demanded - happened
