"""The world of a test and what its fixtures do: marker, checks, link and robot."""

from pathlib import Path

import pytest

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, ms
from miro_protocol.frames import ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.faults import FaultKind
from miro_sim.scenario.file import load
from miro_sim.world import conditions
from miro_sim.world.waits import WaitExpired
from miro_sim.world.world import World
from mirotwin.testing.rig import Rig
from mirotwin.testing.rig_options import rig_options
from mirotwin.testing.waiting import WaitFailed
from mirotwin.verify.checks.expect import ALWAYS_ON
from mirotwin.verify.checks.monitors import Checks
from tests.mirotwin.conftest import hex_file

HERE = Path(__file__).parent


def options(*markers, seed=0):
    return rig_options([pytest.mark.mirotwin(**keys).mark for keys in markers], HERE, None, seed)


def rig(seed=0, **keys):
    """As the fixtures make it."""
    return Rig(options(keys, seed=seed))


@pytest.fixture
def one():
    return rig()


@pytest.fixture
def world(one):
    return one.world


@pytest.fixture
def link(one):
    return one.links[0]


@pytest.fixture
def robot(one):
    return one.robots[0]


def test_a_robot_is_up_and_stands_when_its_test_begins(world, link, robot):
    assert world.tick == CONTROL_PERIOD_TICKS
    assert robot.wheels.mode == ("off", "off")
    assert link.answers == []
    link.poll(0)
    assert link.expect(TelemetryFrame, within=ms(40)).accepted == 1


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
    one = rig(scenario=HERE.parents[2] / "examples" / "two_teams.toml")
    places = [(robot.network, robot.slot) for robot in one.robots]
    assert len(one.links) == 2
    assert sorted(set(places)) == places
    assert {network for network, _ in places} == {0, 1}


def test_firmware_that_never_listens_is_said_to_be_so(tmp_path):
    path = hex_file(tmp_path / "loop.ihx", b"\x80\xfe")  # SJMP $
    said = r"loop\.ihx: the firmware has not turned its serial receiver on 267 ms"
    with pytest.raises(BadInput, match=said):
        rig(firmware=path)
    rig(firmware=path, boot=False).world.run_for(ms(5))


# The marker


REFUSED = [
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
]


@pytest.mark.parametrize(("keys", "said"), REFUSED)
def test_a_marker_that_cannot_be_met_is_refused_with_the_remedy(keys, said):
    with pytest.raises(BadInput, match=said):
        Rig(options(keys, seed=keys.get("seed", 0)))


def test_a_marker_without_names_is_refused():
    with pytest.raises(BadInput, match="'fig6' has no name; write scenario='fig6'"):
        rig_options([pytest.mark.mirotwin("fig6").mark], HERE, None, 0)


def test_the_innermost_marker_holds_and_settings_and_expectations_add_up():
    inner = {"boot": False, "settings": ["duration_s=2"], "expect": {"inside_pitch": True}}
    outer = {
        "boot": True,
        "scenario": {"duration_s": 9},
        "settings": ["duration_s=3", "network.robots=5"],
        "expect": {"inside_pitch": False, "frames_accepted_min": 1},
    }
    made = options(inner, outer)
    assert (made.boot, made.spec.scenario.duration_s, made.spec.scenario.networks[0].robots) == (False, 2, 5)
    added = [check.name for check in made.spec.expected[0, 0]][len(ALWAYS_ON) :]
    assert added == ["inside_pitch", "frames_accepted_min"]


def test_a_test_that_names_no_scenario_has_the_one_that_is_called_silent():
    assert options().spec.scenario == options({"scenario": "silent"}).spec.scenario == load("silent").scenario


def test_a_table_as_scenario_changes_keys_of_the_silent_one():
    table = {"network.radio": {"profile": "fade15", "keyup_s": 0.002}, "duration_s": 5}
    network = options({"scenario": table}).spec.scenario.networks[0]
    assert (network.radio.keyup_s, network.host) == (0.002, "silent")


# Checks


