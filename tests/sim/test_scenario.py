"""Scenario files: what is accepted, and the one line that says what is wrong."""

import math
import time
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_host.estimators.predict import NoEstimator, PredictParameters
from miro_sim.scenario.camera_keys import PixelCamera
from miro_sim.scenario.file import ScenarioError, builtin_text, load, parse
from miro_sim.scenario.keys import Scenario

SMALL = """
name = "small"
duration_s = 1
[[network]]
[[network.robot]]
reference.kind = "line"
"""


def refusal(text):
    with pytest.raises(ScenarioError) as caught:
        parse(text, "my.toml")
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("my.toml: ")
    return message


def edited(old, new):
    text = builtin_text("fig6")
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


def test_a_whole_number_is_a_number():
    assert parse(SMALL, "small").duration_s == 1.0


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("duration_s = 6.0", "duration_ms = 6000", "duration_ms: unknown key; use duration_s, in seconds"),
        (
            "heading_deg = 0.0",
            "heading_rad = 0.0",
            "reference.heading_rad: unknown key; use heading_deg, in degrees",
        ),
        ("window_px", "windows_px", "camera.windows_px: unknown key; did you mean window_px?"),
        ("[camera]", "[cammera]", "cammera: unknown key; did you mean camera?"),
        ("duration_s = 6.0", "", "duration_s: this key is missing; add it"),
        (
            "duration_s = 6.0",
            "duration_s = '6 s'",
            "duration_s: expected a number in seconds, got a string ('6 s')",
        ),
        (
            "duration_s = 6.0",
            "duration_s = -6.0",
            "duration_s: -6.0 is out of range; must be > 0.0 in seconds",
        ),
        ("duration_s = 6.0", "duration_s = nan", "duration_s: nan is not a number"),
        ("duration_s = 6.0", "duration_s = inf", "duration_s: inf is not a number"),
        (
            "robots = 3",
            "robots = 4",
            "network[0].robots: 4 is not one of the choices; use 3 or 5: slots of a",
        ),
        (
            "slot = 0",
            "slot = 3",
            "network[0].robot[0]: slot 3 does not exist on a network of 3 robots; use 0 to 2",
        ),
        ("slot = 0", "slot = 5", "network[0].robot[0].slot: 5 is out of range; must be <= 4"),
        (
            'kind = "line"',
            'kid = "line"',
            "reference.kind: this key is missing; use line, arc, sine or waypoints",
        ),
        (
            '"line"',
            '"spiral"',
            "reference.kind: 'spiral' is not one of the choices; use line, arc, sine or waypoints",
        ),
        (
            'switching = "saturation"',
            'switching = "sing"',
            "switching: 'sing' is not one of the choices; use saturation or sign",
        ),
        (
            'law = "yang_kim"',
            'law = "pid"',
            "controller.law: 'pid' is not one of the choices; use yang_kim, body_frame, kanayama, dynamic_feedback or"
            " epsilon_tracking",
        ),
        (
            'kind = "pixels"',
            "kind = true",
            "camera.kind: expected a string, got true or false (True); use pixels, geometric or gaussian",
        ),
        (
            'kind = "pixels"',
            'kind = "pixel"',
            "camera.kind: 'pixel' is not one of the choices; use pixels, geometric or gaussian",
        ),
        (
            'kind = "pixels"',
            'noise = "none"',
            "camera.kind: this key is missing; use pixels, geometric or gaussian",
        ),
        (
            'calibration = "1997"',
            "noise = 1",
            "camera.noise: unknown key; keys here: kind, centroid, window_px",
        ),
        ("squelch = false", "squelch = 0", "radio.squelch: expected true or false, got a whole number (0)"),
        (
            "keyup_s = 0.001",
            "keyup_s = 0.03",
            "radio.keyup_s: 0.03 s and a frame of 23 characters do not fit",
        ),
        (
            "[[network]]",
            "[network]",
            "network: expected an array of tables, got a table; write its header in double",
        ),
        ('name = "fig6"', 'name = "a/b"', "name: 'a/b' is not a name"),
        ("stop_on_fault = true", "stop_on_fault = yes", "line 9, column 17: not TOML: Invalid value"),
    ],
)
def test_a_bad_key_is_named_with_its_place_and_its_remedy(old, new, expected):
    assert expected in refusal(edited(old, new))


def test_an_estimator_is_chosen_and_checked_like_a_law():
    table = "[network.robot.estimator]\n"
    chosen = (
        parse(SMALL + table + 'kind = "predict"\nahead_s = 0.02\n', "small").networks[0].robot[0].estimator
    )
    assert chosen == PredictParameters(ahead_s=0.02)
    assert parse(SMALL, "small").networks[0].robot[0].estimator == NoEstimator()
    assert (
        "estimator.kind: 'kalman' is not one of the choices; use none, ekf, ekf+telemetry or predict"
        in refusal(SMALL + table + 'kind = "kalman"\n')
    )
    assert "estimator.ahead: unknown key; use ahead_s, in seconds" in refusal(
        SMALL + table + 'kind = "predict"\nahead = 1\n'
    )
    assert "estimator.ahead_s: 1 is out of range; must be <= 0.25 in seconds" in refusal(
        SMALL + table + 'kind = "predict"\nahead_s = 1\n'
    )


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (
            "motor.resistance_ohm = -2.0",
            "drive.motor.resistance_ohm: -2.0 is out of range; must be 0.01 to 1000 in ohms",
        ),
        ("chassis.mass_g = 500", "drive.chassis.mass_g: unknown key; use mass_kg, in kilograms"),
        ("encoder.lines = 100000", "drive: 7.2 V, 0.00692 Nm/A and 100000 lines make 6.62e+07 counts/s"),
        (
            "motor.torque_constant_nm_a = 11",
            "torque_constant_nm_a: 11.0 is out of range; must be 1e-05 to 10",
        ),
        (
            "motor.rotor_inertia_kg_m2 = 1e-10",
            "drive.motor: 1e-10 kg m2, 2.09 ohm with the battery and 0.00692 Nm/A make a time constant of"
            " 4.36e-06 s; at least 0.0001 s",
        ),
        (
            "chassis.left_radius_factor = 9.9",
            "drive.chassis.left_radius_factor: 9.9 is drawn within +- 1.5 % (wheel_radius_mismatch); what is drawn"
            " must stay within 0.1 to 10",
        ),
        ("battery.voltage_v = '7.2 V'", "drive.battery.voltage_v: expected a number in volts, got a string"),
    ],
)
def test_parameters_of_the_drive_are_checked_like_keys(lines, expected):
    assert expected in refusal(builtin_text("fig6") + f"[network.robot.drive]\n{lines}\n")


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
    path.write_bytes(b"# one\n# \xff\n")
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
