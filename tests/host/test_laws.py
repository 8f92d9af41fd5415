"""The interface of a law: what it is given, how its answer is taken, and what is refused."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.plugins import PluginError
from miro_host.integrator import Integrator, Limits
from miro_host.laws.epsilon_tracking import RETUNED
from miro_host.laws.interface import Law, LawParameters, Velocities
from miro_host.laws.yang_kim import Gains
from miro_host.pilot import PERIOD_S, Pilot
from miro_host.posture import Posture
from miro_host.references.arc import StraightLine
from miro_host.telemetry_receiver import LastTelemetry
from tests.host.own_laws import Leaky, LeakyParameters, Wrong, WrongParameters
from tests.states import restore, snapshot, values

HERE = Posture(0.07, 0.02, -0.38)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
HEARD = LastTelemetry(1, 2, 0, 0, 0, 100, -100, 7, 0)


class Listening(Law[LawParameters]):
    """Keeps what it was given."""

    NOT_STATE = ("parameters", "given")
    given = None

    def step(self, given):
        self.given = given
        return Velocities(0.1, 0.2)


class Any(LawParameters, frozen=True, tag="any"):
    pass


def pilot(law, **options):
    return Pilot(StraightLine(), law, **options)


def test_a_law_is_given_the_measurement_the_reference_and_the_last_answer_of_its_robot():
    law = Listening(Any())
    one = pilot(law, reference_lead_s=0.5)
    one.update(HERE, 1.0, HEARD)
    command = one.update(HERE, 1.0 + PERIOD_S, HEARD)
    assert (law.given.posture, law.given.telemetry) == (HERE, HEARD)
    assert law.given.t_s == 1.0 + PERIOD_S + 0.5
    assert law.given.reference == law.given.path.at(law.given.t_s)
    assert law.given.period_s == PERIOD_S
    assert (law.given.v_m_s, law.given.w_rad_s) == (command.v_m_s, command.w_rad_s) == (0.1, 0.2)


def test_a_law_is_not_asked_without_a_measurement():
    law = Leaky(LeakyParameters())
    one = pilot(law)
    one.update(HERE, 0.0)
    one.update(None, PERIOD_S)
    assert law.periods == 1


@given(st.tuples(FINITE, FINITE), st.tuples(FINITE, FINITE))
def test_velocities_are_taken_as_far_as_the_limits_of_velocity_and_rate_allow(first, second):
    limits = Limits(max_v_m_s=0.8, max_w_rad_s=4.0, max_v_dot_m_s2=6.0, max_w_dot_rad_s2=60.0)
    one = Integrator(limits, PERIOD_S)
    for v, w in (first, second):
        before = (one.v_m_s, one.w_rad_s)
        one.go_to(v, w)
        for wanted, was, now, most, rate in (
            (v, before[0], one.v_m_s, 0.8, 6.0),
            (w, before[1], one.w_rad_s, 4.0, 60.0),
        ):
            inside = min(max(wanted, -most), most)
            assert abs(now) <= most
            assert now == inside if abs(inside - was) <= PERIOD_S * rate else abs(now - was) > 0.0
            assert abs(now - was) <= PERIOD_S * rate * (1 + 1e-12)


def test_before_the_first_measurement_every_inner_value_is_there_and_zero():
    assert pilot(Leaky(LeakyParameters())).update(None, 0.0).inner == {"error_m": 0.0}


@pytest.mark.parametrize("parameters", [LeakyParameters(), RETUNED], ids=["leaky", "epsilon tracking"])
def test_what_a_law_remembers_is_saved_with_the_pilot_and_makes_the_same_commands(parameters):
    whole, cut = pilot(parameters.law()), pilot(parameters.law())
    postures = [Posture(0.01 * k, 0.0, math.remainder(0.9 * k, math.tau)) for k in range(8)]
    commands = [whole.update(posture, k * PERIOD_S) for k, posture in enumerate(postures)]
    for k, posture in enumerate(postures):
        other = pilot(parameters.law())
        restore(other, snapshot(cut))
        cut = other
        assert cut.update(posture, k * PERIOD_S) == commands[k]
    assert snapshot(cut) == snapshot(whole)


def test_a_law_without_memory_adds_nothing_to_the_state():
    assert list(values(pilot(Gains().law()))) == ["integrator.v_m_s", "integrator.w_rad_s", "numbers"]


@pytest.mark.parametrize(
    ("how", "reason"),
    [
        ("nan", "`step` returned v_m_s = nan, which is not a finite float"),
        ("infinite", "`step` returned w_dot_rad_s2 = -inf, which is not a finite float"),
        ("inner nan", "`step` returned a = nan, which is not a finite float"),
        ("inner names", r"its inner values are \['b'\], but INNER declares \['a'\]"),
        ("int", "`step` returned v_m_s = 1, which is not a finite float"),
        ("nothing", "`step` returned 'None', neither Accelerations nor Velocities"),
        ("raises", "ZeroDivisionError: division by zero"),
        ("memory nan", "attribute 'memory' is nan, not a finite float"),
        ("memory type", "attribute 'memory' is text, not a finite float"),
        ("undeclared", "attribute 'hidden' is neither in STATE nor in NOT_STATE"),
    ],
)
def test_a_law_that_fails_is_named_and_leaves_the_command_as_it_was(how, reason):
    one = pilot(Wrong(WrongParameters(how=how)))
    before = one.update(HERE, 0.0)
    with pytest.raises(
        PluginError, match=rf"law 'wrong' failed: {reason} \(.*own_laws.py:\d+ in Wrong.step\); mend the law"
    ):
        one.update(HERE, PERIOD_S)
    assert one.command == before
    assert math.isfinite(one.integrator.v_m_s)


def test_a_name_that_a_law_declares_twice_stands_for_no_other():
    class Twice(Wrong):
        INNER = ("a", "a")

        def step(self, given):
            return Velocities(0.1, 0.0, {"a": 1.0, "b": 2.0})

    with pytest.raises(PluginError, match=r"values are \['a', 'b'\], but INNER declares \['a', 'a'\]"):
        pilot(Twice(WrongParameters())).update(HERE, 0.0)


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ([0x8001, 0, 1.0, 1.0, 0.1, 0.0, 0.0], "no frame carries"),
        ([0, -0x8001, 1.0, 1.0, 0.1, 0.0, 0.0], "no frame carries"),
        ([0.5, 0, 1.0, 1.0, 0.1, 0.0, 0.0], "no frame carries"),
        ([0, 0, 0.4, 1.0, 0.1, 0.0, 0.0], "are those of no robot"),
        ([0, 0, 1.0, -1.0, 0.1, 0.0, 0.0], "are those of no robot"),
        ([0, 0, 1.0, 1.0, math.inf, 0.0, 0.0], "numbers is inf"),
        ([0, 0, 1.0, 1.0, 0.1, 0.0, math.nan], "numbers is NaN"),
        ([0, 0, 1.0, 1.0, 0.1, 0.0], "shorter"),
        ([0, 0, 1.0, 1.0, 0.1, 0.0, 0.0, 0.0], "longer"),
        ([0, 0, 1.0, 1.0, 0.1], "not enough values"),
        ([], "not enough values"),
    ],
)
def test_a_saved_command_that_no_pilot_gave_is_refused(command, reason):
    one = pilot(Leaky(LeakyParameters()))
    before = snapshot(one)
    numbers = struct.pack("<I7d", 7, *one.numbers)
    assert before.endswith(numbers)
    with pytest.raises(ValueError, match=reason):
        restore(one, before[: -len(numbers)] + struct.pack(f"<I{len(command)}d", len(command), *command))
    assert snapshot(one) == before


def test_numbers_far_from_any_robots_are_not_called_a_mistake_of_the_law():
    one = pilot(Gains().law())
    with pytest.raises(PluginError, match=r"law 'yang_kim' failed: angle .*; the parameters are far outside"):
        one.update(Posture(0.0, 0.0, 1e300), 1.0)


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("error_m", math.nan, "'error_m' is nan"),
        ("periods", 1 << 63, "'periods' is 92"),
        ("periods", True, "'periods' is True"),
        ("begun", 1, "'begun' is 1, not True"),
        ("headings_rad", [0.0], "not a list of 2 items"),
        ("headings_rad", [0.0, "a"], r"headings_rad\[1\]' is a"),
    ],
)
def test_a_memory_that_is_not_as_declared_is_noticed(name, value, reason):
    law = Leaky(LeakyParameters())
    law.check_memory()
    setattr(law, name, value)
    with pytest.raises(ValueError, match=reason):
        law.check_memory()


@pytest.mark.parametrize("code", ["", "x", "0d", "dd", "65537d"])
def test_a_type_that_the_table_does_not_know_is_refused(code):
    class Odd(Law[LawParameters]):
        STATE = {"x": code}

    law = Odd(Any())
    law.x = 1.0
    with pytest.raises(ValueError, match=r"STATE\['x'\]"):
        law.check_memory()
