"""Laws in a world: what they hear, what they remember over a save, and what is said when one fails."""

import msgspec
import pytest
from tests.host.own_laws import LeakyParameters, WrongParameters

from miro_exact.canonical import encode
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_host.estimators.predict import PredictParameters
from miro_host.laws.interface import Law, LawInput, LawParameters, Velocities
from miro_host.laws.yang_kim import Gains
from miro_host.parts import PartError
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load, parse
from miro_sim.world.world import SAVE_BEGIN, World, sealed

PERIODS = 24


class ByEar(LawParameters, frozen=True, tag="by_ear"):
    def law(self):
        return Listener(self)


class Listener(Law[LawParameters]):
    """As fast as a wheel count that came by radio says: what was heard is the only memory."""

    INNER = ("position_left",)

    def step(self, given: LawInput) -> Velocities:
        count = 0.0 if given.heard is None else float(given.heard.position_left)
        return Velocities(0.1 + count * 1e-5, 0.0, {"position_left": count})


def world(parameters, seed=7, estimator=None):
    scenario = load("fig6").scenario
    network = scenario.networks[0]
    chosen = {} if estimator is None else {"estimator": estimator}
    robot = msgspec.structs.replace(network.robot[0], controller=parameters, **chosen)
    network = msgspec.structs.replace(network, robot=(robot,))
    return World(msgspec.structs.replace(scenario, networks=(network,)), seed, load_hex(image_path()))


def finish(one):
    one.run_to(PERIODS * CONTROL_PERIOD_TICKS)
    return one.digest


@pytest.mark.parametrize(
    ("parameters", "estimator"),
    [(LeakyParameters(), None), (ByEar(), None), (Gains(), PredictParameters())],
)
@pytest.mark.parametrize("at_tick", [5_000, 1_000_003, 9_999_999, 10 * CONTROL_PERIOD_TICKS])
def test_a_world_saved_anywhere_goes_on_with_the_memory_of_its_parts(parameters, estimator, at_tick):
    whole, first, second = (world(parameters, estimator=estimator) for _ in range(3))
    first.run_to(at_tick)
    second.load(first.save())
    assert finish(second) == finish(first) == finish(whole)
    assert encode(second.snapshot()) == encode(whole.snapshot())


def test_what_was_heard_is_saved_though_it_is_not_hashed():
    first, second = world(ByEar()), world(ByEar())
    first.run_to(10 * CONTROL_PERIOD_TICKS)
    second.load(first.save())
    assert second.networks[0].ear.heard == first.networks[0].ear.heard != [None, None, None]
    second.networks[0].ear.heard = [None, None, None]
    assert encode(second.hashed()) == encode(first.hashed())
    assert finish(second) != finish(first)  # a law that listens shows it


def test_the_memory_of_a_law_is_part_of_the_digest():
    one, other = world(LeakyParameters()), world(LeakyParameters())
    for each in (one, other):
        each.run_to(10 * CONTROL_PERIOD_TICKS)
    other.networks[0].robots[0].pilot.law.periods += 1
    assert finish(one) != finish(other)


def test_the_ear_follows_the_wheel_counts_beyond_sixteen_bits():
    one = world(Gains())
    counts = []
    while one.index < 120:
        counts.append(one.step().robots[0].left.real_position)
    heard = one.networks[0].ear.heard[0]
    assert heard.position_left > 1 << 16
    period = heard.tick // CONTROL_PERIOD_TICKS
    assert counts[period - 1] <= heard.position_left <= counts[period] + 2000
    assert one.tick - heard.tick < 5 * CONTROL_PERIOD_TICKS


QUIET = """
name = "quiet"
duration_s = 5

[camera]
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
    one = World(parse(QUIET.replace("KIND", kind), "quiet"), 0, load_hex(image_path()))
    while not one.finished:
        last = one.step().robots[0]
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
        PartError, match=r"net0/robot0: tick 1601600 \(0.066733 s\): law .wrong. failed: .* = nan"
    ):
        finish(one)
    assert encode(one.snapshot())


def changed(saved, change):
    """A saved world with something in its first network changed, sealed again."""
    content = msgspec.msgpack.decode(saved[len(SAVE_BEGIN) + 32 :])
    change(content["state"]["networks"][0])
    return sealed(msgspec.msgpack.encode(content))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (
            lambda network: network["robots"][0]["pilot"]["law"].update(periods="1"),
            "law 'leaky' takes back no such memory: ValueError: attribute 'periods' is 1, not an int",
        ),
        (
            lambda network: network["robots"][0]["pilot"].update(law=None),
            "law 'leaky' takes back no such memory: ValidationError: Expected `object`, got `null`",
        ),
        (lambda network: network["answers"].pop(), "answers of 2 robots where 3 belong"),
        (lambda network: network["answers"][0].update(tick=1 << 40), "last answer came after tick 4000000"),
        (lambda network: network.pop("answers"), "KeyError.*answers"),
    ],
)
def test_a_saved_world_with_another_memory_is_refused(change, reason):
    one = world(LeakyParameters())
    one.run_to(4_000_000)
    with pytest.raises(ValueError, match=f"not a saved world: .*{reason}"):
        one.load(changed(one.save(), change))
