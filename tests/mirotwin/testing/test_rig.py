"""What the fixtures do, in this process: sending, waiting, reading, judging."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, ms
from miro_protocol.frames import ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.faults import FaultKind
from miro_sim.world import conditions
from miro_sim.world.waits import WaitExpired
from miro_sim.world.world import World
from mirotwin.checks.watching import Checks
from mirotwin.testing.rig import Rig
from mirotwin.testing.waiting import WaitFailed
from mirotwin.testing.wanted import marked, wanted

HERE = Path(__file__).parent


def rig(seed: int = 0, **keys: Any) -> Rig:
    return Rig(wanted(marked([((), keys)]), HERE, None, seed))


# The world


def test_a_robot_is_up_and_stands_when_its_test_begins() -> None:
    one = rig()
    assert one.world.tick == CONTROL_PERIOD_TICKS
    assert one.robots[0].wheels.told == ("off", "off")
    assert one.links[0].answers == []
    one.links[0].poll(0)
    assert one.links[0].expect(TelemetryFrame, within=ms(40)).accepted == 1


def test_the_second_world_is_loaded_and_goes_on_as_the_first_that_booted_itself() -> None:
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


def test_a_world_without_boot_stands_at_power_on() -> None:
    one = rig(boot=False)
    assert one.world.tick == 0
    one.robots[0].break_at("main", ms(1))
    assert 0 < one.world.tick < ms(1)


def test_a_scenario_with_a_controller_begins_at_power_on_and_drives_by_itself() -> None:
    one = rig(scenario="fig6")
    assert one.world.tick == 0
    one.world.run_for(ms(200))
    assert one.robots[0].wheels.told == ("drive", "drive")


def test_robots_and_links_of_all_networks_are_there() -> None:
    path = HERE.parents[2] / "examples" / "two_teams.toml"
    one = rig(scenario=path)
    places = [(robot.network, robot.slot) for robot in one.robots]
    assert len(one.links) == 2
    assert sorted(set(places)) == places
    assert {network for network, _ in places} == {0, 1}


def test_firmware_that_never_listens_is_said_to_be_so(tmp_path: Path) -> None:
    path = tmp_path / "loop.ihx"
    path.write_text(":0200000080FE80\n:00000001FF\n")  # SJMP $
    with pytest.raises(
        BadInput, match=r"loop\.ihx: the firmware has not turned its serial receiver on 267 ms"
    ):
        rig(firmware=path)
    one = rig(firmware=path, boot=False)
    one.world.run_for(ms(5))


# The link


def test_numbers_count_by_themselves_and_velocities_go_by_slot() -> None:
    one = rig()
    link, robot = one.links[0], one.robots[0]
    assert [link.send(velocities={0: (100, -100)}).seq for _ in range(3)] == [0, 1, 2]
    one.world.run_for(ms(5))
    assert robot.wheels.commanded == (100, -100)
    assert (robot.read("last_left"), robot.read("last_right")) == (100, -100)
    link.send(velocities={1: (7, 7)})
    one.world.run_for(ms(5))
    assert robot.wheels.commanded == (0, 0)
    assert robot.wheels.told == ("drive", "drive")
    assert robot.read("frames_accepted") == 4


def test_a_frame_of_ones_own_brings_its_number_and_the_next_one_follows_it() -> None:
    link = rig().links[0]
    link.send(TeamFrame(0, 62, ((1, 2), (3, 4), (5, 6))))
    assert [link.ping().seq, link.poll(2).seq, link.send(velocities={}, seq=9).seq] == [63, 2, 9]
    assert link.velocities == {0: (0, 0), 1: (0, 0), 2: (0, 0)}


def test_a_poll_asks_the_robot_in_its_turn_and_keeps_the_velocities() -> None:
    one = rig(settings=["network.robots=5", "network.robot.slot=4"])
    link = one.links[0]
    link.send(velocities={4: (300, 300)})
    assert link.poll(4).seq == 4
    assert link.expect(within=ms(40), slot=4).seq == 4
    assert one.robots[0].wheels.commanded == (300, 300)
    assert link.poll(4).seq == 9


def test_a_character_with_a_bad_stop_bit_spoils_its_frame() -> None:
    one = rig()
    one.links[0].send(velocities={0: (50, 50)}, bad_stop=[10])
    one.world.run_for(ms(5))
    assert one.robots[0].read("frames_accepted") == 0
    one.links[0].send(velocities={0: (50, 50)})
    one.world.run_for(ms(5))
    assert one.robots[0].read("frames_accepted") == 1


def test_without_wait_time_stands_and_frames_queue() -> None:
    one = rig()
    begun = one.world.tick
    first, second = (one.links[0].send(velocities={}, wait=False) for _ in range(2))
    assert one.world.tick == begun
    assert first.end_tick == second.tick
    later = one.links[0].send(b"\x00\xff", at_tick=second.end_tick + ms(7))
    assert (later.tick, later.seq) == (second.end_tick + ms(7), None)
    assert one.world.tick == later.end_tick


def test_answers_that_nobody_has_taken_stay() -> None:
    one = rig(
        settings=[
            'network.robot=[{slot = 0, reference = {kind = "line", start_x_cm = 20.0, drive_s = 1.0}}, '
            '{slot = 1, reference = {kind = "line", start_x_cm = 20.0, start_y_cm = 40.0, drive_s = 1.0}}]'
        ]
    )
    link = one.links[0]
    link.poll(0)
    one.world.run_for(ms(25))
    link.poll(1)
    one.robots[0].break_at("motion_stop")  # a wait of somebody else, while both answers come
    assert link.expect(TelemetryFrame, slot=1, within=0).slot == 1
    assert link.expect(TelemetryFrame, within=0).slot == 0
    with pytest.raises(WaitFailed, match="no answer within 0 ms"):
        link.expect(TelemetryFrame, within=0)
    assert [answer.slot for _, answer in link.answers] == [0, 1]


def test_the_wait_of_the_world_and_that_of_the_link_take_nothing_from_each_other() -> None:
    one = rig()
    one.links[0].poll(0)
    one.links[0].expect(within=ms(40))
    started = one.world.run_until(conditions.Command(name="STT"), within=0)
    assert started.tick < one.world.tick
    heard = one.world.run_until(conditions.Answer(), within=0)
    assert heard.tick == one.links[0].answers[0][0]


def test_an_answer_stops_the_world_at_the_end_of_its_last_character() -> None:
    one = rig()
    one.links[0].poll(0)
    one.links[0].expect(within=ms(40))
    assert one.world.tick == one.links[0].answers[0][0]


def test_an_answer_of_other_content_is_not_the_one_that_was_asked_for() -> None:
    one = rig()
    one.links[0].poll(0)
    with pytest.raises(WaitFailed, match="no answer with accepted=7 within 40 ms"):
        one.links[0].expect(accepted=7, within=ms(40))
    assert one.links[0].expect(accepted=1, within=0).slot == 0


def test_what_failed_says_what_happened_instead() -> None:
    one = rig()
    one.links[0].poll(1)
    with pytest.raises(
        WaitFailed, match=r"(?s)no answer within 40 ms, from tick \d+ .*robot0: command left STT"
    ) as caught:
        one.links[0].expect(within=ms(40))
    assert caught.value.tick == caught.value.begun_tick + ms(40)


def test_silence_is_kept_or_broken_at_the_first_character() -> None:
    one = rig()
    begun = one.world.tick
    one.links[0].expect_silence(ms(20))
    assert one.world.tick == begun + ms(20)
    one.links[0].poll(0)
    with pytest.raises(WaitFailed, match=r"(?s)silence for 40 ms: broken.*heard 55h"):
        one.links[0].expect_silence(ms(40))
    one.links[0].expect(within=ms(40))
    one.links[0].expect_silence(ms(1))


def test_characters_are_found_in_what_was_heard() -> None:
    one = rig()
    one.links[0].poll(0)
    tick = one.links[0].expect_bytes(b"\x55\x55\xff\x2d", within=ms(40))
    assert tick == one.world.tick
    assert tick < one.links[0].expect_bytes(b"\xd4", within=ms(40))
    with pytest.raises(WaitFailed, match="55 55 not heard within 30 ms"):
        one.links[0].expect_bytes(b"\x55\x55", within=ms(30))


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({}, "nothing to send: give a frame, bytes, or velocities"),
        ({"velocities": {3: (1, 1)}}, "slot 3 does not exist on a network of 3 robots"),
        ({"velocities": {0: (40000, 1)}}, r"slot 0 left = 40000: must be -32767..32767"),
        ({"frame": b"\x00", "bad_stop": [1]}, "net0: "),
    ],
)
def test_what_cannot_be_sent_is_refused(keys: Mapping[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        rig().links[0].send(**keys)


def test_a_field_that_telemetry_does_not_have_is_refused() -> None:
    with pytest.raises(BadInput, match="telemetry has no field 'acepted'; it has seq, slot, flags"):
        rig().links[0].expect(acepted=1, within=1)


# The robot


def test_service_frames_reach_the_firmware() -> None:
    one = rig()
    one.links[0].set_acceleration(0, 1000)
    one.links[0].set_filter(0, 1, 2, 3, 4)
    one.world.run_for(ms(5))
    assert one.robots[0].read("acceleration") == [0xE8, 3, 0, 0]
    assert one.robots[0].read("filter[2]") == 2


def test_wheels_turn_stop_and_are_switched_off_as_the_failsafe_says() -> None:
    one = rig()
    link, robot = one.links[0], one.robots[0]
    link.drive({0: (2278, 1139)}, ms(500))  # 0.2 and 0.1 m/s
    left, right = robot.wheels.speed_m_s
    assert 0.19 < left < 0.21
    assert 0.09 < right < 0.11
    assert robot.wheels.pwm[0] > robot.wheels.pwm[1] > 0
    assert robot.wheels.left.position > robot.wheels.right.position > 0
    end = robot.break_at("motion_stop", within=ms(150))
    one.world.run_for(ms(1))
    assert robot.wheels.told == ("stop", "stop")
    assert robot.wheels.commanded == (0, 0)
    robot.break_at("motion_off", within=ms(400))
    one.world.run_for(ms(1))
    assert robot.wheels.told == ("off", "off")
    assert one.world.tick - end.tick > ms(389)


def test_a_breakpoint_stops_each_time_before_its_instruction() -> None:
    one = rig()
    link, robot = one.links[0], one.robots[0]
    ticks = []
    for _ in range(3):
        link.send(velocities={0: (5, 5)})
        ticks.append(robot.break_at("_motion_team", within=ms(10)).tick)
    assert robot.read("frames_accepted") == 3
    assert ticks == sorted(set(ticks))
    with pytest.raises(WaitFailed, match="motion_team was not reached within 10 ms"):
        robot.break_at("motion_team", within=ms(10))


def test_a_wait_without_an_end_ends_at_the_limit_of_virtual_time() -> None:
    one = rig(settings=["duration_s=0.3"])
    with pytest.raises(WaitFailed, match=r"limit of virtual time was reached, duration_s = 0\.3"):
        one.robots[0].break_at("motion_team")
    with pytest.raises(WaitFailed, match=r"no answer .* limit of virtual time was reached"):
        one.links[0].expect(within=ms(500))
    with pytest.raises(WaitFailed, match=r"silence .* limit of virtual time was reached"):
        one.links[0].expect_silence(ms(500))
    with pytest.raises(WaitExpired, match="the run ended"):
        one.world.run_until(conditions.Answer())


def test_a_symbol_that_is_no_function_is_refused_with_what_comes_close() -> None:
    robot = rig().robots[0]
    with pytest.raises(BadInput, match=r"motion_stap: there is no such function; did you mean motion_stop"):
        robot.break_at("motion_stap")
    with pytest.raises(BadInput, match="last_left: is no code"):
        robot.break_at("last_left")


def test_writing_into_a_robots_memory_is_remembered() -> None:
    one = rig()
    assert not one.written
    one.robots[0].write("last_left", -5)
    assert one.robots[0].read("last_left") == -5
    assert one.written


# Judging


def test_checks_judge_what_a_test_did() -> None:
    one = rig(expect={"frames_accepted_min": 2})
    one.links[0].ping()
    (failure,) = one.judge()
    assert (failure.check, failure.found) == ("frames_accepted_min", "1")


def test_a_fault_in_the_last_moment_is_judged_too() -> None:
    one = rig(settings=["stop_on_fault=false"])
    one.world.robot().board.fault(FaultKind.UNDEFINED_OPCODE, 0x123, one.world.tick)
    assert [failure.check for failure in one.judge()] == ["no_fault"]
    assert one.tick == CONTROL_PERIOD_TICKS


def test_the_end_of_a_test_is_its_own_not_that_of_the_period() -> None:
    one = rig()
    one.world.run_for(ms(3))
    assert one.judge() == []
    assert one.tick == CONTROL_PERIOD_TICKS + ms(3)
    assert one.facts()["mirotwin_digest"] == one.world.digest
    assert one.judge() == []


def test_checks_of_a_world_that_was_loaded_judge_as_those_from_its_begin() -> None:
    one = rig()
    whole = World(one.world.scenario, 0, one.world.image)
    checks = Checks(whole, one.wanted.expected)
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


# The marker


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"scnario": "fig6"}, "there is no key 'scnario'; did you mean scenario?"),
        ({"scenario": "fig16"}, "fig16: no such scenario; did you mean fig6?"),
        ({"scenario": "gone.toml"}, "gone.toml: no such file"),
        ({"scenario": 6}, "scenario=6; give a built-in scenario's name, a path, or a table"),
        ({"scenario": {"network.radio.latncy_s": 1}}, r"--set network\.radio\.latncy_s=1: unknown key"),
        ({"settings": "a=1"}, "settings='a=1'; give a list"),
        ({"settings": ["a"]}, r"settings=\['a'\]; give a list"),
        ({"firmware": "gone.ihx"}, "gone.ihx: there is no such file"),
        ({"seed": -1}, "seed: -1 is out of range"),
        ({"seed": True}, "seed=True; give a whole number"),
        ({"expect": {"no_fualt": True}}, "expect.no_fualt: there is no such check"),
        ({"boot": 1}, "boot=1; give True or False"),
    ],
)
def test_a_marker_that_cannot_be_met_is_refused_with_the_remedy(keys: dict[str, Any], said: str) -> None:
    mark = dict(keys)
    with pytest.raises(BadInput, match=said):
        Rig(wanted(marked([((), mark)]), HERE, None, mark.get("seed", 0)))


def test_a_marker_without_names_is_refused() -> None:
    with pytest.raises(BadInput, match="'fig6' has no name; write scenario='fig6'"):
        marked([(("fig6",), {})])


def test_the_innermost_marker_holds_and_settings_and_expectations_add_up() -> None:
    inner = {"seed": 1, "settings": ["duration_s=2"], "expect": {"inside_pitch": True}}
    outer = {
        "seed": 2,
        "scenario": {"duration_s": 9},
        "settings": ["duration_s=3", "network.robots=5"],
        "expect": {"inside_pitch": False, "frames_accepted_min": 1},
    }
    found = marked([((), inner), ((), outer)])
    assert found.seed == 1
    assert found.settings == ("duration_s=3", "network.robots=5", "duration_s=2")
    assert found.expect == {"inside_pitch": True, "frames_accepted_min": 1}
    made = wanted(found, HERE, None, 0)
    assert (made.scenario.duration_s, made.scenario.networks[0].robots) == (2, 5)
    assert [check.name for check in made.expected[0, 0]][4:] == ["inside_pitch", "frames_accepted_min"]


def test_a_table_as_scenario_changes_keys_of_the_silent_one() -> None:
    table = {"network.radio": {"profile": "fade15", "keyup_s": 0.002}, "duration_s": 5}
    made = wanted(marked([((), {"scenario": table})]), HERE, None, 0)
    assert made.scenario.networks[0].radio.keyup_s == 0.002
    assert made.scenario.networks[0].host == "silent"


# Switches


def test_a_reset_forgets_what_the_firmware_counted_and_comes_up_again() -> None:
    one = rig()
    link, robot = one.links[0], one.robots[0]
    link.drive({0: (300, 300)}, ms(100))
    assert robot.read("frames_accepted") == 3
    begun = one.world.tick
    robot.reset()
    assert ms(1) < one.world.tick - begun < ms(1) + 300
    assert robot.wait_until_up(within=ms(10)) < begun + ms(10)
    assert robot.read("frames_accepted") == 0
    link.poll(0)
    assert link.expect(within=ms(40)).accepted == 1


def test_a_robot_without_power_is_silent_and_comes_back() -> None:
    one = rig()
    link, robot = one.links[0], one.robots[0]
    robot.power_off()
    link.poll(0)
    link.expect_silence(ms(40))
    with pytest.raises(WaitFailed, match="has not turned its serial receiver on within 20 ms"):
        robot.wait_until_up(within=ms(20))
    robot.power_on()
    robot.wait_until_up()
    link.poll(0)
    link.expect(within=ms(40))


def test_a_radio_that_is_down_loses_frames_and_the_failsafe_stops_the_wheels() -> None:
    one = rig()
    link, robot = one.links[0], one.robots[0]
    link.drive({0: (300, 300)}, ms(100))
    link.radio("down")
    link.drive({0: (300, 300)}, ms(150))
    assert robot.wheels.told == ("stop", "stop")
    link.radio("up")
    link.drive({0: (300, 300)}, ms(34))
    assert robot.wheels.told == ("drive", "drive")
