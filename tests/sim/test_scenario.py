"""Scenario files: what is accepted, and the one line that says what is wrong."""

import math
import re
import time
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.plugins import use_one_of
from miro_host.estimators.predict import NoEstimator, PredictParameters
from miro_host.registries import LAWS
from miro_robot.lm629.options import CHOICES
from miro_sim.scenario.camera_keys import PixelCamera
from miro_sim.scenario.file import ScenarioError, builtin_text, load, parse
from miro_sim.scenario.keys import Scenario
from tests.sim.world.rig import finished, world_of

SMALL = """
name = "small"
duration_s = 1
[[network]]
[[network.robot]]
reference.kind = "line"
"""
CAMERAS = "pixels, geometric or gaussian"
LAW_CHOICES = use_one_of(LAWS.own)
REFERENCES = "line, arc, sine, waypoints or timed"
NO_ARRAY = "expected an array of tables, got a table"


def refusal(text):
    with pytest.raises(ScenarioError) as caught:
        parse(text, "my.toml")
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("my.toml: ")
    return message


def edited(change):
    """fig6 with one line changed: `KEY = NEW` gives a key another value, `OLD -> NEW` puts other text in."""
    old, arrow, new = change.rpartition(" -> ")
    text = builtin_text("fig6")
    if not arrow:
        old = re.search(rf"\b{new.partition(' =')[0]} = [^#\n]*", text)[0].rstrip()
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize("name", ["fig6", "fig8"])
def test_a_built_in_scenario_names_itself_and_names_every_key(name):
    loaded = load(name)
    assert loaded.scenario.name == name
    raw = msgspec.to_builtins(loaded.scenario)
    keys = {line.partition("=")[0].strip("# ") for line in loaded.text.splitlines() if "=" in line}
    robot = raw["network"][0]["robot"][0]
    tables = [raw, raw["camera"], raw["host"], raw["network"][0]["radio"], robot]
    tables += [robot["reference"], robot["controller"], raw["network"][0]["control_noise"]]
    for table in tables:
        leaves = {key for key, value in table.items() if isinstance(value, (bool, int, float, str))}
        assert leaves <= keys


def test_what_is_left_out_is_the_realistic_loop():
    scenario = parse(SMALL, "small")
    camera, radio = scenario.camera, scenario.networks[0].radio
    assert isinstance(camera, PixelCamera)
    assert (camera.calibration, camera.centroid, camera.delay_frames) == ("1997", "binary", 1)
    assert camera.calibration_errors.worst_cm == 2.40
    assert scenario.host.compute_s == 0.003
    assert (radio.carrier, radio.bit_error_rate, radio.keyup_s) == ("keyed", 1e-4, 0.001)
    assert scenario.networks[0].robot[0].wheel_radius_mismatch == 0.015


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ("duration_s -> duration_ms", "duration_ms: unknown key; use duration_s, in seconds"),
        ("heading_deg -> heading_rad", "reference.heading_rad: unknown key; use heading_deg, in degrees"),
        ("window_px -> windows_px", "camera.windows_px: unknown key; did you mean window_px?"),
        ("[camera] -> [cammera]", "cammera: unknown key; did you mean camera?"),
        ("duration_s = 6.0 -> ", "duration_s: this key is missing; add it"),
        ("duration_s = '6 s'", "duration_s: expected a number in seconds, got a string ('6 s')"),
        ("duration_s = -6.0", "duration_s: -6.0 is out of range; must be > 0.0 in seconds"),
        ("duration_s = nan", "duration_s: nan is not a number"),
        ("duration_s = inf", "duration_s: inf is not a number"),
        ("robots = 4", "network[0].robots: 4 is not one of the choices; use 3 or 5: slots of a"),
        ("slot = 3", "network[0].robot[0]: slot 3 does not exist on a network of 3 robots; use 0 to 2"),
        ("slot = 5", "network[0].robot[0].slot: 5 is out of range; must be <= 4"),
        ('kind = "line" -> kid = "line"', f"reference.kind: this key is missing; use {REFERENCES}"),
        ('"line" -> "spiral"', f"reference.kind: 'spiral' is not one of the choices; use {REFERENCES}"),
        ('switching = "sing"', "switching: 'sing' is not one of the choices; use saturation or sign"),
        ('law = "pid"', f"controller.law: 'pid' is not one of the choices; {LAW_CHOICES}"),
        ("kind = true", f"camera.kind: expected a string, got true or false (True); use {CAMERAS}"),
        ('kind = "pixel"', f"camera.kind: 'pixel' is not one of the choices; use {CAMERAS}"),
        ('kind = "pixels" -> noise = "none"', f"camera.kind: this key is missing; use {CAMERAS}"),
        (
            'calibration = "1997" -> noise = 1',
            "camera.noise: unknown key; keys here: kind, centroid, window_px",
        ),
        ("squelch = 0", "radio.squelch: expected true or false, got a whole number (0)"),
        ("keyup_s = 0.03", "radio.keyup_s: 0.03 s and a frame of 23 characters do not fit"),
        ("[[network]] -> [network]", f"network: {NO_ARRAY}; write its header in double"),
        ('name = "a/b"', "name: 'a/b' is not a name"),
        ("stop_on_fault = yes", "line 9, column 17: not TOML: Invalid value"),
    ],
)
def test_a_bad_key_is_named_with_its_place_and_its_remedy(change, expected):
    assert expected in refusal(edited(change))


