"""The rough body: tyres that slip, a ball that drags, shafts that stick, a force that disturbs. Off is off."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.rng import Stream
from miro_sim.plant.chassis import BLOCKED_NM, Body
from miro_sim.plant.drive import DifferentialDrive
from miro_sim.plant.params import Chassis, Disturbance, DriveParams, Motor, OpticalEncoder, RollingBall, Tyre
from miro_sim.plant.rough import DisturbingForce, RoughBody
from tests.naive import rough_step
from tests.naive.plant import NaiveRoughDrive
from tests.sim.plant.runs import kinetic_energy_j, pwm
from tests.states import snapshot, values

BALL = RollingBall(friction=0.3)
ALL = DriveParams(
    tyre=Tyre(grip=0.4), ball=BALL, chassis=Chassis(stiction_ratio=1.8, left_radius_factor=0.985)
)
KINDS = {
    "slip": DriveParams(tyre=Tyre(grip=0.3)),
    "ice": DriveParams(tyre=Tyre(grip=0.02)),
    "ball": DriveParams(ball=BALL),
    "ball in front": DriveParams(ball=RollingBall(friction=0.5, behind_m=-0.035)),
    "stiction": DriveParams(chassis=Chassis(stiction_ratio=2.5)),
    "play": DriveParams(chassis=Chassis(gear_backlash_rad=0.02)),
    "load friction": DriveParams(chassis=Chassis(gear_load_friction=0.25)),
    "slip, play and load friction": DriveParams(
        tyre=Tyre(grip=0.5), chassis=Chassis(gear_backlash_rad=0.05, gear_load_friction=0.3)
    ),
    "all": ALL,
}
ROLLING = DriveParams(tyre=Tyre(grip=10.0), ball=RollingBall(load_share=0.0))
SPEEDS = st.floats(-400.0, 400.0)
WAYS = st.floats(-2.0, 2.0)
TURNS = st.floats(-40.0, 40.0)
FAST = st.one_of(st.floats(0.01, 2.0), st.floats(-2.0, -0.01))
IMPULSES = st.floats(-2e-6, 2e-6)
TICKS = st.integers(1, 2048)
MAGNITUDES = ((100, 100), (0, 0), (-100, -60), (40, 128))


def moving(params, left=0.0, right=0.0, v=0.0, u=0.0, w=0.0):
    made = RoughBody(params, 0.0, 0.0, 0.0)
    made.left_rad_s, made.right_rad_s = left, right
    made.v_m_s, made.u_m_s, made.w_rad_s = v, u, w
    return made


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=100)
@given(SPEEDS, SPEEDS, WAYS, WAYS, TURNS, TICKS)
def test_friction_alone_never_adds_energy(kind, left, right, v, u, w, ticks):
    one = moving(KINDS[kind], left, right, v, u, w)
    for _ in range(3):
        before = kinetic_energy_j(one)
        one.push(0.0, 0.0, ticks)
        assert kinetic_energy_j(one) <= before * (1.0 + 1e-15)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=60)
@given(SPEEDS, SPEEDS, WAYS, WAYS, TURNS, IMPULSES, IMPULSES, TICKS)
def test_a_push_gives_no_more_energy_than_to_shafts_without_any_friction(
    kind, left, right, v, u, w, push_left, push_right, ticks
):
    params = KINDS[kind]
    one = moving(params, left, right, v, u, w)
    inertia = params.motor.rotor_inertia_kg_m2
    free = moving(params, left + push_left / inertia, right + push_right / inertia, v, u, w)
    one.push(push_left, push_right, ticks)
    assert kinetic_energy_j(one) <= kinetic_energy_j(free) * (1.0 + 1e-15)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=100)
@given(
    SPEEDS, SPEEDS, WAYS, WAYS, TURNS, st.lists(st.tuples(IMPULSES, IMPULSES, TICKS), min_size=1, max_size=3)
)
def test_a_step_leaves_the_motion_of_least_energy(kind, left, right, v, u, w, pushes):
    assert_steps_are_those_of_the_slow_twin(KINDS[kind], moving(KINDS[kind], left, right, v, u, w), pushes)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=100)
@given(
    *(st.floats(0.5, 1.5), st.floats(-40.0, 40.0)),
    st.lists(st.tuples(*[st.floats(-6.0, 6.0)] * 2, TICKS), min_size=1, max_size=3),
)
def test_so_does_a_step_of_wheels_that_roll_or_just_begin_to_slip(kind, v, w, pushes):
    """Impulses in multiples of what the default tyre holds on a wheel."""
    params = KINDS[kind]
    roll, half_m = 0.020 / 8, 0.034
    body = moving(
        *(params, (v - half_m * w) / params.radius_m(0) * 8, (v + half_m * w) / params.radius_m(1) * 8, v),
        w=w,
    )
    limit_nms = roll * min(body.grip_n, 2.0) / 24e6
    nms = [(limit_nms * left * ticks, limit_nms * right * ticks, ticks) for left, right, ticks in pushes]
    assert_steps_are_those_of_the_slow_twin(params, body, nms)


def assert_steps_are_those_of_the_slow_twin(params, body, pushes):
    for left_nms, right_nms, ticks in pushes:
        before = rough_step.Motion(*(body.left_rad_s, body.right_rad_s, body.v_m_s, body.u_m_s, body.w_rad_s))
        motion, forces = rough_step.step(
            params,
            before,
            (left_nms, right_nms),
            ticks,
            (body.left_force_n, body.right_force_n),
            (body.left_load_n, body.right_load_n),
            (body.left_play_m, body.right_play_m),
        )
        body.push(left_nms, right_nms, ticks)
        arc = before.w * ticks / 24e6  # the twin turns the axes first, so a body on an arc loses v arc^2 / 2
        sweeps = 1e-5 if params.ball.friction else 1e-7  # what twelve sweeps leave to do
        near = sweeps + abs(before.v) * arc * arc
        assert (body.v_m_s, body.u_m_s) == pytest.approx((motion.v, motion.u), abs=near)
        assert 0.034 * body.w_rad_s == pytest.approx(0.034 * motion.w, abs=near)
        rims = (0.0025 * body.left_rad_s, 0.0025 * body.right_rad_s)
        assert rims == pytest.approx((0.0025 * motion.left, 0.0025 * motion.right), abs=near)
        if not params.ball.friction:
            near_n = 0.25 * near / (ticks / 24e6)
            assert (body.left_force_n, body.right_force_n) == pytest.approx(forces, abs=near_n)


@settings(max_examples=300)
@given(
    st.floats(0.9, 1.1),
    st.floats(0.9, 1.1),
    st.lists(st.tuples(*[st.floats(-2e-6, 2e-6) | st.just(0.0)] * 2, TICKS), min_size=1, max_size=16),
)
def test_while_no_wheel_slips_every_bit_is_that_of_the_body_that_only_rolls(left, right, pushes):
    params = DriveParams(chassis=Chassis(left_radius_factor=left, right_radius_factor=right))
    body, plain = RoughBody(params, 0.1, 0.2, 3.0), Body(params, 0.1, 0.2, 3.0)
    for push in pushes:
        body.push(*push)
        plain.push(*push)
        assert {name: values(body)[name] for name in values(plain)} == values(plain)
        assert body.velocity() == plain.velocity()


@pytest.mark.parametrize(
    "kind", [kind for kind in KINDS if "play" not in kind]
)  # with it some never rest exactly
@settings(max_examples=40)
@given(st.lists(st.tuples(IMPULSES, IMPULSES, TICKS), max_size=6), SPEEDS, WAYS, WAYS, TICKS)
def test_steps_of_a_robot_at_rest_change_no_bit_and_may_be_left_out(kind, pushes, left, v, u, ticks):
    body = moving(KINDS[kind], left=left, v=0.05 * v, u=0.05 * u)
    for push in pushes:
        body.push(*push)
    for _ in range(20_000):
        body.push(0.0, 0.0, 2048)
        if body.stands() and body.left_rad_s == body.right_rad_s == 0.0:
            break
    assert body.stands()
    before = snapshot(body)
    body.push(0.0, 0.0, ticks)
    assert snapshot(body) == before


@pytest.mark.parametrize("kind", KINDS)
def test_a_robot_that_stands_stays_exactly_where_it_is(kind):
    params = KINDS[kind]
    one = RoughBody(params, 0.3, -0.1, 1.0)
    before = values(one)
    most = one.friction_nm * 2048 / 24e6
    for push in (0.0, 0.5 * most, -0.99 * most):
        one.push(push, -push, 2048)
        one.push(push, push, 2048)
    after = values(one)
    moved = {name for name in before if after[name] != before[name]}
    assert not moved - {"left_force_n", "right_force_n", "left_load_n", "right_load_n"}


@pytest.mark.parametrize("kind", KINDS)
def test_a_robot_left_to_itself_comes_to_rest_exactly(kind):
    one = moving(KINDS[kind], 300.0, 250.0, 0.7, 0.1, -3.0)
    for _ in range(150_000):
        one.push(0.0, 0.0, 2048)
        if kinetic_energy_j(one) == 0.0:
            break
    assert (one.left_rad_s, one.right_rad_s, *one.velocity(), one.u_m_s) == (0.0,) * 5


@pytest.mark.parametrize("magnitudes", [(100, 100), (60, -60), (40, 128)])
def test_with_all_grip_that_it_needs_it_goes_as_the_body_that_only_rolls(magnitudes):
    drive, plain = DifferentialDrive(ROLLING), DifferentialDrive(DriveParams())
    for stretch in (magnitudes, (0, 0), tuple(-m for m in magnitudes)):
        pwm(drive, *stretch, 300)
        pwm(plain, *stretch, 300)
    assert isinstance(drive.body, RoughBody)
    assert drive.velocity_at(drive.tick) == plain.velocity_at(plain.tick)
    assert drive.pose_at(drive.tick) == plain.pose_at(plain.tick)
    assert drive.left_encoder.position == plain.left_encoder.position


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["slip", "ice", "all", "slip, play and load friction"])
def test_tiny_euler_steps_go_the_same_way(kind):
    params = KINDS[kind]
    drive, naive = DifferentialDrive(params), NaiveRoughDrive(params)
    for stretch in MAGNITUDES:
        pwm(drive, *stretch, 100)
        pwm(naive, *stretch, 100)
    counts = params.counts_per_radian()
    assert drive.velocity_at(drive.tick)[0] == pytest.approx(naive.velocity()[0], abs=2e-3)
    assert drive.velocity_at(drive.tick)[1] == pytest.approx(naive.velocity()[1], abs=0.05)
    assert drive.pose_at(drive.tick) == pytest.approx((naive.x, naive.y, naive.theta), abs=2e-4)
    for encoder, angle in zip((drive.left_encoder, drive.right_encoder), naive.angle, strict=True):
        assert encoder.position == pytest.approx(counts * angle, abs=4.0, rel=0.01)


def test_a_slide_sideways_is_stopped_by_grip_and_by_nothing_else():
    """Wheels free to roll: m u' = -grip * weight."""
    params = DriveParams(tyre=Tyre(grip=0.5), ball=RollingBall(load_share=0.0))
    one = moving(params, u=1.0)
    one.push(0.0, 0.0, 2048)
    assert one.u_m_s == pytest.approx(1.0 - 0.5 * 9.81 * 2048 / 24e6, rel=1e-12)
    one = moving(params, v=1.0, left=400.0, right=400.0)
    before = one.u_m_s
    one.push(0.0, 0.0, 2048)
    assert (before, one.u_m_s) == (0.0, 0.0)


