"""Replay without a world: scripts, the comparison of periods, and streams as scenarios."""

from types import SimpleNamespace

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, NEVER_TICK, TICKS_PER_SECOND
from miro_host.posture import Posture
from miro_protocol.frames import TeamFrame, TelemetryFrame, encode
from miro_protocol.transmission import Transmission
from miro_sim.periods import Axis
from miro_sim.radio.params import Radio
from miro_sim.scenario.build import check_robots
from mirotwin.recording.capture.rows import rows
from mirotwin.recording.compare import differences
from mirotwin.replay.text import frame_tables, frame_text
from mirotwin.runs.job import robots_of_stream, scenario_of_stream, script_of, script_of_stream
from tests.mirotwin.synthetic import periods

*BEFORE, PERIOD = periods(4, [(0, 0), (1, 2)])


def compare(recorded, replayed):
    """The first difference, with the period in the place of the last of four."""
    return next(iter(differences([*BEFORE, recorded], [*BEFORE, replayed])), None)


def changed(side=None, **fields):
    """The period with something else about its second robot."""
    first, second = PERIOD.robots
    if side is None:
        second = msgspec.structs.replace(second, **fields)
    else:
        axis = msgspec.structs.replace(getattr(second, side), **fields)
        second = msgspec.structs.replace(second, **{side: axis})
    return msgspec.structs.replace(PERIOD, robots=(first, second))


def team(robots, seq=3):
    return encode(TeamFrame(0, seq, tuple((10 * slot, -slot) for slot in range(robots))), robots)


def test_a_script_is_what_the_hosts_sent_and_nothing_else():
    script = script_of(periods(3))
    assert [sent.tick for sent in script] == [96_000 + index * CONTROL_PERIOD_TICKS for index in range(3)]
    assert {sent.data for sent in script} == {bytes(range(23))}


def test_a_period_equals_itself():
    assert compare(PERIOD, PERIOD) is None


def test_the_hosts_own_state_is_not_the_robots_response():
    assert compare(PERIOD, changed(control=None, measurement=None)) is None
    assert compare(PERIOD, msgspec.structs.replace(PERIOD, digest="00" * 32)) is None


@pytest.mark.parametrize(
    ("replayed", "expected"),
    [
        (changed(accepted=9), "firmware accepted: recorded 3, replayed 9"),
        (changed("left", real_position=298), "lm629 left real_position: recorded 297, replayed 298"),
        (changed("right", pwm_magnitude=0), "pwm right magnitude: recorded 3, replayed 0"),
        (
            changed("right", commands=()),
            "lm629 right command: recorded LTRJ 1Fh 1800002a at tick 2402406, replayed nothing",
        ),
        (changed(v_m_s=0.3), "truth v_m_s: recorded 0.30000000000000004, replayed 0.3"),
        (changed(truth=Posture(0.0, 0.0, 0.0)), "truth x_m: recorded "),
    ],
)
def test_the_first_difference_is_named_with_tick_robot_channel_and_both_values(replayed, expected):
    found = compare(PERIOD, replayed)
    assert found is not None
    assert f"/net1/robot2/{expected}" in str(found)
    assert str(found).startswith("tick 240240")


def test_a_different_command_comes_before_what_it_leads_to():
    recorded = changed("left", commands=((PERIOD.tick - 100, 0x1F, "1800002a"),))
    other = (PERIOD.tick - 99, 0x1F, "1800002b")
    found = compare(recorded, changed("left", commands=(other,), real_position=5))
    assert found.channel == "lm629 left command"
    assert found.tick == PERIOD.tick - 100


def test_an_answer_that_is_not_there_is_a_difference():
    silent = msgspec.structs.replace(PERIOD, wire=PERIOD.wire[:1])
    found = compare(PERIOD, silent)
    assert (found.channel, found.replayed, found.tick) == ("wire", None, PERIOD.wire[1].tick)


@given(
    st.sampled_from([name for name in Axis.__struct_fields__ if name != "commands"]), st.sampled_from("lr")
)
def test_no_register_of_a_motion_controller_is_left_out(name, side):
    whole = {"l": "left", "r": "right"}[side]
    value = getattr(getattr(PERIOD.robots[1], whole), name)
    assert compare(PERIOD, changed(whole, **{name: value + 1})) is not None