ESTIMATOR = SMALL + "[network.robot.estimator]\n"


def test_an_estimator_is_chosen_like_a_law_and_none_is_the_default():
    chosen = parse(ESTIMATOR + 'kind = "predict"\nahead_s = 0.02\n', "small").networks[0].robot[0].estimator
    assert chosen == PredictParameters(ahead_s=0.02)
    assert parse(SMALL, "small").networks[0].robot[0].estimator == NoEstimator()


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (
            'kind = "kalman"',
            "kind: 'kalman' is not one of the choices; use none, ekf, ekf+telemetry or predict",
        ),
        ('kind = "predict"\nahead = 1', "ahead: unknown key; use ahead_s, in seconds"),
        ('kind = "predict"\nahead_s = 1', "ahead_s: 1 is out of range; must be <= 0.25 in seconds"),
    ],
)
def test_an_estimator_is_checked_like_a_law(lines, expected):
    assert f"estimator.{expected}" in refusal(f"{ESTIMATOR}{lines}\n")


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("motor.resistance_ohm = -2.0", "-2.0 is out of range; must be 0.01 to 1000 in ohms"),
        ("motor.torque_constant_nm_a = 11", "11.0 is out of range; must be 1e-05 to 10"),
        ("chassis.mass_g = 500", "unknown key; use mass_kg, in kilograms"),
        ("battery.voltage_v = '7.2 V'", "expected a number in volts, got a string"),
        (
            "chassis.left_radius_factor = 9.9",
            "9.9 is drawn within +- 1.5 % (wheel_radius_mismatch); what is drawn",
        ),
    ],
)
def test_parameters_of_the_drive_are_checked_like_keys(line, expected):
    place = f"drive.{line.partition(' =')[0]}"
    assert f"{place}: {expected}" in refusal(builtin_text("fig6") + f"[network.robot.drive]\n{line}\n")


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("encoder.lines = 100000", "drive: 7.2 V, 0.00692 Nm/A and 100000 lines make 6.62e+07 counts/s"),
        (
            "motor.rotor_inertia_kg_m2 = 1e-10",
            "drive.motor: 1e-10 kg m2, 2.09 ohm with the battery and 0.00692 Nm/A make a time constant of"
            " 4.36e-06 s; at least 0.0001 s",
        ),
    ],
)
def test_figures_of_a_drive_that_do_not_go_together_are_all_named(line, expected):
    assert expected in refusal(builtin_text("fig6") + f"[network.robot.drive]\n{line}\n")


def test_two_robots_in_one_slot_are_refused():
    twice = SMALL + "[[network.robot]]\nreference.kind = 'arc'\n"
    assert "network[0].robot[1]: slot 0 is taken by robot[0]" in refusal(twice)


def test_a_frame_of_five_robots_leaves_no_time_for_a_long_key_up():
    five = SMALL.replace("[[network]]", "[[network]]\nrobots = 5\nradio.keyup_s = {}")
    assert parse(five.replace("{}", "0.001"), "five").networks[0].robots == 5
    assert "at most 0.001075 s" in refusal(five.replace("{}", "0.0011"))


@pytest.mark.parametrize("text", ["a = " + "[" * 100_000, "a = " + "9" * 10_000, "\0", "a = 1\na = 2"])
def test_text_that_breaks_a_toml_parser_is_refused_in_one_line(text):
    refusal(text)


