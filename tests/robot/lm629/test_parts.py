"""The parts of the chip, calculated by hand from the README's rules and against slow twins: the PWM stage, the digital
filter, the profile generator, the encoder inputs.
"""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.clock import NEVER_TICK
from miro_robot.lm629.chip import PWM_TICKS, SAMPLE_TICKS, Lm629
from miro_robot.lm629.encoder import Encoder
from miro_robot.lm629.options import DEFAULT_OPTIONS
from miro_robot.lm629.pid import Pid
from miro_robot.lm629.trajectory import ProfileGenerator
from tests.example_count import examples
from tests.naive.lm629 import NaiveLm629, NaivePid
from tests.naive.lm629_encoder import FORWARD, NaiveEncoder
from tests.robot.lm629.bench import Bench


def test_four_pulses_a_sample_of_16_ticks_a_step_from_the_start_of_the_period():
    bench = Bench.running()
    bench.closed(-26, kp=10)
    start = bench.tick
    bench.edges.clear()
    bench.wait(SAMPLE_TICKS - 1)
    expected = []
    for period in range(4):
        at = start + period * PWM_TICKS
        expected += [(at, 1, 1, 0), (at + 32, 0, 1, 0)]
    assert [(start, 1, 1, 0), *bench.edges] == expected


def test_full_drive_is_127_of_128():
    bench = Bench.running()
    bench.closed(4000, kp=10)
    start = bench.tick
    bench.edges.clear()
    bench.wait(PWM_TICKS)
    assert bench.edges == [(start + 2032, 0, 0, 0), (start + 2048, 1, 0, 0)]


def test_without_drive_only_samples_are_events():
    bench = Bench.running()
    bench.closed(0, kp=10)
    assert bench.chip.next_tick == bench.chip.sample_tick == bench.tick + SAMPLE_TICKS
    seen = len(bench.edges)
    bench.sample(20)
    assert len(bench.edges) == seen


def test_the_drive_changes_at_the_sample_only():
    bench = Bench.running()
    bench.closed(0, kp=10)
    bench.wait(3000)
    bench.chip.trajectory.position = 100 * 65536
    bench.wait(SAMPLE_TICKS - 3001)
    assert bench.chip.pwm_magnitude == 0
    bench.wait(1)
    assert (bench.chip.pwm_magnitude, bench.chip.pwm) == (3, 1)


