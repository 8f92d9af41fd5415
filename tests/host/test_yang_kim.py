"""The law against the paper: its twin in 40 digits, its algebra, and its guards."""

import math

import msgspec
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from miro_host.laws.yang_kim import Gains, guarded_inverse, saturation, sign
from miro_host.posture import Posture
from miro_host.references.arc import StraightLine
from tests.host.driving import ANY_PATH, POSTURES, SPEEDS, TIMES, TURNS
from tests.host.theory.paper_law import YangKim
from tests.naive import host_control as naive

SATURATING = Gains(1.7, 3.0, 0.53, 0.72, 0.19, 0.69)
SLOPED = Gains(1.7, 3.0, 0.53, 0.72, 0.19, 0.69, layer_theta_rad=0.4, layer_derivative=True)
SWITCHING = Gains(1.7, 3.0, 0.53, 0.72, 0.19, 0.69, switching="sign", cosine_guard=0.0, rho_floor_m=1e-9)


def twin(gains):
    """The gains by the twin's names."""
    layers = ("layer_s1_m_s", "layer_s2_rad_s", "layer_theta_rad")
    names = ("gamma1_per_s", "gamma2_per_s", "q1_per_s", "q2_per_s", "p1_m_s2", "p2_rad_s2")
    names += ("cosine_guard", "rho_floor_m", *layers)
    given_ = msgspec.structs.asdict(gains)
    if gains.switching == "sign":
        given_ |= dict.fromkeys(layers)
    short = ("g1", "g2", "q1", "q2", "p1", "p2", "d", "floor", "w1", "w2", "wt")
    named = {theirs: given_[ours] for theirs, ours in zip(short, names, strict=True)}
    return named | {"layer_derivative": gains.layer_derivative}


def values(c):
    return c.rho_e_m, c.phi_e_rad, c.theta_e_rad, c.s1, c.s2, c.u1, c.u2


def away_from_switches(c):
    return min(abs(c.theta_e_rad), abs(c.s1), abs(c.s2), abs(c.phi_e_rad)) > 1e-9 and all(
        abs(abs(angle) - math.pi) > 1e-9 for angle in (c.theta_e_rad, c.phi_e_rad)
    )


@pytest.mark.parametrize(
    "gains", [SATURATING, SWITCHING, SLOPED], ids=["saturation", "sign", "layer derivative"]
)
@settings(max_examples=80)
@given(ANY_PATH, TIMES, POSTURES, SPEEDS, TURNS)
def test_surfaces_and_inputs_equal_the_papers_formulas(gains, path, t, posture, v, w):
    r = path.at(t)
    assume(math.hypot(posture.x_m, posture.y_m) > 0.01)
    alpha = math.atan2(posture.y_m, posture.x_m) - posture.theta_rad
    assume(gains.cosine_guard > 0.0 or abs(math.cos(alpha)) > 0.01)
    got = YangKim(gains).control(r, posture, v, w)
    assume(away_from_switches(got))
    assume(abs(abs(got.theta_e_rad) - gains.layer_theta_rad) > 1e-6)
    reference = (r.rho_m, r.phi_rad, r.posture.theta_rad, r.v_m_s, r.w_rad_s, r.v_dot_m_s2)
    expected = naive.law(twin(gains), reference, (posture.x_m, posture.y_m, posture.theta_rad), v, w)
    assert (got.s1, got.s2, got.u1, got.u2) == pytest.approx([float(x) for x in expected], rel=1e-9, abs=1e-9)


@given(TIMES, POSTURES, SPEEDS, TURNS, st.sampled_from([SATURATING, SWITCHING]))
def test_the_mirrored_robot_on_the_line_gets_the_mirrored_answer(t, posture, v, w, gains):
    assume(abs(posture.y_m) > 1e-6)  # not on the seam of phi_e, where one side is as good as the other
    assume(abs(math.cos(math.atan2(posture.y_m, posture.x_m) - posture.theta_rad)) > 1e-6)
    law, r = YangKim(gains), StraightLine().at(t)
    one = law.control(r, posture, v, w)
    other = law.control(r, Posture(posture.x_m, -posture.y_m, -posture.theta_rad), v, -w)
    assert (other.s1, other.u1, other.s2, other.u2) == (one.s1, one.u1, -one.s2, -one.u2)


@given(ANY_PATH, st.floats(-1.0, 7.0), POSTURES, SPEEDS, TURNS)
def test_with_the_guards_every_posture_has_a_bounded_answer(path, t, posture, v, w):
    c = YangKim(SATURATING).control(path.at(t), posture, v, w)
    assert abs(c.u1) < 600.0
    assert abs(c.u2) < 300.0


def test_the_guarded_factor_keeps_the_sign_and_vanishes_at_the_singularity():
    law = YangKim(SATURATING)
    r = StraightLine().at(2.0)
    across = law.control(r, Posture(0.3, 0.0, math.pi / 2), 0.0, 0.0)
    assert abs(across.u1) < 1e-12
    towards, away = (law.control(r, Posture(0.3, 0.0, angle), 0.0, 0.0) for angle in (0.0, math.pi))
    assert away.u1 == pytest.approx(-towards.u1, rel=1e-12)


def test_without_guard_the_singularity_is_named():
    with pytest.raises(ValueError, match="assumption 3"):
        guarded_inverse(0.0, SWITCHING.cosine_guard)


def test_sign_and_saturation_at_their_corners():
    assert [sign(x) for x in (-2.0, -0.0, 0.0, 1e-300)] == [-1.0, 0.0, 0.0, 1.0]
    assert [saturation(x, 0.5) for x in (-0.6, -0.5, -0.25, 0.0, 0.5)] == [-1.0, -1.0, -0.5, 0.0, 1.0]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("p1_m_s2", -0.1),
        ("layer_s1_m_s", 0.0),
        ("rho_floor_m", 0.0),
        ("switching", "relay"),
        ("q2_per_s", math.nan),
    ],
)
def test_gains_name_what_is_wrong_with_them(name, value):
    with pytest.raises(ValueError, match=name):
        Gains(**{name: value})


@given(ANY_PATH, TIMES, POSTURES, SPEEDS, TURNS)
def test_outside_the_layer_its_derivative_changes_no_bit(path, t, posture, v, w):
    published = YangKim(msgspec.structs.replace(SLOPED, layer_derivative=False)).control(
        path.at(t), posture, v, w
    )
    sloped = YangKim(SLOPED).control(path.at(t), posture, v, w)
    if abs(sloped.theta_e_rad) >= SLOPED.layer_theta_rad or sloped.phi_e_rad == 0.0:
        assert values(sloped) == values(published)
    else:
        assert (sloped.u1, sloped.s1, sloped.s2) == (published.u1, published.s1, published.s2)