MANY_NETWORKS = "[[network]]\n[[network.robot]]\nreference.kind = 'line'\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a." * 200_000 + "a = 1", "line 1: a key of more than 16 parts; remove it"),
        ("\n[" + "a." * 200_000 + "a]", "line 2: a key of more than 16 parts; remove it"),
        ("a = {" + '"a" . ' * 1_000 + "a = 1}", "line 1: a key of more than 16 parts; remove it"),
        ("# " + "x" * 600_000, "holds more than 512 KiB; is this the right file?"),
        ("a = {" + "a = {" * 5_000, "nested too deeply; tables have at most 5 levels"),
        (
            "name = 'a'\nduration_s = 1\n" + MANY_NETWORKS * 200,
            "network: 200 networks, each of which takes as much time as a run; at most 32,",
        ),
    ],
)
def test_a_scenario_that_would_take_minutes_is_refused_at_once(text, expected):
    began_s = time.process_time()
    assert f"my.toml: {expected}" in refusal(text)
    assert time.process_time() - began_s < 2.0


def test_a_scenario_may_have_32_networks_and_a_comment_any_dots():
    text = "# ........................\n# www.a.b.c.example.org\nname = 'a'\nduration_s = 1\n"
    text += "camera.kind = 'gaussian'\n"
    assert len(parse(text + MANY_NETWORKS * 32, "many").networks) == 32


def test_a_long_value_is_shown_by_its_ends():
    message = refusal(SMALL.replace("small", "x" * 100_000))
    assert len(message) < 1000
    assert message.endswith("is not a name; use a-z, 0-9, - and _, at most 64 characters")


def test_a_name_that_is_no_scenario_gets_the_list_and_the_nearest_one():
    with pytest.raises(
        ScenarioError, match=r"fig5: no such scenario; did you mean fig\d+\? .*: curve, fig6, fig7,"
    ):
        load("fig5")


@pytest.mark.parametrize("name", ["gone.stream", "gone.mcap", "fig6.tml"])
def test_a_name_with_an_ending_is_a_file_that_is_not_there(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        ScenarioError, match=rf"^{name}: no such file; `mirotwin scenarios` lists the built-in"
    ):
        load(name)
    with pytest.raises(ScenarioError, match="no such file"):
        load(f"{'x' * 300}.{name}")
    Path(name).touch()
    with pytest.raises(
        ScenarioError, match=rf"^{name}: no such scenario; .*; a file needs a path that ends in"
    ):
        load(name)


def test_a_path_is_a_file_and_its_text_is_kept_as_it_stands(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(SMALL + "# ä\n", encoding="utf-8")
    loaded = load(str(path))
    assert loaded.text == SMALL + "# ä\n"
    assert loaded.scenario == parse(SMALL, "small")
    with pytest.raises(ScenarioError, match="no such file"):
        load(str(tmp_path / "absent.toml"))
    with pytest.raises(ScenarioError, match="is a folder; name a file in it"):
        load(f"{tmp_path}/")


def test_a_file_that_is_not_text_is_refused_with_its_line(tmp_path):
    path = tmp_path / "binary.toml"
    path.write_bytes(b"# one\n# \x81\n")
    with pytest.raises(ScenarioError, match=r"line 2: not UTF-8 text"):
        load(str(path))


VALUES = st.one_of(
    st.sampled_from(
        ["nan", "-inf", "0", "-1", "1e308", "9" * 30, "true", '"x"', "[]", "{}", "1979-05-27", "{a=1}"]
    ),
    st.integers().map(str),
    st.floats().map(str),
    st.text(max_size=6),
)
LINES = builtin_text("fig8").splitlines()


@st.composite
def damaged(draw):
    """A built-in scenario with some keys renamed, revalued, dropped, or new lines put in."""
    lines = list(LINES)
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, len(lines) - 1))
        key, _, value = lines[at].partition(" = ")
        kind = draw(st.sampled_from(["value", "key", "drop", "insert"]))
        if kind == "value":
            lines[at] = f"{key} = {draw(VALUES)}"
        elif kind == "key":
            lines[at] = f"{draw(st.text(max_size=12))} = {value}"
        elif kind == "insert":
            lines.insert(at, f'"{draw(st.text(max_size=12))}" = {draw(VALUES)}')
        else:
            del lines[at]
    return "\n".join(lines)


