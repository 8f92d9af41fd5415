"""Parameters of every law that cannot be used are refused in a scenario, with their path."""

import msgspec
import pytest

from miro_host.registries import LAWS
from miro_sim.scenario.file import ScenarioError, load

PLACE = "network.robot.controller"
NUMBERS = [
    (law, field.name)
    for law in LAWS.own
    for field in msgspec.structs.fields(LAWS.find(law))
    if isinstance(field.default, float)
]


def refusal(law, **keys):
    table = ", ".join(f"{key} = {value}" for key, value in {"law": f'"{law}"', **keys}.items())
    with pytest.raises(ScenarioError) as caught:
        load("fig6", [f"{PLACE}={{{table}}}"])
    message = str(caught.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize(("law", "key"), NUMBERS)
@pytest.mark.parametrize("value", ["-0.1", "1e9", "nan", "inf", "'1'", "true"])
def test_a_number_that_no_law_can_use_is_refused_with_its_path(law, key, value):
    message = refusal(law, **{key: value})
    assert message.startswith("fig6: ")
    assert f"controller.{key}: " in message


NOT_0 = ("layer_", "max_", "cosine_guard", "turn_guard", "rho_floor", "v_floor", "demand_width")
NOT_0 += ("epsilon", "alpha", "beta", "length")


@pytest.mark.parametrize(("law", "key"), [(law, key) for law, key in NUMBERS if key.startswith(NOT_0)])
def test_a_limit_a_guard_or_a_width_of_0_is_refused(law, key):
    assert f"controller.{key}: 0 is out of range" in refusal(law, **{key: 0})


@pytest.mark.parametrize(("law", "key"), [(law, key) for law, key in NUMBERS if key.startswith("layer_")])
def test_a_boundary_layer_may_be_thinner_than_a_period_sees(law, key):
    load("fig6", [f'{PLACE}={{law = "{law}", {key} = 1e-6}}'])


@pytest.mark.parametrize(
    ("law", "keys", "expected"),
    [
        (
            "yang_kim",
            {"switching": "'sign'", "layer_derivative": "true"},
            "controller.layer_derivative: with switching = 'sign' theta_e has no layer; leave it out",
        ),
        (
            "dynamic_feedback",
            {"v_floor_m_s": 0.5, "max_v_m_s": 0.4},
            "controller.v_floor_m_s: 0.5 is more than max_v_m_s = 0.4; no speed would be left",
        ),
        ("yang_kim", {"switching": "'relay'"}, "controller.switching: 'relay' is not one of the choices"),
        (
            "epsilon_tracking",
            {"sigma": "'exact'"},
            "controller.sigma: 'exact' is not one of the choices; use ",
        ),
        ("epsilon_tracking", {"switching": "'relay'"}, "controller.switching: 'relay' is not one of the"),
        ("body_frame", {"demand_rad": 1.6}, "controller.demand_rad: 1.6 is out of range"),
        (
            "kanayama",
            {"gamma1_per_s": 1},
            "controller.gamma1_per_s: unknown key; it belongs to the law 'yang_kim'",
        ),
    ],
)
def test_values_that_make_no_sense_together_or_here_are_refused(law, keys, expected):
    assert expected in refusal(law, **keys)
