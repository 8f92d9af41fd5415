"""Laws, paths and the theory in the whole loop: firmware, radio, motors, camera, wheels that do not match."""

import math
import statistics

import pytest

from miro_protocol.decoder import Decoder, Received
from mirotwin.recording.track import Tracks
from mirotwin.runs.summary import tracking_of
from tests.sim.theory_in_the_loop import run
from tests.sim.world.rig import world_of

LAWS = ["body_frame", "kanayama", "dynamic_feedback"]
GAUSSIAN = 'camera={kind="gaussian"}'


def errors_cm(name, seed, *settings):
    """Distances of the robot from its reference, at each camera frame."""
    world, errors = world_of(name, *settings, seed=seed), []
    while not world.finished:
        robot = world.step().robots[0]
        truth, reference = robot.truth, robot.reference
        errors.append(100.0 * math.hypot(truth.x_m - reference.x_m, truth.y_m - reference.y_m))
    return errors


def rms_at_the_end_cm(*arguments):
    errors = errors_cm(*arguments)[-30:]
    return math.sqrt(math.fsum(error * error for error in errors) / len(errors))


@pytest.mark.parametrize("name", ["line", "curve", "sine"])
def test_the_robot_stays_within_half_a_centimetre_of_the_path_where_the_camera_is_right(name):
    """Measured over seeds 0 to 9, in the last two thirds of the run: 0.37 cm at worst."""
    errors = errors_cm(name, 4, 'camera={kind="pixels", calibration="exact"}')
    assert max(errors[len(errors) // 3 :]) < 0.5


@pytest.mark.parametrize("name", ["line", "curve", "sine"])
def test_a_wrong_calibration_is_what_is_left(name):
    """2.40 cm is what the calibration is wrong by at worst; measured over seeds 0 to 9: 2.11 cm."""
    assert max(errors_cm(name, 4)[60:]) < 2.4


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_papers_law_drives_a_path_that_has_no_closed_form(seed):
    """Measured over seeds 0 to 9, in the last two thirds: 2.9 cm at worst, for a start 7.3 cm beside the path."""
    errors = errors_cm("waypoints", seed)
    assert errors[0] > 7.0
    assert max(errors[len(errors) // 3 :]) < 3.5


def test_a_closed_path_is_driven_lap_after_lap():
    errors = errors_cm(
        "sine",
        2,
        "duration_s=14",
        GAUSSIAN,
        'network.robot.reference={kind="waypoints", closed=true,'
        " points=[{x_cm=30, y_cm=20}, {x_cm=70, y_cm=25}, {x_cm=50, y_cm=50}]}",
    )
    assert max(errors[100:]) < 1.2


@pytest.mark.parametrize("figure", ["fig6", "fig8"])
@pytest.mark.parametrize("law", LAWS)
def test_with_prediction_the_robot_ends_within_1_cm_of_the_reference(figure, law):
    """Half of the paper's measurement error of 2.40 cm and less; measured: 0.2 to 0.8 cm over ten seeds."""
    settings = f'network.robot.controller={{law="{law}"}}', 'network.robot.estimator={kind="predict"}'
    assert rms_at_the_end_cm(figure, 3, GAUSSIAN, *settings) < 1.0


def test_in_the_ideal_loop_body_frame_follows_the_line_within_a_millimetre():
    settings = "variant=ideal", 'network.robot.controller={law="body_frame"}'
    assert rms_at_the_end_cm("fig6", 0, *settings) < 0.1


def peek16(cpu, address, signed=False):
    return int.from_bytes([cpu.peek_iram(address), cpu.peek_iram(address + 1)], "little", signed=signed)


class Observer:
    """Compares what the firmware acted on, read from its RAM, with what the station sent."""

    def __init__(self, world):
        self.robot = world.networks[0].robots[0]
        self.robots = world.networks[0].spec.robots
        symbols = world.image.symbols
        self.address = {
            name: symbols.find(name).address
            for name in ("frames_accepted", "last_hdr", "last_left", "last_right")
        }
        self.accepted = 0
        self.sent = {}

    def look(self, period):
        for sent in period.wire:
            if sent.direction == ">":
                [frame] = [
                    event for event in Decoder(self.robots).feed(sent.data) if isinstance(event, Received)
                ]
                self.sent[frame.seq] = frame.message(self.robots)
        cpu = self.robot.board.cpu
        accepted = peek16(cpu, self.address["frames_accepted"])
        assert accepted - self.accepted in (0, 1)
        if accepted != self.accepted:
            sent = self.sent[cpu.peek_iram(self.address["last_hdr"]) & 0x3F]
            wheels = tuple(peek16(cpu, self.address[side], True) for side in ("last_left", "last_right"))
            assert wheels == sent.velocities[self.robot.spec.slot]
        self.accepted = accepted


@pytest.mark.parametrize("name", ["fig6", "fig8"])
def test_the_figure_is_tracked_within_the_papers_measurement_error(name):
    errors = []
    for seed in range(10):
        world = world_of(name, seed=seed)
        observer = Observer(world)
        periods = []
        while not world.finished:
            period = world.step()
            observer.look(period)
            periods.append(period)
        assert world.faults == []
        assert observer.accepted > 150
        errors.append(tracking_of(Tracks(periods).robots[0, 0].errors).rms_position_cm)
    assert statistics.median(errors) <= 2.5, errors


def test_most_of_f1_is_the_dead_time_of_about_one_period():
    """Compared with the motion one period later, f1 is less than half."""
    theory, late = run("fig8", 3)
    assert late[0] < 0.5 * theory.disturbance.f1_rms_m_s2


def test_condition_17_is_broken_in_many_frames_of_fig_8_and_the_robot_gets_there_all_the_same():
    theory, _ = run("fig8", 3)
    assert 0.1 < theory.disturbance.f1_above_p1 < 0.9
    assert theory.disturbance.f1_largest_m_s2 > 2.0 * theory.disturbance.p1_m_s2


def test_on_the_line_of_fig_6_f1_is_below_p1_but_above_what_the_layer_leaves_of_it_in_most_frames():
    """The robot never leaves the layer of s1, which is 0.4 m/s wide."""
    f, _ = run("fig6", 3)
    assert f.disturbance.f1_above_p1 < 0.1
    assert f.disturbance.f1_above_authority > 0.5


def test_sign_functions_chatter_more_than_the_boundary_layers_of_remark_2():
    signs, layers = (run(name, 3)[0] for name in ("fig6, sign functions", "fig6"))
    assert signs.chattering_m_s2 > 2.5 * layers.chattering_m_s2


def test_from_the_start_of_fig_7_the_robot_passes_the_heading_that_assumption_3_forbids_and_drives_backward():
    """The paper's robot went forward and backward there too."""
    theory, _ = run("fig7", 3)
    assert theory.assumption_3.crossings % 2 == 1
    assert theory.reversals >= 1
    assert 0.1 < theory.backward_s < 2.0


def test_the_line_of_fig_6_keeps_all_three_assumptions():
    theory, _ = run("fig6", 3)
    for assumption in (theory.assumption_1, theory.assumption_2, theory.assumption_3):
        assert assumption.broken_s == 0.0