def test_full_duty_on_ice_accelerates_with_grip_and_the_encoders_run_ahead_of_the_way():
    params = DriveParams(tyre=Tyre(grip=0.1), ball=RollingBall(load_share=0.0))
    drive = DifferentialDrive(params)
    pwm(drive, 128, 128, 1200)
    time_s = drive.tick / 24e6
    assert drive.velocity_at(drive.tick)[0] == pytest.approx(0.1 * 9.81 * time_s, rel=0.01)
    rolled_m = drive.left_encoder.position / params.counts_per_radian() * 0.020 / 8
    assert rolled_m > 4.0 * drive.pose_at(drive.tick)[0] > 0.0


@pytest.mark.parametrize(("load_share", "limit_m_s2"), [(0.2, 6.28), (0.0, 7.85)])
def test_a_wheel_slips_beyond_its_grip_and_not_below(load_share, limit_m_s2):
    """With grip 0.8 at 6.28 m/s2, as the README says; with the whole weight on the wheels at 7.85."""
    params = DriveParams(
        tyre=Tyre(grip=0.8), ball=RollingBall(load_share=load_share), motor=Motor(friction_nm=0.0)
    )
    roll, rotor, step_s = 0.020 / 8, 2.7e-7, 2048 / 24e6
    slips = {}
    for share in (0.99, 1.01):
        one = moving(params)
        speed_m_s = share * limit_m_s2 * step_s
        shaft_nms = rotor * speed_m_s / roll + roll * 0.25 * speed_m_s + params.friction_nm() * step_s
        one.push(shaft_nms, shaft_nms, 2048)
        slips[share] = max(abs(slip) for slip in one.slips_m_s())
        if share < 1.0:
            assert one.v_m_s == pytest.approx(speed_m_s)
    assert slips[0.99] < 1e-12
    assert slips[1.01] > 1e-5


