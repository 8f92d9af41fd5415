"""Variants of a scenario: what they change, and which key wins."""

import math

import msgspec
import pytest
from click.testing import CliRunner

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.camera_keys import GaussianCamera, PixelCamera
from miro_sim.scenario.file import ScenarioError, load, parse
from miro_sim.scenario.keys import HostSpec
from miro_sim.world.world import World
from mirotwin.commands import main

SMALL = """
name = "small"
duration_s = 0.5
{}
[[network]]
[network.radio]
{}
[[network.robot]]
reference.kind = "line"
{}
"""
EXACT = GaussianCamera(position_error_cm=0.0, heading_error_deg=0.0, pixel_cm=0.0, delay_frames=0)
DISTURBED = [
    "network.control_noise.v_m_s=0.1",
    "network.radio.lost_frames=0.5",
    "network.radio.profile=fade5",
    "network.robot.drive.tyre.grip=0.2",
    "network.robot.drive.ball.friction=0.2",
    "network.robot.drive.disturbance.force_n=1",
    "network.robot.drive.chassis.left_radius_factor=1.1",
    "network.robot.drive.chassis.stiction_ratio=3",
    "network.robot.drive.chassis.mass_kg=0.6",
    "camera.dropped_frames=0.5",
    "host.word_bits=8",
    "host.integration=adams_bashforth",
]


def refusal(settings, source="fig6"):
    with pytest.raises(ScenarioError) as caught:
        load(source, settings)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("disturbed", [[], DISTURBED])
@pytest.mark.parametrize("name", ["fig6", "fig8"])
def test_ideal_on_the_command_line_wins_over_the_file_and_what_is_set_before_it(name, disturbed):
    scenario = load(name, [*disturbed, "variant=ideal"]).scenario
    network = scenario.networks[0]
    robot = network.robot[0]
    assert scenario.camera == EXACT
    assert scenario.host == HostSpec(compute_s=0.00001)
    assert (network.radio.bit_error_rate, network.radio.eb_n0_db, network.radio.bursts) == (0.0, None, None)
    assert (network.radio.lost_frames, network.radio.squelch) == (0.0, True)
    assert (network.control_noise.v_m_s, robot.wheel_radius_mismatch) == (0.0, 0.0)
    assert not robot.drive.is_rough()
    assert robot.drive.chassis.left_radius_factor == 1.0
    plain = load(name).scenario.networks[0].robot[0]
    assert (robot.reference, robot.controller, robot.start_error_x_cm) == (
        plain.reference,
        plain.controller,
        plain.start_error_x_cm,
    )
    assert robot.drive.chassis.mass_kg == (0.6 if disturbed else 0.5)  # a robot, not a disturbance


@pytest.mark.parametrize("name", ["fig6", "fig8"])
def test_realistic_is_the_defaults_and_so_the_built_in_scenarios(name):
    mass = ["network.robot.drive.chassis.mass_kg=0.6"]
    assert load(name, [*DISTURBED, "variant=realistic"]).scenario == load(name, mass).scenario
    assert load(name, ["variant=ideal", "variant=realistic"]).scenario == load(name).scenario


def test_a_setting_after_the_variant_wins():
    scenario = load("fig6", ["variant=ideal", "camera.delay_frames=2", "network.radio.eb_n0_db=9"]).scenario
    assert scenario.camera == msgspec.structs.replace(EXACT, delay_frames=2)
    radio = scenario.networks[0].radio
    assert (radio.eb_n0_db, radio.bit_error_rate) == (9.0, None)


def test_what_is_no_disturbance_stays():
    kept = ["camera.window_px=40", "network.radio.channel=3", "network.radio.telemetry=false"]
    scenario = load("fig6", [*kept, "camera.calibration=exact", "variant=realistic"]).scenario
    assert scenario.camera == PixelCamera(window_px=40)
    assert (scenario.networks[0].radio.channel, scenario.networks[0].radio.telemetry) == (3, False)


def test_in_a_file_the_variant_fills_in_what_the_file_does_not_say():
    plain = parse(SMALL.format('variant = "ideal"', "", ""), "small")
    assert plain == parse(SMALL.format("", "", ""), "small", ["variant=ideal"])
    given = parse(
        SMALL.format(
            'variant = "ideal"\ncamera = { kind = "gaussian", delay_frames = 1 }\nhost.compute_s = 0.002',
            "eb_n0_db = 9.0",
            "wheel_radius_mismatch = 0.02",
        ),
        "small",
    )
    assert given.camera == msgspec.structs.replace(EXACT, delay_frames=1)
    assert given.host.compute_s == 0.002
    radio = given.networks[0].radio
    assert (radio.eb_n0_db, radio.bit_error_rate, radio.squelch) == (9.0, None, True)
    assert given.networks[0].robot[0].wheel_radius_mismatch == 0.02


def test_a_camera_of_another_kind_and_a_profile_in_a_file_are_what_the_file_says():
    found = parse(
        SMALL.format(
            'variant = "ideal"\ncamera = { kind = "pixels", window_px = 40 }', 'profile = "fade15"', ""
        ),
        "small",
    )
    assert found.camera == PixelCamera(window_px=40)
    assert found.networks[0].radio.bit_error_rate == 1e-5


def test_on_the_command_line_a_variant_replaces_that_of_the_file():
    text = SMALL.format('variant = "ideal"', "", "")
    assert parse(text, "small", ["variant=realistic"]) == parse(SMALL.format("", "", ""), "small")


def test_the_text_that_a_recording_keeps_says_the_same():
    for settings in (
        ["variant=ideal"],
        ["variant=ideal", "camera.delay_frames=1"],
        [*DISTURBED, "variant=ideal"],
    ):
        loaded = load("fig8", settings)
        assert parse(loaded.text, "kept") == loaded.scenario


def test_another_name_is_refused_in_one_line():
    assert refusal(["variant=idael"]) == (
        "fig6: --set variant=idael: 'idael' is no variant; did you mean ideal? variants: ideal, realistic"
    )
    assert "--set variant=3: 3 is no variant; variants: ideal, realistic" in refusal(["variant=3"])
    with pytest.raises(ScenarioError, match=r"small: variant: 'x' is no variant"):
        parse(SMALL.format('variant = "x"', "", ""), "small")
    with pytest.raises(ScenarioError, match=r"network"):
        parse('name = "a"\nduration_s = 1.0\nnetwork = 3', "odd", ["variant=ideal"])


def test_the_command_line_lists_them():
    done = CliRunner().invoke(main, ["scenarios", "variants"], env={"COLUMNS": "300"})
    assert done.exit_code == 0
    assert "ideal" in done.output
    assert "realistic" in done.output
    assert "wheel_radius_mismatch = 0.0" in done.output


def test_in_the_ideal_loop_body_frame_follows_the_line_within_a_millimetre():
    settings = ["variant=ideal", 'network.robot.controller={law="body_frame"}']
    one, squares = World(load("fig6", settings).scenario, 0, load_hex(image_path())), []
    while not one.finished:
        robot = one.step().robots[0]
        dx, dy = robot.truth.x_m - robot.reference.x_m, robot.truth.y_m - robot.reference.y_m
        squares.append(dx * dx + dy * dy)
    assert math.sqrt(math.fsum(squares[-30:]) / 30) < 0.001
