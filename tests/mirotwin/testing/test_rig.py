"""The world of a test: when it begins, and how the checks judge it."""

import pytest

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, ms
from miro_protocol.frames import ServiceFrame, TelemetryFrame, encode
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.faults import FaultKind
from miro_sim.world.world import World
from mirotwin.verify.checks.monitors import Checks
from tests.mirotwin.testing.rigs import HERE, rig


def test_a_robot_is_up_and_stands_when_its_test_begins():
    one = rig()
    assert one.world.tick == CONTROL_PERIOD_TICKS
    assert one.robots[0].wheels.mode == ("off", "off")
    assert one.links[0].answers == []
    one.links[0].poll(0)
    assert one.links[0].expect(TelemetryFrame, within=ms(40)).accepted == 1


def test_the_second_world_is_loaded_and_goes_on_as_the_first_that_booted_itself():
    digests = []
    for one in (rig(5), rig(5)):
        one.links[0].drive({0: (400, 300)}, ms(200))
        one.judge()
        digests.append(one.world.digest)
    assert digests[0] == digests[1]
    log = one.world.networks[0].log
    script = [Transmission(event.tick, DOWN, event.data) for _, event in log.since(0) if event.what == "sent"]
    world = World(one.world.scenario, 5, one.world.image, script)
    world.run_to(one.world.tick)
    assert world.digest == digests[0]


def test_a_world_without_boot_stands_at_power_on():
    one = rig(boot=False)
    assert one.world.tick == 0
    one.robots[0].break_at("main", ms(1))
    assert 0 < one.world.tick < ms(1)


def test_a_scenario_with_a_controller_begins_at_power_on_and_drives_by_itself():
    one = rig(scenario="fig6")
    assert one.world.tick == 0
    one.world.run_for(ms(200))
    assert one.robots[0].wheels.mode == ("drive", "drive")


def test_robots_and_links_of_all_networks_are_there():
    path = HERE.parents[2] / "examples" / "two_teams.toml"
    one = rig(scenario=path)
    places = [(robot.network, robot.slot) for robot in one.robots]
    assert len(one.links) == 2
    assert sorted(set(places)) == places
    assert {network for network, _ in places} == {0, 1}


def test_firmware_that_never_listens_is_said_to_be_so(tmp_path):
    path = tmp_path / "loop.ihx"
    path.write_text(":0200000080FE80\n:00000001FF\n")  # SJMP $
    with pytest.raises(
        BadInput, match=r"loop\.ihx: the firmware has not turned its serial receiver on 267 ms"
    ):
        rig(firmware=path)
    one = rig(firmware=path, boot=False)
    one.world.run_for(ms(5))


def test_checks_judge_what_a_test_did():
    one = rig(expect={"frames_accepted_min": 2})
    one.links[0].ping()
    (failure,) = one.judge()
    assert (failure.check, failure.found) == ("frames_accepted_min", "1")


def test_a_fault_in_the_last_moment_is_judged_too():
    one = rig(settings=["stop_on_fault=false"])
    one.world.robot().board.fault(FaultKind.UNDEFINED_OPCODE, 0x123, one.world.tick)
    assert [failure.check for failure in one.judge()] == ["no_fault"]
    assert one.tick == CONTROL_PERIOD_TICKS


def test_the_end_of_a_test_is_its_own_not_that_of_the_period():
    one = rig()
    one.world.run_for(ms(3))
    assert one.judge() == []
    assert one.tick == CONTROL_PERIOD_TICKS + ms(3)
    assert one.facts()["mirotwin_digest"] == one.world.digest
    assert one.judge() == []


def test_checks_of_a_world_that_was_loaded_judge_as_those_from_its_begin():
    one = rig()
    whole = World(one.world.scenario, 0, one.world.image)
    checks = Checks(whole, one.options.expected)
    frame = encode(ServiceFrame.ping(0, 0), 3)
    for world in (one.world, whole):
        world.run_to(ms(50))
        world.inject(frame)
        world.run_to(ms(300))
    one.judge()
    whole.run_to(one.world.tick)
    checks.finish()
    assert one.checks.verdicts() == checks.verdicts()
    assert one.world.digest == whole.digest
