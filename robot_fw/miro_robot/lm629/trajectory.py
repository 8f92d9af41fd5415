"""The trapezoidal profile generator: working registers and one step per sample.

All integers: positions are 1/65536 counts, velocities 1/65536 counts per sample, accelerations 1/65536 counts
per sample^2. What the host loads and when it takes effect is in `buffers.py`. The data sheet (SNVS781, "Velocity
Profile (Trajectory) Generation") names only the outer properties; the algorithm is chosen (README.md, "Profile") and
always ends exactly on the target.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG

_HALF_SPACE = 1 << 46
_SPACE_MASK = (1 << 47) - 1


def _wrapped(position: int) -> int:
    """A 47-bit position: the integer part lives in -2^30 .. 2^30-1."""
    return ((position + _HALF_SPACE) & _SPACE_MASK) - _HALF_SPACE


def _stopping_distance(speed: int, acceleration: int) -> int:
    """Distance of a move that slows down from `speed` by `acceleration` at every later sample."""
    if speed == 0:
        return 0
    if acceleration == 0:
        # It never stops: farther than any target.
        return NEVER_TICK
    n = speed // acceleration
    # The sum of speed, speed - a, .. down to the last term that is not negative: n + 1 terms.
    return (n + 1) * speed - acceleration * n * (n + 1) // 2


class ProfileGenerator:
    """Desired position and velocity, and the working copies of the host's parameters.

    `moving` is 1 while the profile has not finished. `crossed` is 1 when the last step left the 31-bit space.
    """

    STATE = {
        "position": ("q", -_HALF_SPACE, _HALF_SPACE - 1),
        "velocity": ("q", -(1 << 32), 1 << 32),
        "acceleration": ("q", 0, 0x3FFFFFFF),
        "max_velocity": ("q", 0, 0x3FFFFFFF),
        "target": ("q", -(1 << 30), (1 << 30) - 1),
        "velocity_mode": FLAG,
        "forward": FLAG,
        "stopping": FLAG,
        "moving": FLAG,
        "crossed": FLAG,
    }
    NOT_STATE = ("keeps_fraction",)

    def __init__(self, keeps_fraction: bool = False) -> None:
        self.keeps_fraction = 1 if keeps_fraction else 0
        self.reset()

    def reset(self) -> None:
        self.follow(0)
        self.acceleration = 0
        self.max_velocity = 0
        self.target = 0
        self.velocity_mode = 0
        self.forward = 0
        self.crossed = 0

    def start(self, stopping: int = 0) -> None:
        """The working registers were loaded: run them, or stop smoothly."""
        self.moving = 1
        self.stopping = stopping

    def stop_abruptly(self, place: int) -> None:
        """The target becomes `place`, and is reached."""
        self.follow(place)
        self.target = place

    def follow(self, real_position: int) -> None:
        """Rests at this position: the real one (motor off), or the target that was reached."""
        self.position = real_position * 65536
        self.velocity = 0
        self.moving = 0
        self.stopping = 0

    def define_home(self, real_position: int) -> None:
        """Shift the axis so that `real_position` is 0; the move in progress ends where it would have."""
        self.position = _wrapped(self.position - real_position * 65536)
        self.target = _wrapped((self.target - real_position) * 65536) >> 16

    def step(self) -> int:
        """Computes one sample. Returns 1 in the sample that ends the profile."""
        self.crossed = 0
        if self.stopping:
            return self._slow_to_rest()
        if self.velocity_mode:
            self._approach(self.max_velocity if self.forward else -self.max_velocity)
            return 0
        return self._towards_target()

    def _slow_to_rest(self) -> int:
        self._approach(0)
        if self.velocity != 0:
            return 0
        # Where it rests is the target from now on, on a whole count unless P2 says otherwise.
        self.target = self.position >> 16
        if self.keeps_fraction:
            self.moving = 0
            self.stopping = 0
        else:
            self.follow(self.target)
        return 1

    def _approach(self, goal: int) -> None:
        """Velocity moves towards `goal` by at most the acceleration, the position by the new velocity."""
        velocity = self.velocity
        if velocity < goal:
            # `min`: without it the velocity would swing around its goal by an acceleration.
            velocity = min(velocity + self.acceleration, goal)
        else:
            velocity = max(velocity - self.acceleration, goal)
        self._move(velocity)

    def _towards_target(self) -> int:
        a = self.acceleration
        distance = self.target * 65536 - self.position
        if distance == 0 and self.velocity == 0:
            self.follow(self.target)
            return 1
        backwards = distance < 0 or (distance == 0 and self.velocity < 0)
        v = -self.velocity if backwards else self.velocity
        if backwards:
            distance = -distance
        # The last step, never longer than one of the acceleration, snaps on the target.
        if 0 <= v <= a and distance <= min(a, self.max_velocity):
            self.follow(self.target)
            return 1
        if v < 0:
            # It moves away from the target: to rest first, then back in later samples.
            v = min(v + a, 0)
        else:
            v = self._speed(v, distance)
        self._move(-v if backwards else v)
        return 0

    def _speed(self, v: int, distance: int) -> int:
        """The fastest of speeding up, holding and slowing down that can still stop at the target."""
        a = self.acceleration
        if v < self.max_velocity:
            up = min(v + a, self.max_velocity)
        else:
            # Above the limit, as after an LTRJ with a lower one: down to it, by no more than the acceleration.
            up = max(v - a, self.max_velocity)
        if _stopping_distance(up, a) <= distance:
            return up
        # Above the limit `up` is the slower one already, and holding is not allowed.
        if up >= v and _stopping_distance(v, a) <= distance:
            return v
        return max(v - a, 0)

    def _move(self, velocity: int) -> None:
        moved = self.position + velocity
        self.velocity = velocity
        self.position = _wrapped(moved)
        if self.position != moved:
            self.crossed = 1