def test_a_turn_that_needs_more_than_the_grip_drifts_outwards():
    params = DriveParams(tyre=Tyre(grip=0.2), ball=RollingBall(load_share=0.0))
    roll, half_m = 0.020 / 8, 0.034
    one = moving(params, v=1.0, w=5.0, left=(1.0 - 5 * half_m) / roll, right=(1.0 + 5 * half_m) / roll)
    one.push(0.0, 0.0, 2048)
    assert one.u_m_s < -1e-4  # to the left is inwards
    slow = moving(params, v=0.2, w=5.0, left=(0.2 - 5 * half_m) / roll, right=(0.2 + 5 * half_m) / roll)
    slow.push(0.0, 0.0, 2048)
    assert slow.u_m_s == 0.0


@settings(max_examples=100)
@given(st.floats(0.05, 1.5), st.floats(-4.0, 4.0), st.floats(-0.04, 0.04), st.floats(0.01, 0.5))
def test_the_ball_pulls_with_its_friction_against_its_way_over_the_ground(v, w, behind_m, friction):
    """A force at the ball and its yaw torque; shafts without friction, wheels on ice, so that nothing else acts."""
    ball = RollingBall(friction=friction, load_share=0.2, behind_m=behind_m)
    params = DriveParams(
        ball=ball, tyre=Tyre(grip=0.01), motor=Motor(friction_nm=0.0), chassis=Chassis(rolling_resistance=0.0)
    )
    roll, half_m = 0.020 / 8, 0.034
    with_ball = moving(params, (v - half_m * w) / roll, (v + half_m * w) / roll, v, 0.0, w)
    free = moving(
        DriveParams(
            ball=RollingBall(load_share=0.2, behind_m=behind_m),
            tyre=Tyre(grip=10.0),
            motor=Motor(friction_nm=0.0),
            chassis=Chassis(rolling_resistance=0.0),
        ),
        *(with_ball.left_rad_s, with_ball.right_rad_s, v, 0.0, w),
    )
    ticks = 16
    with_ball.push(0.0, 0.0, ticks)
    free.push(0.0, 0.0, ticks)
    lost_ns = 0.5 * (free.v_m_s - with_ball.v_m_s)
    most_ns = friction * 0.2 * 0.5 * 9.81 * ticks / 24e6
    fast = math.hypot(v, behind_m * w)
    wheels_ns = 2 * 0.01 * 0.4 * 0.5 * 9.81 * ticks / 24e6
    assert lost_ns == pytest.approx(most_ns * v / fast, abs=wheels_ns + 1e-9)


