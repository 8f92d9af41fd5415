"""Laws in a world: what they hear, what they remember over a save, and what is said when one fails."""

import math
import struct

import msgspec
import pytest

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.plugins import PluginError
from miro_host.estimators.ekf_telemetry import EkfTelemetryParameters
from miro_host.estimators.predict import PredictParameters
from miro_host.laws.interface import Law, LawParameters, Velocities
from miro_host.laws.yang_kim import Gains
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from tests.host.own_laws import LeakyParameters, WrongParameters
from tests.sim.mutated_worlds import with_field
from tests.sim.world.rig import finished, image, world_of
from tests.states import snapshot

PERIODS = 24
NOTHING_HEARD = struct.pack("<q4B2q2B", -1, 0, 0, 0, 0, 0, 0, 0, 0)


class ByEar(LawParameters, frozen=True, tag="by_ear"):
    def law(self):
        return Listener(self)


class Listener(Law[LawParameters]):
    """As fast as a wheel count that came by radio says: what was heard is the only memory."""

    INNER = ("position_left",)

    def step(self, given):
        count = 0.0 if given.telemetry is None else float(given.telemetry.position_left)
        return Velocities(0.1 + count * 1e-5, 0.0, {"position_left": count})


def world(parameters, estimator=None):
    scenario = load("fig6").scenario
    network = scenario.networks[0]
    chosen = {} if estimator is None else {"estimator": estimator}
    robot = msgspec.structs.replace(network.robot[0], controller=parameters, **chosen)
    network = msgspec.structs.replace(network, robot=(robot,))
    return World(msgspec.structs.replace(scenario, networks=(network,)), 7, image())


def finish(one):
    one.run_to(PERIODS * CONTROL_PERIOD_TICKS)
    return one.digest


@pytest.mark.parametrize(
    ("parameters", "estimator"),
    [
        (LeakyParameters(), None),
        (ByEar(), None),
        (Gains(), PredictParameters()),
        (Gains(), EkfTelemetryParameters()),
    ],
)
@pytest.mark.parametrize("at_tick", [5_000, 1_000_003, 9_999_999, 10 * CONTROL_PERIOD_TICKS])
def test_a_world_saved_anywhere_goes_on_with_the_memory_of_its_parts(parameters, estimator, at_tick):
    whole, first, second = (world(parameters, estimator=estimator) for _ in range(3))
    first.run_to(at_tick)
    second.load(first.save())
    assert finish(second) == finish(first) == finish(whole)
    assert snapshot(second) == snapshot(whole)


def test_an_observer_that_changes_what_it_is_given_changes_no_bit():
    def spoil(period):
        for robot in period.robots:
            if robot.control is not None:
                robot.control.inner.clear()
                robot.control.estimate.clear()

    quiet, spoilt = world(Gains()), world(Gains())
    spoilt.observers.append(spoil)
    assert finish(spoilt) == finish(quiet)
    assert spoilt.save() == quiet.save()


def test_what_was_heard_is_saved_and_hashed():
    first, second = world(ByEar()), world(ByEar())
    first.run_to(10 * CONTROL_PERIOD_TICKS)
    second.load(first.save())
    assert second.networks[0].telemetry.last == first.networks[0].telemetry.last != [None, None, None]
    assert second.state.hashed() == first.state.hashed()
    second.networks[0].telemetry.last[0] = None
    assert second.state.hashed() != first.state.hashed()


def test_the_memory_of_a_law_is_part_of_the_digest():
    one, other = world(LeakyParameters()), world(LeakyParameters())
    for each in (one, other):
        each.run_to(10 * CONTROL_PERIOD_TICKS)
    other.lines[0].devices[0].pilot.law.periods += 1
    assert finish(one) != finish(other)


def test_the_ear_follows_the_wheel_counts_beyond_sixteen_bits():
    one = world(Gains())
    counts = []
    while one.index < 120:
        counts.append(one.step().robots[0].left.real_position)
    heard = one.networks[0].telemetry.last[0]
    assert heard.position_left > 1 << 16
    period = heard.tick // CONTROL_PERIOD_TICKS
    assert counts[period - 1] <= heard.position_left <= counts[period] + 2000
    assert one.tick - heard.tick < 5 * CONTROL_PERIOD_TICKS


QUIET = """
name = "quiet"
duration_s = 5

[camera]
kind = "gaussian"
position_error_cm = 0
heading_error_deg = 0
pixel_cm = 0

[[network]]
radio = { bit_error_rate = 0, squelch = true }

[[network.robot]]
wheel_radius_mismatch = 0
reference.kind = "line"
start_error_x_cm = 2
controller = { gamma2_per_s = 9, p2_rad_s2 = 5.2, layer_s2_rad_s = 0.35 }
estimator.kind = "KIND"
"""


def behind_m(kind):
    """How far the robot runs from the reference in the end, along the line."""
    last = finished(world_of(QUIET.replace("KIND", kind))).last.robots[0]
    return abs(last.truth.x_m - last.reference.x_m)


def test_prediction_takes_the_dead_time_out_of_the_loop():
    assert behind_m("none") == pytest.approx(0.2 * 1001 / 30000, abs=3e-4)  # a frame ahead at 0.2 m/s
    assert behind_m("predict") < 5e-4


def test_a_saved_world_of_another_law_is_refused():
    with pytest.raises(ValueError, match="saved world has scenario"):
        world(LeakyParameters()).load(world(LeakyParameters(gain_per_s=2.5)).save())


def test_a_law_that_fails_names_robot_and_tick_and_leaves_no_nan_in_the_state():
    one = world(WrongParameters(how="nan"))
    with pytest.raises(
        PluginError, match=r"net0/robot0: tick 1601600 \(0.066733 s\): law .wrong. failed: .* = nan"
    ):
        finish(one)
    assert snapshot(one)


ROBOT = "lines[0].devices[0]"


@pytest.mark.parametrize(
    ("path", "data", "reason"),
    [
        (f"{ROBOT}.pilot.law.error_m", struct.pack("<d", math.nan), "error_m is NaN"),
        (f"{ROBOT}.pilot.law.error_m", struct.pack("<d", math.inf), "'error_m' is inf"),
        (
            "lines[0].telemetry.last",
            struct.pack("<I", 2) + 2 * NOTHING_HEARD,
            "of 2 robots where 3 belong",
        ),
        (
            "lines[0].telemetry.last",
            struct.pack("<I", 3) + struct.pack("<q", 1 << 40) + NOTHING_HEARD[8:] + 2 * NOTHING_HEARD,
            "last answer came after tick 4000000",
        ),
    ],
)
def test_a_saved_world_with_a_memory_that_cannot_be_is_refused(path, data, reason):
    one = world(LeakyParameters())
    one.run_to(4_000_000)
    before = one.state.save()
    with pytest.raises(ValueError, match=reason):
        one.load(with_field(one, one.save(), path, data))
    assert one.state.save() == before