def test_checks_judge_what_a_test_did():
    one = rig(expect={"frames_accepted_min": 2})
    one.links[0].ping()
    (failure,) = one.judge().failures
    assert (failure.check, failure.found) == ("frames_accepted_min", "1")


def test_a_fault_in_the_last_moment_is_judged_too():
    one = rig(settings=["stop_on_fault=false"])
    one.world.robot().board.fault(FaultKind.UNDEFINED_OPCODE, 0x123, one.world.tick)
    assert [failure.check for failure in one.judge().failures] == ["no_fault"]
    assert one.tick == CONTROL_PERIOD_TICKS


def test_the_end_of_a_test_is_its_own_not_that_of_the_period(one, world):
    world.run_for(ms(3))
    assert not one.judge().lines
    assert one.tick == CONTROL_PERIOD_TICKS + ms(3)
    assert one.judge().facts()["digest"] == world.digest


def test_checks_of_a_world_that_was_loaded_judge_as_those_from_its_begin(one):
    whole = World(one.world.scenario, 0, one.world.image)
    checks = Checks(whole, one.options.spec.expected)
    frame = encode(ServiceFrame.ping(0, 0), 3)
    for world in (one.world, whole):
        world.run_to(ms(50))
        world.inject(frame)
        world.run_to(ms(300))
    one.judge()
    whole.run_to(one.world.tick)
    checks.finish()
    assert one.run.checks.verdicts() == checks.verdicts()
    assert one.world.digest == whole.digest


# The link: sending, expecting, silence


def test_numbers_count_by_themselves_and_velocities_go_by_slot(world, link, robot):
    assert [link.send(velocities={0: (100, -100)}).seq for _ in range(3)] == [0, 1, 2]
    world.run_for(ms(5))
    assert robot.wheels.commanded == (100, -100)
    assert (robot.read("last_left"), robot.read("last_right")) == (100, -100)
    link.send(velocities={1: (7, 7)})
    world.run_for(ms(5))
    assert robot.wheels.commanded == (0, 0)
    assert robot.wheels.mode == ("drive", "drive")
    assert robot.read("frames_accepted") == 4


def test_a_frame_of_ones_own_brings_its_number_and_the_next_one_follows_it(link):
    link.send(TeamFrame(0, 62, ((1, 2), (3, 4), (5, 6))))
    assert [link.ping().seq, link.poll(2).seq, link.send(velocities={}, seq=9).seq] == [63, 2, 9]
    assert link.velocities == [(0, 0), (0, 0), (0, 0)]


def test_a_poll_asks_the_robot_in_its_turn_and_keeps_the_velocities():
    one = rig(settings=["network.robots=5", "network.robot.slot=4"])
    link = one.links[0]
    link.send(velocities={4: (300, 300)})
    assert link.poll(4).seq == 4
    assert link.expect(within=ms(40), slot=4).seq == 4
    assert one.robots[0].wheels.commanded == (300, 300)
    assert link.poll(4).seq == 9
    link.send(velocities={}, seq=59)
    with pytest.raises(ValueError, match="no number that is fresh after 59 asks robot 4"):
        link.poll(4)


def test_a_character_with_a_bad_stop_bit_spoils_its_frame(world, link, robot):
    for bad_stop, accepted in (([10], 0), ([], 1)):
        link.send(velocities={0: (50, 50)}, bad_stop=bad_stop)
        world.run_for(ms(5))
        assert robot.read("frames_accepted") == accepted


def test_without_wait_time_stands_and_frames_queue(world, link):
    begun = world.tick
    first, second = (link.send(velocities={}, wait=False) for _ in range(2))
    assert world.tick == begun
    assert first.end_tick == second.tick
    later = link.send(b"\x00\xff", at_tick=second.end_tick + ms(7))
    assert (later.tick, later.seq) == (second.end_tick + ms(7), None)
    assert world.tick == later.end_tick


