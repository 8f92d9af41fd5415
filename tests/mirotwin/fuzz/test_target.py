"""The MIRO's board as a target: as in a world, on both engines, and judged as the checks judge."""

import re
import sys

import msgspec
import pytest
from hypothesis import given, settings

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_robot import event_log
from miro_robot.firmware import image_path
from miro_robot.harness.fast_oracle import NAMES
from miro_robot.image import load_hex
from miro_sim.world.world import World
from mirotwin.fuzz.hypothesis_inputs import inputs
from mirotwin.fuzz.oracle import expected_of
from mirotwin.fuzz.target import RobotTarget
from mirotwin.runs.spec import silent_scenario
from mirotwin.verify.checks.monitors import Checks
from tests import children
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.verify.checks.rig import needs_sdcc, planted

ALWAYS = ("no_fault", "lm629_protocol", "main_loop_alive", "stack_clear")
JUDGED = [name for name in NAMES if name and name not in ALWAYS]


@pytest.fixture(scope="module")
def shipped():
    return RobotTarget(load_hex(image_path()))


def world_of(target, data, names=()):
    """A world that has heard the same, up to where the target's run ended."""
    end_tick = target.end_tick()
    periods = -(-end_tick // CONTROL_PERIOD_TICKS) + 1
    settings = (
        *(f"network.robots={target.robots}", f"network.robot.slot={target.slot}"),
        *('network.radio.carrier="on"', f"duration_s={seconds(periods * CONTROL_PERIOD_TICKS) + 1.0}"),
    )
    scenario = silent_scenario(settings)
    expect = {key: value for name in names for key, value in expected_of(name).items()}
    scenario = msgspec.structs.replace(scenario, expect=expect)
    world = World(scenario, 0, target.image, target.script(data))
    checks = Checks(world)
    world.run_to(end_tick)
    checks.finish()
    return world, checks


def received(log, since_tick):
    return [
        log.event(serial)
        for serial in range(log.first, log.end)
        if log.event(serial)[1] == event_log.RECEIVED and log.event(serial)[0] >= since_tick
    ]


ENGINES = """
import random
from miro_exact import engine

engine.select({engine!r})
from miro_protocol.miro_wire import Miro
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from mirotwin.fuzz.board_target import BoardTarget
from mirotwin.fuzz.target import RobotTarget
from tests.mirotwin.verify.firmwares import SLEEPS, image

draw = random.Random(3)
for kind in ("bytes", "frames", "session"):
    for target in (RobotTarget(load_hex(image_path()), kind), BoardTarget(image(SLEEPS), kind, Miro())):
        edges = bytearray(target.map_size)
        target.use_map(edges)
        said = (b"", b"ab!", b"a?" if kind == "bytes" else b"b", draw.randbytes(12), draw.randbytes(30))
        for data in said:
            run = target.run(data), target.failure, target.end_tick(), target.describe(data), target.cpu.highest_sp
            ram = bytes(map(target.cpu.peek_iram, range(256))).hex()
            counts = target.cpu.cycles, target.cpu.instructions
            print(kind, *run, *counts, ram, sum(place * count for place, count in enumerate(edges)))
"""


def printed(engine):
    command = [sys.executable, "-c", ENGINES.format(engine=engine)]
    return children.run(command, capture_output=True, text=True, check=True).stdout


def test_both_engines_make_the_same_of_the_same_inputs_on_any_target():
    compiled = printed("compiled")
    assert compiled == printed("python")
    assert {"no_fault", "never_sleeps"} <= set(re.findall(r"check='(\w+)'", compiled))


@settings(max_examples=25, derandomize=True)
@given(inputs("session"))
def test_a_robot_in_a_world_receives_the_same_characters_at_the_same_ticks(shipped, data):
    begun = shipped.board.log.end
    shipped.run(data)
    log = shipped.board.log
    events = map(log.event, range(max(begun, log.first), log.end))
    there = [event for event in events if event[1] == event_log.RECEIVED]
    world, _ = world_of(shipped, data)
    assert received(world.networks[0].robots[0].board.log, shipped.harness.begin_tick)[-len(there) :] == there


@pytest.mark.slow
@settings(max_examples=60, derandomize=True)
@given(inputs("session"))
def test_the_shipped_firmware_passes_the_fast_oracle_and_the_checks(shipped, data):
    assert shipped.run(data) == 0, shipped.failure
    _, checks = world_of(shipped, data, JUDGED)
    assert not checks.failures


PLANTED = {
    "stops 15 ms late": (b"\x00\x10\x00\x10\x00\x0b\x40", "failsafe_stop_ms"),
    "never stops": (b"\x00\x10\x00\x10\x00\x0b\x40", "failsafe_stop_ms"),
    "goes off 100 ms late": (b"\x00\x10\x00\x10\x00\x0b\xc8", "motors_off_ms"),
    "garbage feeds the failsafe": (b"\x00\x10\x00\x10\x00\x0b\x14\x09\x00\x55\x0b\x40", "failsafe_stop_ms"),
}


@needs_sdcc
@pytest.mark.parametrize("name", PLANTED)
def test_the_fast_oracle_finds_what_the_check_of_that_name_finds(name):
    data, check = PLANTED[name]
    target = RobotTarget(planted(name))
    assert target.run(data)
    assert target.failure.check == check
    _, checks = world_of(target, data, JUDGED)
    assert check in {failure.check for failure in checks.failures}


def test_an_input_as_lines_says_what_the_robot_hears(shipped):
    assert shipped.describe(b"\x09\x01\xaa\xbb\x0a\x00\x09\x00\xcc") == ("802008: aa bb\n854408: cc")


def test_an_input_of_another_kind_is_refused():
    with pytest.raises(BadInput, match="use bytes, frames, session"):
        RobotTarget(load_hex(image_path()), "frame")


def test_firmware_that_does_not_listen_is_refused(tmp_path):
    with pytest.raises(BadInput, match="has not turned its serial receiver on"):
        RobotTarget(load_hex(hex_file(tmp_path / "deaf.ihx", b"\x80\xfe")))


ACCELERATION = b"\x05\x00\x02\x10" + bytes(9)
RIGHT = {
    "wheels that stop already need no new order for velocity 0": (
        (ACCELERATION + b"\x00\x00\x00\x00\x04" + ACCELERATION + 2 * bytes(5) + b"\x0a\x80", 3, 0)
    ),
    "a stale frame under test when the stop is due may put it off": (
        (bytes(24) + b"\x2c\x79\x03" + bytes(4) + b"\x1b\x17\x17", 5, 4)
    ),
    "characters behind the tested frame do not end the time that its test has": (
        (bytes.fromhex("0000000088889a8888888800"), 3, 0)
    ),
}
"""Input, robots, slot: what the shipped firmware does right.

The second frame ends 108.4 ms after the last fresh one, and the wheels are told to stop after 110.5 ms. The third is
repeated until its test falls into the end of the 110 ms.
"""


@pytest.mark.parametrize("case", RIGHT)
def test_what_is_right_passes_the_fast_oracle_and_the_checks(case):
    data, robots, slot = RIGHT[case]
    target = RobotTarget(load_hex(image_path()), robots=robots, slot=slot)
    assert target.run(data) == 0, target.failure
    _, checks = world_of(target, data, JUDGED)
    assert not checks.failures


def test_a_frame_right_at_150_ms_is_not_judged():
    target = RobotTarget(load_hex(image_path()), "bytes")
    first = bytes.fromhex("2dd43ccd1cb6eca93208eb56d3157184bc")
    second = bytes.fromhex("2dd4fde6a29d52828c23557d6d3ecf5f53")
    assert [target.run(first + bytes(between) + second) for between in (126, 127, 128)] == [0, 0, 0]


def test_a_reset_in_the_middle_of_a_command_is_not_judged(shipped):
    for waited in range(8):
        data = b"\x00\x10\x00\x10\x00" + bytes([0x0A, waited]) + b"\x09\x00\x55" * waited + b"\x0f"
        assert shipped.run(data) == 0, shipped.failure


def stop_after_ms(target, waited):
    """When the wheels are told to stop, after the end of a fresh frame, while a frame with a bad CRC comes in then."""
    begun = target.board.log.end
    code = target.run(
        b"\x00\x10\x00\x10\x00\x0b\x18" + bytes([0x0A, waited]) + b"\x0c\x1e\x01\x00\x07\x00\x07\x00\x0b\x10"
    )
    assert code == 0, target.failure
    events = [target.board.log.event(serial) for serial in range(begun, target.board.log.end)]
    stop = [tick for tick, kind, told, *_ in events if kind == event_log.COMMAND and told & 0xFF == 1][2]
    frame_end = [tick for tick, kind, *_ in events if kind == event_log.RECEIVED][30]
    return (stop - frame_end) / 24_000


def test_a_robot_that_tests_a_frame_stops_when_the_test_is_over():
    target = RobotTarget(load_hex(image_path()), robots=5)
    after_ms = [stop_after_ms(target, waited) for waited in range(30)]
    assert max(after_ms) < 112.0
    assert [late for late in after_ms if late > 110.6]
    _, checks = world_of(
        target, b"\x00\x10\x00\x10\x00\x0b\x18\x0a\x0e\x0c\x1e\x01\x00\x07\x00\x07\x00\x0b\x10", JUDGED
    )
    assert not checks.failures
