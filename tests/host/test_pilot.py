"""One robot's chain: order of the steps, missing measurements, clamps, and that nothing is forgotten."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_host.integrator import AdamsBashforth, Integrator, Limits, integrator_of
from miro_host.laws.yang_kim import Gains
from miro_host.pilot import PERIOD_S, STANDSTILL, Pilot
from miro_host.posture import Posture
from miro_host.references.arc import StraightLine
from miro_host.wheels import wheel_command
from tests.host.theory.paper_law import YangKim
from tests.states import restore, snapshot

LAW = YangKim(Gains())
START = Posture(0.07, 0.02, -0.38)
ACCELERATIONS = st.floats(-1e4, 1e4)


def pilot(**options):
    return Pilot(StraightLine(), LAW, **options)


def test_before_the_first_measurement_the_command_is_zero():
    one = pilot()
    still = msgspec.structs.replace(STANDSTILL, inner={"u1": 0.0, "u2": 0.0, "s1": 0.0, "s2": 0.0})
    assert [one.update(None, k * PERIOD_S) for k in range(3)] == [still] * 3


def test_a_lost_measurement_repeats_the_command_and_leaves_the_integrator_alone():
    one = pilot()
    command = one.update(START, 0.4)
    before = snapshot(one)
    assert one.update(None, 0.5) == command != STANDSTILL
    assert snapshot(one) == before


def test_the_command_is_the_integral_of_reference_acceleration_and_input():
    one = pilot()
    first = one.update(START, 0.1)
    assert first.v_m_s == pytest.approx(PERIOD_S * (0.4 + first.inner["u1"]))
    assert first.w_rad_s == pytest.approx(PERIOD_S * first.inner["u2"])
    second = one.update(START, 0.1 + PERIOD_S)
    assert second.v_m_s == pytest.approx(first.v_m_s + PERIOD_S * (0.4 + second.inner["u1"]))


def test_the_law_is_given_the_commanded_velocity_of_the_period_before():
    one = pilot()
    first = one.update(START, 1.0)
    expected = LAW.control(StraightLine().at(1.1), START, first.v_m_s, first.w_rad_s)
    assert one.update(START, 1.1).inner["u1"] == expected.u1


def test_the_lead_shifts_the_reference_and_nothing_else():
    plain, led = pilot(), pilot(reference_lead_s=0.125)
    assert led.update(START, 1.0) == plain.update(START, 1.125)


def test_the_wheel_commands_are_those_of_the_integrator():
    one = pilot()
    command = one.update(START, 2.0)
    assert (command.left, command.right) == wheel_command(one.wheels, command.v_m_s, command.w_rad_s)


@given(st.lists(st.tuples(ACCELERATIONS, ACCELERATIONS), max_size=30))
def test_the_integrator_stays_within_its_limits_and_comes_back_at_once(inputs):
    limits = Limits()
    one = Integrator(limits, PERIOD_S)
    for v_dot, w_dot in inputs:
        before = (one.v_m_s, one.w_rad_s)
        one.step(v_dot, w_dot)
        assert abs(one.v_m_s) <= limits.max_v_m_s
        assert abs(one.w_rad_s) <= limits.max_w_rad_s
        assert abs(one.v_m_s - before[0]) <= PERIOD_S * limits.max_v_dot_m_s2 * (1 + 1e-12)
    for _ in range(100):
        one.step(1e9, 1e9)
    one.step(-1.0, -1.0)  # no wind-up: the first opposite input shows
    assert one.v_m_s == limits.max_v_m_s - PERIOD_S
    assert one.w_rad_s == limits.max_w_rad_s - PERIOD_S


def integrated(integrator, acceleration, count):
    """Speeds over periods of PERIOD_S under an acceleration that is a function of time."""
    return [(integrator.step(acceleration(k * PERIOD_S), 0.0), integrator.v_m_s)[1] for k in range(count)]


WIDE = Limits(max_v_m_s=1e5, max_v_dot_m_s2=1e5)


def test_of_a_ramp_of_acceleration_the_second_rule_has_no_error_and_eulers_half_a_step():
    euler = integrated(Integrator(WIDE, PERIOD_S), lambda t: 6.0 * t, 30)
    second = integrated(AdamsBashforth(WIDE, PERIOD_S), lambda t: 6.0 * t, 30)
    for k in range(2, 30):
        exact = 3.0 * (k * PERIOD_S) ** 2
        assert second[k - 1] - second[0] == pytest.approx(exact - 3.0 * PERIOD_S**2, rel=1e-12)
        assert euler[k - 1] - exact == pytest.approx(-3.0 * k * PERIOD_S**2, rel=1e-9)


def test_under_a_constant_acceleration_both_rules_are_one():
    euler = integrated(Integrator(WIDE, PERIOD_S), lambda t: 2.0, 20)
    assert integrated(AdamsBashforth(WIDE, PERIOD_S), lambda t: 2.0, 20) == pytest.approx(euler, rel=1e-14)


def test_after_velocities_the_second_rule_begins_anew():
    one, other = AdamsBashforth(WIDE, PERIOD_S), AdamsBashforth(WIDE, PERIOD_S)
    one.step(50.0, -3.0)
    for each in (one, other):
        each.go_to(0.5, 0.1)
        each.step(1.0, 1.0)
    assert (one.v_m_s, one.w_rad_s) == (other.v_m_s, other.w_rad_s) == (0.5 + PERIOD_S, 0.1 + PERIOD_S)


def test_the_rule_is_chosen_by_name_and_its_memory_is_saved():
    assert type(integrator_of("euler", Limits(), PERIOD_S)) is Integrator
    one, other = (integrator_of("adams_bashforth", Limits(), PERIOD_S) for _ in range(2))
    one.step(1.0, 2.0)
    restore(other, snapshot(one))
    for each in (one, other):
        each.step(3.0, -2.0)
    assert (one.v_m_s, one.w_rad_s) == (other.v_m_s, other.w_rad_s)
    assert type(other) is AdamsBashforth


@pytest.mark.parametrize("name", ["max_v_m_s", "max_w_rad_s", "max_v_dot_m_s2", "max_w_dot_rad_s2"])
def test_limits_name_what_is_wrong_with_them(name):
    with pytest.raises(ValueError, match=name):
        Limits(**{name: 0.0})
    with pytest.raises(ValueError, match="period_s"):
        Integrator(Limits(), 0.0)