def test_answers_that_nobody_has_taken_stay():
    line = 'kind = "line", start_x_cm = 20.0, drive_s = 1.0'
    robots = (f"{{slot = {n}, reference = {{{line}, start_y_cm = {40.0 * n}}}}}" for n in range(2))
    one = rig(settings=[f"network.robot=[{', '.join(robots)}]"])
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


def test_the_wait_of_the_world_and_that_of_the_link_take_nothing_from_each_other(world, link):
    link.poll(0)
    link.expect(within=ms(40))
    assert world.tick == link.answers[0][0]  # the end of its last character
    started = world.run_until(conditions.Command(name="STT"), within=0)
    assert started.tick < world.tick
    heard = world.run_until(conditions.Answer(), within=0)
    assert heard.tick == link.answers[0][0]


def test_an_answer_of_other_content_is_not_the_one_that_was_asked_for(link):
    link.poll(0)
    with pytest.raises(WaitFailed, match="no answer with accepted=7 within 40 ms"):
        link.expect(accepted=7, within=ms(40))
    assert link.expect(accepted=1, within=0).slot == 0


def test_what_failed_says_what_happened_instead(link):
    link.poll(1)
    said = r"(?s)no answer within 40 ms, from tick \d+ .*robot0: command left STT"
    with pytest.raises(WaitFailed, match=said) as caught:
        link.expect(within=ms(40))
    assert caught.value.tick == caught.value.begun_tick + ms(40)


def test_silence_is_kept_or_broken_at_the_first_character(world, link):
    begun = world.tick
    link.expect_silence(ms(20))
    assert world.tick == begun + ms(20)
    link.poll(0)
    with pytest.raises(WaitFailed, match=r"(?s)silence for 40 ms: broken.*heard 55h"):
        link.expect_silence(ms(40))
    link.expect(within=ms(40))
    link.expect_silence(ms(1))


def test_characters_are_found_in_what_was_heard(world, link):
    link.poll(0)
    tick = link.expect_bytes(b"\x55\x55\xff\x2d", within=ms(40))
    assert tick == world.tick
    assert tick < link.expect_bytes(b"\xd4", within=ms(40))
    with pytest.raises(WaitFailed, match="55 55 not heard within 30 ms"):
        link.expect_bytes(b"\x55\x55", within=ms(30))


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({}, "nothing to send: give a frame, bytes, or velocities"),
        ({"velocities": {3: (1, 1)}}, "slot 3 does not exist on a network of 3 robots"),
        ({"velocities": {0: (40000, 1)}}, r"slot 0 left = 40000: must be -32767..32767"),
        ({"frame": b"\x00", "bad_stop": [1]}, "net0: "),
    ],
)
def test_what_cannot_be_sent_is_refused(link, keys, said):
    with pytest.raises(ValueError, match=said):
        link.send(**keys)


def test_a_field_that_telemetry_does_not_have_is_refused(link):
    with pytest.raises(BadInput, match="telemetry has no field 'acepted'; it has seq, slot, flags"):
        link.expect(acepted=1, within=1)


@pytest.mark.parametrize(
    "wait",
    [
        lambda link: link.expect(within=0.08),
        lambda link: link.expect_bytes(b"\x55", within=0.08),
        lambda link: link.expect_silence(0.08),
    ],
)
def test_seconds_where_ticks_belong_are_refused(link, wait):
    with pytest.raises(ValueError, match=r"is no whole number of ticks; mirotwin.ms\(40\) gives one"):
        wait(link)


# The robot: wheels, breakpoints, memory, switches


def test_service_frames_reach_the_firmware(world, link, robot):
    link.set_acceleration(0, 1000)
    link.set_filter(0, 1, 2, 3, 4)
    world.run_for(ms(5))
    assert robot.read("acceleration") == [0xE8, 3, 0, 0]
    assert robot.read("filter[2]") == 2