def test_the_ball_brakes_a_turn_on_the_spot():
    still, dragged = DifferentialDrive(DriveParams()), DifferentialDrive(KINDS["ball"])
    for drive in (still, dragged):
        pwm(drive, -30, 30, 6000)
    assert 0.0 < dragged.velocity_at(dragged.tick)[1] < 0.98 * still.velocity_at(still.tick)[1]
    assert abs(dragged.velocity_at(dragged.tick)[0]) < 1e-9


@settings(max_examples=60)
@given(st.floats(1.05, 10.0), TICKS)
def test_a_standing_shaft_holds_more_and_a_turning_one_rubs_as_before(ratio, ticks):
    params = DriveParams(chassis=Chassis(stiction_ratio=ratio))
    most = params.friction_nm() * ticks / 24e6
    held, gone = moving(params), moving(params)
    held.push(0.98 * ratio * most, 0.98 * ratio * most, ticks)
    gone.push(1.02 * ratio * most, 1.02 * ratio * most, ticks)
    assert held.velocity() == (0.0, 0.0)
    assert gone.velocity()[0] > 0.0
    roll = 0.020 / 8
    rough = moving(params, 200.0, 200.0, 200.0 * roll)
    plain = Body(DriveParams(), 0.0, 0.0, 0.0)
    plain.left_rad_s = plain.right_rad_s = 200.0
    rough.push(0.0, 0.0, ticks)
    plain.push(0.0, 0.0, ticks)
    assert rough.left_rad_s == pytest.approx(plain.left_rad_s, rel=1e-12)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "all"])