@pytest.mark.parametrize("robots", [3, 5])
def test_the_layout_of_a_stream_is_the_one_in_which_it_can_be_read(robots):
    sent = [Transmission(index * 900_000, ">", team(robots, index)) for index in range(3)]
    assert robots_of_stream(sent) == robots
    scenario = scenario_of_stream(sent)
    assert scenario.networks[0].robots == robots
    assert [robot.slot for robot in scenario.networks[0].robot] == list(range(robots))
    assert {robot.reference.drive_s for robot in scenario.networks[0].robot} == {0.0}
    check_robots(scenario, "a.txt")
    radio = scenario.networks[0].radio
    assert (radio.bit_error_rate, radio.carrier, radio.squelch) == (0.0, "on", True)
    assert scenario.duration_s * TICKS_PER_SECOND >= 1_800_000 + TICKS_PER_SECOND


def test_answers_in_a_stream_are_not_sent():
    sent = [Transmission(0, ">", b"\x01"), Transmission(5, "<", b"\x02"), Transmission(50_000, ">", b"\x03")]
    assert script_of_stream(sent) == [sent[0], sent[2]]


@pytest.mark.parametrize(
    ("sent", "expected"),
    [
        ([], "^no line from host to robot"),
        ([Transmission(0, "<", b"\x01")], "no line from host to robot"),
        (
            [Transmission(0, ">", b"\x01\x02"), Transmission(49_999, ">", b"\x03")],
            "tick 49999: starts before the",
        ),
        ([Transmission(NEVER_TICK, ">", b"\x01")], "more than a day"),
    ],
)
def test_a_stream_that_cannot_have_been_sent_is_refused(sent, expected):
    with pytest.raises(BadInput, match=expected):
        scenario_of_stream(sent)


def test_frames_are_listed_as_people_read_them_and_no_byte_is_dropped():
    answer = encode(TelemetryFrame(4, 1, accepted=7), 3)
    sent = [
        Transmission(1000, ">", team(3)),
        Transmission(900_000, "<", answer),
        Transmission(2_000_000, ">", b"\x00\x01\x02"),
    ]
    found = list(rows(sent, {0: 3}.__getitem__))
    texts = [frame_text(row) for row in found]
    assert texts[0] == "team seq=3  +0/+0 +10/-1 +20/-2"
    assert texts[1].startswith("telemetry seq=4 slot=1")
    assert texts[2] == "3 bytes, no sync: 00 01 02"
    assert [row.event.start_tick for row in found] == [1000, 900_000, 2_000_000]
    assert [getattr(row.message, "slot", None) for row in found] == [None, 1, None]


@pytest.mark.parametrize("place", [5, 12, 18])
def test_an_answer_with_a_bad_stop_bit_is_not_listed_as_valid(place):
    answer = encode(TelemetryFrame(4, 1, accepted=7), 3)
    (row,) = rows([Transmission(0, "<", answer, 0, (place,))], {0: 3}.__getitem__)
    assert (row.event.start_tick, row.message) == (0, None)
    assert frame_text(row).startswith("19 bytes, bad stop bit: 55 55")


@pytest.mark.parametrize("networks", [1, 2])
def test_a_list_of_frames_says_who_sent_each_as_far_as_that_can_be_known(networks):
    answer = encode(TelemetryFrame(4, 1, accepted=7), 3)
    sent = (
        Transmission(0, ">", team(3)),
        Transmission(900_000, "<", answer),
        Transmission(2_000_000, "<", answer, bad_stop=(5,)),
    )
    recorded = [msgspec.structs.replace(PERIOD, wire=sent)]
    scenario = SimpleNamespace(networks=[SimpleNamespace(robots=3, radio=Radio())] * networks)
    (table,) = frame_tables(
        SimpleNamespace(spec=SimpleNamespace(robot_scenario=scenario), recorded=recorded), [], True, None, []
    )
    network = "net0 " if networks > 1 else ""
    assert list(table.columns[3].cells) == [f"{network}host", f"{network}robot 1", f"{network}robot ?"]