def test_wheels_turn_stop_and_are_switched_off_as_the_failsafe_says(world, link, robot):
    link.drive({0: (2278, 1139)}, ms(500))  # 0.2 and 0.1 m/s
    left, right = robot.wheels.speed_m_s
    assert 0.19 < left < 0.21
    assert 0.09 < right < 0.11
    duties = []
    for _ in range(8):  # one sample's duty is noisy
        world.run_for(ms(5))
        duties.append(robot.wheels.pwm)
    left_duty, right_duty = (sum(duty[side] for duty in duties) for side in (0, 1))
    assert left_duty > right_duty > 0
    assert robot.wheels.left.position > robot.wheels.right.position > 0
    end = robot.break_at("motion_stop", within=ms(150))
    world.run_for(ms(1))
    assert robot.wheels.mode == ("stop", "stop")
    assert robot.wheels.commanded == (0, 0)
    robot.break_at("motion_off", within=ms(400))
    world.run_for(ms(1))
    assert robot.wheels.mode == ("off", "off")
    assert world.tick - end.tick > ms(389)


def test_a_breakpoint_stops_each_time_before_its_instruction(link, robot):
    ticks = []
    for _ in range(3):
        link.send(velocities={0: (5, 5)})
        ticks.append(robot.break_at("_motion_team", within=ms(10)).tick)
    assert robot.read("frames_accepted") == 3
    assert ticks == sorted(set(ticks))
    with pytest.raises(WaitFailed, match="motion_team was not reached within 10 ms"):
        robot.break_at("motion_team", within=ms(10))


def test_a_wait_without_an_end_ends_at_the_limit_of_virtual_time():
    one = rig(settings=["duration_s=0.3"])
    with pytest.raises(WaitFailed, match=r"limit of virtual time was reached, duration_s = 0\.3"):
        one.robots[0].break_at("motion_team")
    with pytest.raises(WaitFailed, match=r"no answer .* limit of virtual time was reached"):
        one.links[0].expect(within=ms(500))
    with pytest.raises(WaitFailed, match=r"silence .* limit of virtual time was reached"):
        one.links[0].expect_silence(ms(500))
    with pytest.raises(WaitExpired, match="the run ended"):
        one.world.run_until(conditions.Answer())


def test_a_symbol_that_is_no_function_is_refused(robot):
    with pytest.raises(BadInput, match="no symbol last_left in the code"):
        robot.break_at("last_left")


def test_writing_into_a_robots_memory_is_remembered(one, robot):
    assert not robot.written
    robot.write("last_left", -5)
    assert robot.read("last_left") == -5
    assert robot.written


def test_a_reset_forgets_what_the_firmware_counted_and_comes_up_again(world, link, robot):
    link.drive({0: (300, 300)}, ms(100))
    assert robot.read("frames_accepted") == 3
    begun = world.tick
    robot.reset()
    assert ms(1) < world.tick - begun < ms(1) + 300
    assert robot.wait_until_up(within=ms(10)) < begun + ms(10)
    assert robot.read("frames_accepted") == 0
    link.poll(0)
    assert link.expect(within=ms(40)).accepted == 1


def test_a_robot_without_power_is_silent_and_comes_back(link, robot):
    robot.power_off()
    link.poll(0)
    link.expect_silence(ms(40))
    with pytest.raises(WaitFailed, match="has not turned its serial receiver on within 20 ms"):
        robot.wait_until_up(within=ms(20))
    robot.power_on()
    robot.wait_until_up()
    link.poll(0)
    link.expect(within=ms(40))


def test_a_radio_that_is_down_loses_frames_and_the_failsafe_stops_the_wheels(link, robot):
    for radio, for_ms, mode in (("up", 100, "drive"), ("down", 150, "stop"), ("up", 34, "drive")):
        link.radio(radio)
        link.drive({0: (300, 300)}, ms(for_ms))
        assert robot.wheels.mode == (mode, mode)


@pytest.mark.parametrize(("what", "verdict"), [("flip 2Ah.3", "passed"), ("rxd 1", "not judged")])
def test_a_fault_that_changes_nothing_leaves_a_test_that_is_not_judged(one, robot, what, verdict):
    one.world.run_for(ms(20))
    robot.fault(what)
    one.world.run_for(ms(50))
    assert one.judge().verdict == verdict