@settings(max_examples=30)
@given(SPEEDS, SPEEDS, WAYS, TURNS, IMPULSES, IMPULSES)
def test_left_and_right_are_mirror_images(kind, left, right, v, w, push_left, push_right):
    """To what is left by taking the left wheel first: in the sweeps, and in the resistance of wheels with play."""
    near = 1e-3 if "play" in kind else 1e-5
    one, other = moving(KINDS[kind], left, right, v, 0.1, w), moving(KINDS[kind], right, left, v, -0.1, -w)
    one.push(push_left, push_right, 2048)
    other.push(push_right, push_left, 2048)
    assert one.left_rad_s == pytest.approx(other.right_rad_s, abs=1e-3)
    assert (one.v_m_s, one.u_m_s, one.w_rad_s) == pytest.approx(
        (other.v_m_s, -other.u_m_s, -other.w_rad_s), abs=near
    )


@given(SPEEDS, SPEEDS, WAYS, WAYS, TURNS, st.integers(0, 2048))
def test_looking_ahead_is_pure_and_goes_on_at_the_speed_of_now(left, right, v, u, w, ticks):
    one = moving(ALL, left, right, v, u, w)
    before = snapshot(one)
    x, y, theta = one.pose_after(ticks)
    assert snapshot(one) == before
    time_s = ticks / 24e6
    assert theta == pytest.approx(w * time_s)
    assert math.hypot(x, y) == pytest.approx(math.hypot(u, v) * time_s, rel=1e-5, abs=1e-15)


def test_with_every_switch_off_the_body_is_the_one_that_only_rolls():
    drive = DifferentialDrive(
        DriveParams(ball=RollingBall(load_share=0.5), disturbance=Disturbance(period_s=3.0))
    )
    assert type(drive.body) is Body
    assert drive.rough is None


def test_inside_the_backlash_the_shaft_turns_alone_and_then_takes_the_wheel_along():
    """0.1 rad at the wheel are 0.8 rad of the shaft, which stands in the middle at first."""
    one = moving(DriveParams(chassis=Chassis(gear_backlash_rad=0.1)))
    turned = 0.0
    for _ in range(300):
        one.push(1e-7, 1e-7, 2048)
        turned += one.turned_left_rad[0] if one.v_m_s == 0.0 else 0.0
    assert turned == pytest.approx(0.4, abs=0.01)
    assert one.v_m_s > 0.02
    assert one.slips_m_s() == pytest.approx((0.0, 0.0), abs=1e-12)


def test_a_shaft_that_reverses_goes_through_all_the_backlash_before_the_wheel_follows():
    one = moving(DriveParams(chassis=Chassis(gear_backlash_rad=0.1, rolling_resistance=0.0)))
    for _ in range(300):
        one.push(1e-7, 1e-7, 2048)
    forward_m_s, turned = one.v_m_s, 0.0
    for _ in range(300):
        one.push(-1e-7, -1e-7, 2048)
        if one.v_m_s == forward_m_s:
            turned += one.turned_left_rad[0] - forward_m_s / one.left_m_rad * 2048 / 24e6
    assert turned == pytest.approx(-0.8, abs=0.02)
    assert one.v_m_s < 0.9 * forward_m_s


def test_load_friction_takes_its_share_of_the_torque_that_accelerates_the_robot():
    """The chassis gets F = (T - friction - share r F - J a / r) / r from the motor's torque T."""
    params = DriveParams(chassis=Chassis(gear_load_friction=0.25))
    one = moving(params)
    step_s, torque_nm = 2048 / 24e6, 5e-3
    for _ in range(20):
        before = one.v_m_s
        one.push(torque_nm * step_s, torque_nm * step_s, 2048)
    roll, mass = one.left_m_rad, 0.25
    expected = (torque_nm - params.friction_nm()) / (1.25 * roll * mass + 2.7e-7 / roll)
    assert (one.v_m_s - before) / step_s == pytest.approx(expected, rel=1e-4)


SECOND = 24_000_000
TICK = st.integers(0, 1 << 40)


def at(params, tick, seed=0):
    force = DisturbingForce(params, Stream(seed, "disturbance"))
    force.at(tick)
    return force.force_n, force.torque_nm


@given(TICK)
def test_a_constant_is_constant(tick):
    assert at(Disturbance(force_n=0.5, torque_nm=-0.01), tick) == (0.5, -0.01)