@pytest.mark.slow
@settings(max_examples=300)
@given(st.one_of(damaged(), st.text(), st.text(alphabet='[]{}="\n.a1')))
def test_any_text_is_a_scenario_or_one_line_of_refusal(text):
    outcome: Scenario | ScenarioError
    try:
        outcome = parse(text, "any")
    except ScenarioError as error:
        outcome = error
    if isinstance(outcome, Scenario):
        assert 0.0 < outcome.duration_s < math.inf
    else:
        assert str(outcome).startswith("any: ")
        assert str(outcome).isprintable()


CONTROLLER = "network.robot.controller"
PARAMETERS = [
    (law, field.name)
    for law in LAWS.own
    for field in msgspec.structs.fields(LAWS.find(law))
    if isinstance(field.default, float)
]


def refusal_of(law, **keys):
    table = ", ".join(f"{key} = {value}" for key, value in {"law": f'"{law}"', **keys}.items())
    with pytest.raises(ScenarioError) as caught:
        load("fig6", [f"{CONTROLLER}={{{table}}}"])
    message = str(caught.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize(("law", "key"), PARAMETERS)
@pytest.mark.parametrize("value", ["-0.1", "1e9", "nan", "inf", "'1'", "true"])
def test_a_number_that_no_law_can_use_is_refused_with_its_path(law, key, value):
    message = refusal_of(law, **{key: value})
    assert message.startswith("fig6: ")
    assert f"controller.{key}: " in message


NOT_0 = ("layer_", "max_", "cosine_guard", "turn_guard", "rho_floor", "v_floor", "demand_width")
NOT_0 += ("epsilon", "alpha", "beta", "length")


@pytest.mark.parametrize(("law", "key"), [(law, key) for law, key in PARAMETERS if key.startswith(NOT_0)])
def test_a_limit_a_guard_or_a_width_of_0_is_refused(law, key):
    assert f"controller.{key}: 0 is out of range" in refusal_of(law, **{key: 0})


@pytest.mark.parametrize(("law", "key"), [(law, key) for law, key in PARAMETERS if key.startswith("layer_")])
def test_a_boundary_layer_may_be_thinner_than_a_period_sees(law, key):
    load("fig6", [f'{CONTROLLER}={{law = "{law}", {key} = 1e-6}}'])


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
        ("epsilon_tracking", {"sigma": "'exact'"}, "controller.sigma: 'exact' is not one of the choices"),
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
    assert expected in refusal_of(law, **keys)


def with_chips(options):
    return SMALL.replace("[[network]]", f"[lm629]\n{options}\n[[network]]", 1)


@pytest.mark.parametrize(
    "name", [name for name, choices in CHOICES.items() if not isinstance(choices[0], bool)]
)
def test_every_choice_is_named_to_who_chooses_another(name):
    for wrong in ('"so"', "9", "true"):
        message = refusal(with_chips(f"{name} = {wrong}"))
        named = message.partition("; use ")[2].replace(" or ", ", ").split(", ")
        if "without quotes" not in message:
            assert sorted(named) == sorted(map(str, CHOICES[name]))


def chips_world(options):
    return world_of(with_chips(options), "duration_s=0.1")


def test_both_chips_of_a_robot_follow_the_table():
    board = chips_world('busy_clocks = 240\ninterrupt = "event"').networks[0].robots[0].board
    for chip in (board.left, board.right):
        assert (chip.options.busy_clocks, chip.options.interrupt) == (240, "event")
        assert chip.port.busy_ticks == 960


def test_another_reading_gives_another_run_and_the_default_one_the_same():
    def digest(options):
        return finished(chips_world(options)).digest

    assert digest("") == digest("busy_clocks = 120")
    assert digest("") != digest("busy_clocks = 240")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("busy_clock = 1", "busy_clocks"),
        ("busy_clocks = -1", "busy_clocks must be 0..1048576 clocks, not -1"),
        ('interrupt = "edge"', "lm629.interrupt: 'edge' is not one of the choices; use event or level"),
        ("interrupt = 1", "lm629.interrupt: expected a string, got a whole number (1); use event or level"),
        ('relative_base = "x"', "'x' is not one of the choices; use desired, real or target"),
        ("sign_of_negative = 2", "lm629.sign_of_negative: 2 is not one of the choices; use 0 or 1"),
        ("double_step = 1", "lm629.double_step: 1 is not one of the choices; use -2, 0 or 2"),
        ("pid_saturates = 1", "lm629.pid_saturates: expected true or false, got a whole number (1)"),
    ],
)
def test_what_is_no_reading_is_refused_in_one_line(options, said):
    assert said in refusal(with_chips(options))