def test_samples_and_periods_count_from_the_end_of_reset():
    for release in (1000, 1001, 1004):
        chip = Lm629()
        assert chip.next_tick == NEVER_TICK
        chip.set_reset(900, 0)
        chip.set_reset(release, 1)
        end = -(-release // 4) * 4 + 6144 * 4
        assert chip.next_tick == end
        chip.advance(end)
        assert chip.next_tick == end + SAMPLE_TICKS
        assert chip.hi == 1


def test_reset_ends_a_pulse_at_once():
    for software in (False, True):
        bench = Bench.running()
        bench.closed(4000, kp=10)
        assert bench.chip.pwm == 1
        if software:
            bench.command("RESET")
            assert bench.chip.next_tick > bench.tick + 2 * SAMPLE_TICKS
        else:
            bench.chip.set_reset(bench.tick, 0)
            assert bench.chip.next_tick == NEVER_TICK
        assert (bench.chip.pwm, bench.chip.sign, bench.chip.pwm_magnitude, bench.chip.hi) == (0, 0, 0, 0)


def loop(kp=0, ki=0, kd=0, il=0, ds=0, saturates=True):
    pid = Pid(saturates)
    pid.load(kp, ki, kd, il, ds)
    return pid


@pytest.mark.parametrize(
    ("error", "drive", "sign", "magnitude"),
    [
        (25, 250, 0, 0),
        (26, 260, 0, 1),
        (-1, -10, 1, 1),
        (-26, -260, 1, 2),
        (3276, 32760, 0, 127),
        (3277, 32767, 0, 127),
        (-3277, -32768, 1, 127),
        (40000, 32767, 0, 127),
    ],
)
def test_proportional_term_and_output_stage(error, drive, sign, magnitude):
    assert loop(kp=10).step(error) == drive
    bench = Bench.running()
    bench.closed(error, kp=10)
    assert (bench.chip.sign, bench.chip.pwm_magnitude) == (sign, magnitude)


def test_all_terms_together():
    pid = loop(kp=20, ki=4, kd=100, il=500, ds=1)
    errors = [5, 12, 20, 25, 25, 20, 10, 0, -5, -5]
    drives = [pid.step(e) for e in errors]
    assert drives == [600, 740, 1900, 2000, 1000, 900, -1300, -1500, -1600, -1600]


def error_after_a_jam(saturates):
    """Counts that the motor is behind its desired position, a second after something held it for 0.1 s.

    A motor of first order with the robot's filter, at two thirds of its top speed.
    """
    pid = loop(kp=400, ki=40, kd=3000, il=2000, ds=3, saturates=saturates)
    desired = real = speed = 0.0
    for sample in range(3600):
        held = 300 <= sample < 600
        drive = pid.step(int(desired) - int(real))
        speed = 0.0 if held else speed + (6.0 * drive / 32768 - speed) / 60
        desired += 4.0 if sample > 60 else sample / 15
        real += speed
    return int(desired - real)


def test_a_motor_that_was_held_catches_up_with_its_desired_position():
    """SNVS781C p. 10 says so; with products that wrap (p. 12) it stays behind."""
    assert abs(error_after_a_jam(saturates=True)) < 100
    assert error_after_a_jam(saturates=False) > 1000


COEFFICIENT = st.integers(0, 300) | st.integers(0, 0x7FFF)


@examples(300)
@given(
    coefficients=st.tuples(COEFFICIENT, COEFFICIENT, COEFFICIENT, COEFFICIENT, st.integers(0, 5)),
    saturates=st.booleans(),
    wound_up=st.integers(-(2**23), 2**23 - 1),
    errors=st.lists(st.integers(-500, 500) | st.integers(-(2**30), 2**30 - 1), max_size=60),
)
def test_any_errors_give_the_drive_of_the_slow_twin(coefficients, saturates, wound_up, errors):
    ours, theirs = Pid(saturates), NaivePid(saturates)
    ours.load(*coefficients)
    theirs.load(*coefficients)
    ours.error_sum = theirs.sum = wound_up
    for error in errors:
        assert ours.step(error) == theirs.step(error)
        assert (ours.integral, ours.error_sum) == (theirs.integral, theirs.sum)


# ------------------------------------------------------------------------------- the profile generator


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


def test_a_smooth_stop_slows_down_by_the_acceleration_and_ends_on_a_whole_count():
    trajectory = generator(0x3000, 0x9000, 0, velocity_mode=1, forward=0)
    for _ in range(6):
        trajectory.step()
    assert trajectory.position == -0x2D000
    trajectory.start(stopping=1)
    assert run(trajectory) == ([-0x6000, -0x3000, 0], [-4, -4, -4])  # -3.2, -3.4, down to -4
    assert (trajectory.position, trajectory.target) == (-4 * 65536, -4)


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
        ours.start(stopping=1)
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


# ------------------------------------------------------------------------------- the encoder inputs

EVENT = st.tuples(
    st.sampled_from(["forward", "back", "a", "b", "index", "take", "arm"]),
    st.integers(0, 6) | st.sampled_from([24, 28, 29, 31, 32, 33, 36, 200]),
)


@examples(400)
@given(
    filter_clocks=st.sampled_from([8, 8, 8, 3, 1, 0]),
    start=st.integers(0, 40),
    place=st.integers(0, 3),
    events=st.lists(EVENT, max_size=60),
)
def test_any_edges_count_like_a_sampler_that_looks_at_every_clock(filter_clocks, start, place, events):
    ours, theirs = Encoder(filter_clocks), NaiveEncoder(filter_clocks)
    tick, index = start, 1
    a, b = FORWARD[place]
    for encoder in (ours, theirs):
        encoder.set_phases(tick, a, b)
    for what, pause in events:
        tick += pause
        if what == "take":
            ours.settle(tick)
            caught = ours.caught_counts if ours.caught else None
            assert (ours.counts, caught) == theirs.take(tick)
            ours.counts = ours.caught = 0
            continue
        if what == "arm":
            ours.arm(tick)
            theirs.arm(tick)
            continue
        if what == "index":
            index ^= 1
            ours.set_index(tick, index)
            theirs.set_index(tick, index)
            continue
        place = FORWARD.index((a, b))
        moves = {
            "forward": FORWARD[(place + 1) % 4],
            "back": FORWARD[place - 1],
            "a": (1 - a, b),
            "b": (a, 1 - b),
        }
        a, b = moves[what]
        ours.set_phases(tick, a, b)
        theirs.set_phases(tick, a, b)
    ours.settle(tick + 400)
    caught = ours.caught_counts if ours.caught else None
    assert (ours.counts, caught) == theirs.take(tick + 400)


@pytest.mark.parametrize(("clocks", "counted"), [(8, 1), (7, 0)])
def test_a_state_of_8_clocks_counts_and_one_of_7_does_not(clocks, counted):
    encoder = Encoder(8)
    encoder.set_phases(0, 0, 0)
    encoder.set_phases(100, 1, 0)
    encoder.set_phases(100 + 4 * clocks, 1, 1)
    encoder.settle(100 + 4 * clocks)
    assert encoder.counts == counted


def test_the_first_state_is_where_the_wheel_stands():
    encoder = Encoder(8)
    encoder.set_phases(0, 1, 0)
    encoder.settle(1000)
    assert encoder.counts == 0
    encoder.set_phases(1000, 1, 1)
    encoder.settle(2000)
    assert encoder.counts == 1


def test_a_leading_b_counts_up_and_4_counts_are_a_line():
    bench = Bench.running()
    bench.turn(0)
    bench.chip.set_encoder(bench.tick, 0, 0)
    bench.turn(40)
    bench.sample()
    assert bench.ask("RDRP") == 40
    assert bench.ask("RDRV") == 40
    bench.turn(-48)
    bench.sample()
    assert bench.ask("RDRP") == -8
    assert bench.ask("RDRV") == -48


def test_two_index_captures_a_turn_apart_differ_by_the_counts_of_a_turn():
    bench = Bench.running()
    bench.chip.set_encoder(bench.tick, 0, 0)
    captured = []
    for _ in range(2):
        bench.command("SIP")
        assert bench.signals() & 1 == 1
        bench.turn(13 * 4)
        assert bench.status() & 0x08 == 0
        bench.chip.set_index(bench.tick, 0)
        bench.wait(64)
        bench.chip.set_index(bench.tick, 1)
        bench.turn(7 * 4)
        bench.sample()
        assert bench.status() & 0x08
        assert bench.signals() & 1 == 0
        captured.append(bench.ask("RDIP"))
        bench.command("RSTI", 0x0077)
        bench.sample()
        assert bench.status() & 0x08 == 0
    assert captured == [52, 80 + 52]
    assert bench.ask("RDRP") == 160