@given(TICK, st.floats(0.001, 100.0))
def test_the_sine_has_its_amplitude_and_period_and_begins_at_zero(tick, period_s):
    params = Disturbance(sine_force_n=2.0, sine_torque_nm=0.05, period_s=period_s)
    period = int(period_s * SECOND + 0.5)
    force, torque = at(params, tick)
    assert force == pytest.approx(2.0 * math.sin(2.0 * math.pi * (tick % period) / period), abs=1e-12)
    assert torque == pytest.approx(force / 40.0, abs=1e-12)
    assert at(params, 0) == (0.0, 0.0)


@given(TICK)
def test_noise_is_within_its_bounds_holds_for_a_period_and_is_that_of_the_seed(tick):
    params = Disturbance(noise_force_n=1.0, noise_torque_nm=0.02, period_s=0.5)
    period = SECOND // 2
    begun = tick // period * period
    force, torque = at(params, tick)
    assert (force, torque) == at(params, begun) == at(params, begun + period - 1)
    draws = Stream(0, "disturbance")
    assert force == 2.0 * draws.uniform(2 * (tick // period)) - 1.0
    assert torque == 0.02 * (2.0 * draws.uniform(2 * (tick // period) + 1) - 1.0)
    assert (force, torque) != at(params, tick, seed=1)
    assert (force, torque) != at(params, begun + period)


def test_what_is_off_is_zero():
    assert at(Disturbance(), 12345) == (0.0, 0.0)
    assert not Disturbance(period_s=0.1).is_on()


def test_a_force_and_a_torque_accelerate_mass_and_inertia():
    """Wheels on ice with shafts that turn freely: of the rotors' inertia nearly nothing is felt."""
    params = DriveParams(
        motor=Motor(friction_nm=0.0, rotor_inertia_kg_m2=1e-13, torque_constant_nm_a=2e-5),
        encoder=OpticalEncoder(lines=16),
        chassis=Chassis(rolling_resistance=0.0),
        tyre=Tyre(grip=0.01),
        ball=RollingBall(load_share=0.0),
        disturbance=Disturbance(force_n=0.5, torque_nm=0.002),
    )
    drive = DifferentialDrive(params)
    drive.body.push(0.0, 0.0, 1)  # before the first look at the force there is none
    assert drive.velocity_at(0) == (0.0, 0.0)
    for _ in range(100):
        drive.rough.forces.at(0)
        drive.body.push(0.0, 0.0, 2048)
    time_s = 100 * 2048 / 24e6
    v, w = drive.velocity_at(0)
    assert v == pytest.approx(0.5 / 0.5 * time_s, rel=1e-3)
    assert w == pytest.approx(0.002 / 4.7e-4 * time_s, rel=1e-3)


def test_a_force_below_the_friction_of_the_drive_moves_nothing():
    """Friction holds 0.17 N at each rim: 0.34 N along, or 11.7 mNm."""
    drive = DifferentialDrive(DriveParams(disturbance=Disturbance(force_n=0.2, torque_nm=0.004)))
    drive.advance(SECOND)
    assert drive.pose_at(drive.tick) == (0.0, 0.0, 0.0)
    drive = DifferentialDrive(DriveParams(disturbance=Disturbance(force_n=0.2, torque_nm=0.006)))
    drive.advance(SECOND)
    assert drive.pose_at(drive.tick)[0] > 0.0


# A blocked wheel


@pytest.mark.parametrize("kind", ["rolls", *KINDS])
@given(SPEEDS, SPEEDS, IMPULSES, IMPULSES, TICKS)
def test_a_blocked_shaft_stands_and_only_takes_energy(kind, left, right, push_left, push_right, ticks):
    params = KINDS.get(kind, DriveParams())
    one = (Body if kind == "rolls" else RoughBody)(params, 0.0, 0.0, 0.0)
    one.left_rad_s, one.right_rad_s = left, right
    if kind != "rolls":
        one.v_m_s, one.w_rad_s = one.velocity()
    one.left_brake_nm = BLOCKED_NM
    for number in range(20):
        before = kinetic_energy_j(one)
        pushed = number % 2
        one.push(pushed * push_left, pushed * push_right, ticks)
        assert one.left_rad_s == 0.0
        assert pushed or kinetic_energy_j(one) <= before * (1.0 + 1e-15)
    if kind == "rolls":
        # What the other one gains is what a robot has that turns about the blocked wheel.
        speed = one.right_rad_s
        one.push(0.0, 1e-5, 24)
        most = one.friction_nm * 24 / 24e6
        assert one.right_rad_s - speed == pytest.approx(1e-5 / one.mass_rr, abs=2.0 * most / one.mass_rr)
