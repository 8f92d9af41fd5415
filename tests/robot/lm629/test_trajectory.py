"""The profile generator: vectors calculated by hand from the README's rules, and random moves against the slow twin."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.lm629.options import DEFAULT_OPTIONS
from miro_robot.lm629.trajectory import ProfileGenerator
from tests.example_count import examples
from tests.naive.lm629 import NaiveLm629


def generator(a, limit, target, **modes):
    trajectory = ProfileGenerator()
    trajectory.acceleration, trajectory.max_velocity, trajectory.target = a, limit, target
    for name, value in modes.items():
        setattr(trajectory, name, value)
    trajectory.start()
    return trajectory


def run(trajectory, change=()):
    """Velocities and whole positions until the target; `change` is made before the 7th sample."""
    velocities, positions = [], []
    while trajectory.moving:
        for name in change if len(velocities) == 6 else ():
            setattr(trajectory, name, change[name])
        finished = trajectory.step()
        velocities.append(trajectory.velocity)
        positions.append(trajectory.position >> 16)
        assert finished == (not trajectory.moving)
    return velocities, positions


BY_HAND = {  # acceleration, limit, target, what changes on the way; velocities in 1/65536 count, whole positions
    "trapezoid": (
        (0x10000, 0x30000, 20, {}),
        "10000 20000 30000 30000 30000 30000 20000 20000 10000 0",
        [1, 3, 6, 9, 12, 15, 17, 19, 20, 20],
    ),
    "triangle backwards": (
        (0x10000, 0x30000, -7, {}),
        "-10000 -20000 -20000 -10000 0",
        [-1, -3, -5, -6, -7],
    ),
    "fractions": ((0x8000, 0x20000, 5, {}), "8000 10000 18000 10000 8000 0", [0, 1, 3, 4, 4, 5]),
    "odd fractions": (
        (0x9C40, 0x186A0, 10, {}),
        "9C40 13880 186A0 186A0 186A0 186A0 EA60 4E20 4E20 0",
        [0, 1, 3, 4, 6, 7, 8, 9, 9, 10],
    ),
    "a new limit on the way": (
        (0x10000, 0x30000, 20, {"max_velocity": 0x10000}),
        "10000 20000 30000 30000 30000 30000 20000 10000 10000 0",
        [1, 3, 6, 9, 12, 15, 17, 18, 19, 20],
    ),
    "a new target behind the axis": (
        (0x10000, 0x30000, 20, {"target": 5}),
        "10000 20000 30000 30000 30000 30000 20000 10000 0 -10000 -20000 -30000 -30000 -20000 -10000 0",
        [1, 3, 6, 9, 12, 15, 17, 18, 18, 17, 15, 12, 9, 7, 6, 5],
    ),
}


@pytest.mark.parametrize(("move", "velocities", "positions"), BY_HAND.values(), ids=BY_HAND)
def test_a_move_goes_as_calculated_by_hand(move, velocities, positions):
    *profile, change = move
    assert run(generator(*profile), change) == ([int(one, 16) for one in velocities.split()], positions)


@pytest.mark.parametrize(
    ("a", "limit", "target", "samples", "peak"),
    [
        (2, 0x346E, 8000, 45773, 0x346E),  # AN-693 reference system
        (0xF, 0x6D1EC, 200000, 59121, 443400),  # data sheet example, just triangular
        (0x100, 0x150000, 400000, 24424, 0x150000),
        (1, 1, 1, 65536, 1),
    ],
)
def test_long_moves_take_as_many_samples_as_calculated_by_hand(a, limit, target, samples, peak):
    velocities, positions = run(generator(a, limit, target))
    assert (len(velocities), max(velocities), positions[-1]) == (samples, peak, target)


def test_velocity_mode_and_its_reversal():
    trajectory = generator(0x4000, 0x18000, 0, velocity_mode=1, forward=1)
    velocities, positions = [], []
    for n in range(24):
        if n == 10:
            trajectory.forward = 0
        assert trajectory.step() == 0
        velocities.append(trajectory.velocity)
        positions.append(trajectory.position >> 16)
    up = [0x4000, 0x8000, 0xC000, 0x10000, 0x14000, 0x18000]
    down = [0x14000, 0x10000, 0xC000, 0x8000, 0x4000, 0]
    assert velocities == [*up, *[0x18000] * 4, *down, *[-v for v in up], *[-0x18000] * 2]
    assert positions == [0, 0, 1, 2, 3, 5, 6, 8, 9, 11, 12, 13, 14, 14, 15, 15, 14, 14, 13, 12, 11, 9, 8, 6]


def test_without_acceleration_nothing_ever_moves_or_ends():
    trajectory = generator(0, 0x10000, 20)
    assert [trajectory.step() for _ in range(50)] == [0] * 50
    assert (trajectory.position, trajectory.velocity, trajectory.moving) == (0, 0, 1)


SMALL = st.integers(-400, 400)
WIDE = st.integers(-(2**30), 2**30 - 1)


@pytest.mark.slow
@examples(300)
@given(
    a=st.integers(0, 0x30000) | st.integers(0, 2**30 - 1),
    limit=st.integers(0, 0x80000) | st.integers(0, 2**30 - 1),
    target=SMALL | WIDE,
    position=st.just(0) | st.integers(-(2**46), 2**46 - 1),
    velocity=st.just(0) | st.integers(-0x100000, 0x100000) | st.integers(-(2**30), 2**30),
    activity=st.sampled_from(["position", "position", "velocity", "stop"]),
    forward=st.integers(0, 1),
    samples=st.integers(1, 60),
)
def test_any_state_steps_like_the_slow_twin(a, limit, target, position, velocity, activity, forward, samples):
    ours = generator(a, limit, target, velocity_mode=int(activity == "velocity"), forward=forward)
    ours.position, ours.velocity = position, velocity
    if activity == "stop":
        ours.stop_smoothly()
    theirs = NaiveLm629(DEFAULT_OPTIONS)
    theirs.a, theirs.limit, theirs.target, theirs.activity = a, limit, target, activity
    theirs.mode_bits = forward << 12
    theirs.desired, theirs.speed = Fraction(position, 65536), velocity
    for _ in range(samples):
        if not ours.moving:
            break
        events = set()
        theirs.profile(events)
        finished = ours.step()
        assert (ours.position, ours.velocity) == (theirs.desired * 65536, theirs.speed)
        assert (finished, ours.crossed, ours.target) == (2 in events, 4 in events, theirs.target)


@examples(200)
@given(a=st.integers(1, 0x20000), limit=st.integers(1, 0x40000), target=st.integers(-300, 300))
def test_every_move_from_rest_ends_exactly_on_its_target(a, limit, target):
    trajectory = generator(max(a, 0x40), max(limit, 0x200), target)
    velocities, positions = run(trajectory)
    assert trajectory.position == target * 65536
    assert velocities[-1] == 0
    assert max(map(abs, velocities)) <= max(limit, 0x200)
    assert max(map(abs, positions)) <= abs(target)
