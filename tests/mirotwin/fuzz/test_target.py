"""The MIRO's board as a target: as in a world, on both engines, and judged as the checks judge."""

import sys

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_robot import event_log
from miro_robot.firmware import image_path
from miro_robot.harness.fast_oracle import NAMES
from miro_robot.image import load_hex
from miro_sim.world.world import World
from mirotwin.fuzz.oracle import expected_of
from mirotwin.fuzz.target import target_for
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.rig_options import silent_scenario
from tests import children
from tests.mirotwin.fuzz import target_digest
from tests.mutants import planted
from tests.mutants.build import build
from tests.mutants.draw import source_files
from tests.mutants.sdcc import needs_sdcc

JUDGED = [
    name
    for name in NAMES
    if name and name not in ("no_fault", "lm629_protocol", "main_loop_alive", "stack_clear")
]
SESSIONS = st.lists(
    st.one_of(
        st.binary(min_size=4, max_size=4).map(lambda own: b"\x00" + own),
        st.binary(min_size=4, max_size=4).map(lambda own: b"\x03" + own),
        st.binary(min_size=12, max_size=12).map(lambda payload: b"\x05" + payload),
        st.binary(min_size=13, max_size=13).map(lambda body: b"\x07" + body),
        st.just(b"\x08"),
        st.binary(min_size=1, max_size=8).map(lambda raw: bytes([9, len(raw) - 1]) + raw),
        st.integers(0, 255).map(lambda wait: bytes([0x0A, wait])),
        st.integers(0, 60).map(lambda wait: bytes([0x0B, wait])),
        st.binary(min_size=2, max_size=2).map(lambda damage: b"\x0c" + damage),
        st.integers(0, 30).map(lambda cut: bytes([0x0D, cut])),
        st.integers(0, 30).map(lambda place: bytes([0x0E, place])),
        st.just(b"\x0f"),
    ),
    max_size=8,
).map(b"".join)


@pytest.fixture(scope="module")
def shipped():
    return target_for(load_hex(image_path()))


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


def test_both_engines_make_the_same_of_the_same_inputs():
    module = "tests.mirotwin.fuzz.target_digest"
    python = children.run(
        [sys.executable, "-m", module, "--engine", "python"], capture_output=True, text=True, check=True
    )
    assert python.stdout.splitlines() == target_digest.lines()


@settings(max_examples=25, derandomize=True)
@given(SESSIONS)
def test_a_robot_in_a_world_receives_the_same_characters_at_the_same_ticks(shipped, data):
    begun = shipped.board.log.end
    shipped.run(data)
    there = [
        event
        for event in map(
            shipped.board.log.event, range(max(begun, shipped.board.log.first), shipped.board.log.end)
        )
        if event[1] == event_log.RECEIVED
    ]
    world, _ = world_of(shipped, data)
    assert received(world.networks[0].robots[0].board.log, shipped.harness.begin_tick)[-len(there) :] == there


@pytest.mark.slow
@settings(max_examples=60, derandomize=True)
@given(SESSIONS)
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
    mistake = planted.PLANTED[name]
    data, check = PLANTED[name]
    firmware = build({mistake.file: mistake.applied(source_files()[mistake.file])})
    target = target_for(load_hex(firmware.image))
    assert target.run(data)
    assert target.failure.check == check
    _, checks = world_of(target, data, JUDGED)
    assert check in {failure.check for failure in checks.failures}


def test_an_input_as_lines_says_what_the_robot_hears(shipped):
    assert shipped.describe(b"\x09\x01\xaa\xbb\x0a\x00\x09\x00\xcc") == ("802008: aa bb\n854408: cc")


def test_an_input_of_another_kind_is_refused():
    with pytest.raises(BadInput, match="use bytes, frames, session"):
        target_for(load_hex(image_path()), "frame")


def test_firmware_that_does_not_listen_is_refused(tmp_path):
    file = tmp_path / "deaf.ihx"
    file.write_text(":0200000080FE80\n:00000001FF\n")
    with pytest.raises(BadInput, match="has not turned its serial receiver on"):
        target_for(load_hex(file))


def test_wheels_that_stop_already_need_no_new_order_for_velocity_0(shipped):
    acceleration = b"\x05\x00\x02\x10" + bytes(9)
    stopped = b"\x00" + bytes(4)
    data = acceleration + b"\x00\x00\x00\x00\x04" + acceleration + stopped + stopped + b"\x0a\x80"
    assert shipped.run(data) == 0, shipped.failure
    _, checks = world_of(shipped, data, JUDGED)
    assert not checks.failures


def test_a_frame_right_at_150_ms_is_not_judged():
    target = target_for(load_hex(image_path()), "bytes")
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


def test_a_stale_frame_under_test_when_the_stop_is_due_may_put_it_off():
    """It ends 108.4 ms after the last fresh one, and the wheels are told to stop after 110.5 ms."""
    target = target_for(load_hex(image_path()), robots=5, slot=4)
    program = bytes(24) + b"\x2c\x79\x03" + bytes(4) + b"\x1b\x17\x17"
    assert not target.run(program)
    _, checks = world_of(target, program, JUDGED)
    assert not checks.failures


def test_a_robot_that_tests_a_frame_stops_when_the_test_is_over():
    target = target_for(load_hex(image_path()), robots=5)
    after_ms = [stop_after_ms(target, waited) for waited in range(30)]
    assert max(after_ms) < 112.0
    assert [late for late in after_ms if late > 110.6]
    _, checks = world_of(
        target, b"\x00\x10\x00\x10\x00\x0b\x18\x0a\x0e\x0c\x1e\x01\x00\x07\x00\x07\x00\x0b\x10", JUDGED
    )
    assert not checks.failures
