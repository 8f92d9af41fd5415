"""A motor between two outputs of a bridge, in steps so short that the order of the method does not matter."""

STEP_S = 25e-6


def speed(stretches, volts=6.0, drop=1.4, ohm=10.0, constant=0.215, inertia=3.5e-4, friction=0.032):
    """Speed in rad/s at the end of stretches of (mode, seconds), from standstill; and the radians turned until then."""
    speed = angle = 0.0
    for mode, seconds in stretches:
        for _ in range(round(seconds / STEP_S)):
            current = current_of(mode, constant * speed, volts, drop, ohm)
            torque = constant * current
            if speed == 0.0 and abs(torque) <= friction:
                continue
            against = friction if speed > 0 or (speed == 0 and torque > 0) else -friction
            after = speed + STEP_S * (torque - against) / inertia
            if speed * after < 0:
                after = 0.0
            angle += STEP_S * (speed + after) / 2
            speed = after
    return speed, angle


def current_of(mode, emf, volts, drop, ohm):
    """Forward it drives current only forward, braking only against the back-EMF, coasting none at all."""
    if mode == "forward":
        return max((volts - emf) / ohm, 0.0)
    if mode == "backward":
        return min((-volts - emf) / ohm, 0.0)
    if mode == "brake" and abs(emf) > drop:
        return ((drop if emf > 0 else -drop) - emf) / ohm
    return 0.0
