"""What counts as a difference under each rule, on periods that are made by hand."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.actions import Fault, Power, RadioState, Reset
from miro_protocol.transmission import Transmission
from mirotwin.recording.compare import CompareRule, Difference, differences
from mirotwin.recording.difference import first_per_channel
from mirotwin.recording.sequences import SAME_TICKS, LogEntry, unlike
from tests.mirotwin.synthetic import periods

RUN = list(periods(6, [(0, 0), (0, 2)]))
MS = 24_000


def changed(change):
    """The run with other robots: `change` is given each of them, and its period."""
    return [replace(period, robots=tuple(change(robot, period) for robot in period.robots)) for period in RUN]


def with_commands(ticks, data="0400"):
    """The run with commands to the left LM629 of the first robot at these ticks and nothing else."""

    def change(robot, period):
        before = period.tick - CONTROL_PERIOD_TICKS
        mine = tuple((tick, 0x1F, data) for tick in ticks if before < tick <= period.tick and robot.slot == 0)
        right = replace(robot.right, commands=())
        return replace(robot, left=replace(robot.left, commands=mine), right=right)

    return changed(change)


def with_answers(*answers):
    def wire(index):
        return tuple(one for one in answers if one.tick // CONTROL_PERIOD_TICKS == index)

    return [replace(period, wire=wire(period.index)) for period in RUN]


def with_position(offset, name="real_position"):
    """The run with another position of the right wheel of the second robot."""

    def change(robot, period):
        moved = replace(robot.right, **{name: getattr(robot.right, name) + offset})
        return replace(robot, right=moved) if robot.slot else robot

    return changed(change)


@pytest.mark.parametrize("kind", ["bits", "bytes", "commands", "wheels"])
def test_a_run_equals_itself_under_every_rule(kind):
    assert differences(RUN, RUN, CompareRule(kind=kind, host=True, digests=True)) == []


def test_commands_may_come_at_another_time_within_the_tolerance():
    recorded, faster = with_commands([100_000, 900_000]), with_commands([97_504, 897_504])
    assert len(differences(recorded, faster)) == 2
    assert differences(recorded, faster, CompareRule(kind="commands")) == []
    assert differences(recorded, faster, CompareRule(kind="commands", within_ticks=2496)) == []
    (first, _) = differences(recorded, faster, CompareRule(kind="commands", within_ticks=2495))
    assert (first.recorded, first.replayed) == ("LTRJ 1Fh 0400 at tick 100000", "LTRJ 1Fh 0400 at tick 97504")


def test_another_value_at_the_same_time_is_a_difference_under_commands():
    one, other = with_commands([100_000]), with_commands([100_000], "0401")
    (found,) = differences(one, other, CompareRule(kind="commands"))
    assert found.channel == "lm629 left command"
    assert (found.network, found.slot, found.tick) == (0, 0, 100_000)


def test_a_missing_command_shifts_none_behind_it():
    every = list(range(100_000, 4_000_000, 100_000))
    without = with_commands([tick for tick in every if tick != 1_000_000])
    (found,) = differences(with_commands(every), without, CompareRule(kind="commands"))
    assert (found.tick, found.replayed) == (1_000_000, None)


def test_wheels_and_pwm_are_no_matter_to_commands_nor_commands_to_wheels():
    assert differences(RUN, with_position(1000), CompareRule(kind="commands")) == []
    assert differences(with_commands([100_000]), with_commands([]), CompareRule(kind="wheels")) == []


@pytest.mark.parametrize(("name", "within"), [("real_position", 20), ("desired_position", 20)])
def test_positions_may_differ_by_the_tolerance_and_no_count_more(name, within):
    for offset in (within, -within):
        assert differences(RUN, with_position(offset, name), CompareRule(kind="wheels")) == []
    found = differences(RUN, with_position(within + 1, name), CompareRule(kind="wheels"))
    assert {(one.slot, one.channel) for one in found} == {(2, f"lm629 right {name}")}
    assert len(found) == len(RUN)


def test_desired_velocities_may_differ_by_the_tolerance():
    for offset, count in ((16_384, 0), (16_385, len(RUN))):
        moved = with_position(offset, "desired_velocity")
        assert len(differences(RUN, moved, CompareRule(kind="wheels"))) == count
    rule = CompareRule(kind="wheels", within_counts_per_sample=1.0)
    assert differences(RUN, with_position(65_536, "desired_velocity"), rule) == []


def test_bytes_are_compared_one_by_one_however_they_are_parted():
    one = with_answers(Transmission(300_000, "<", b"\x55\x2d\xd4"))
    last = Transmission(300_000 + 2 * 24_960, "<", b"\xd4")
    parted = with_answers(Transmission(300_100, "<", b"\x55"), last)
    (found,) = differences(one, parted, CompareRule(kind="bytes"))
    assert found.recorded == "2d at tick 324960"
    assert found.replayed is None
    assert len(differences(one, parted)) == 3


def test_a_bad_stop_bit_is_part_of_a_byte():
    good, bad = (with_answers(Transmission(300_000, "<", b"\x55\x2d", 0, stop)) for stop in ((), (1,)))
    (found,) = differences(good, bad, CompareRule(kind="bytes"))
    assert found.replayed == "2d with a bad stop bit at tick 324960"


def test_what_is_under_way_at_the_end_is_not_compared_with_a_tolerance():
    end = len(RUN) * CONTROL_PERIOD_TICKS
    late = with_answers(Transmission(end - 26_000, "<", b"\x55"))
    assert differences(late, with_answers(), CompareRule(kind="bytes")) == []
    assert len(differences(late, with_answers())) == 1
    command = RUN[-1].tick - 10_000
    assert differences(with_commands([command]), with_commands([]), CompareRule(kind="commands")) == []
    assert len(differences(with_commands([command]), with_commands([]))) == 1


def test_only_differences_in_the_window_are_told():
    moved = with_position(1)
    assert len(differences(RUN, moved)) == 6
    window = CompareRule(from_tick=2 * CONTROL_PERIOD_TICKS, to_tick=4 * CONTROL_PERIOD_TICKS)
    assert [one.period for one in differences(RUN, moved, window)] == [2, 3]


def test_the_hosts_values_and_actions_are_compared_on_request():
    actions = (Reset(5, 0, 2, 0), Power(6, 0, 2, 1), RadioState(7, 0, "noise"), Fault(8, 0, 2, "rxd 0"))
    robots = (replace(RUN[2].robots[0], control=None), RUN[2].robots[1])
    other = [*RUN[:2], replace(RUN[2], robots=robots, actions=actions), *RUN[3:]]
    assert differences(RUN, other) == []
    found = differences(RUN, other, CompareRule(host=True))
    named = {one.channel for one in found}
    assert {"control v_m_s", "control inner.u1", "actions"} <= named
    told = ["robot 2 reset 0 at tick 5", "robot 2 power 1 at tick 6", "radio noise at tick 7"]
    told += ["robot 2 rxd 0 at tick 8"]
    assert [one.replayed for one in found if one.channel == "actions"] == told
    assert found[0].channel == "actions"


def test_a_digest_alone_is_a_difference_at_the_end_of_its_period():
    other = [*RUN[:3], replace(RUN[3], digest="00" * 32), *RUN[4:]]
    assert differences(RUN, other) == []
    (found,) = differences(RUN, other, CompareRule(digests=True))
    assert (found.tick, found.period, found.channel) == (4 * CONTROL_PERIOD_TICKS, 3, "digest")
    assert str(found).startswith("tick 3203200 (0.133467 s), /period digest: recorded ")
    assert found.as_json()["replayed"] == "00" * 32


def test_runs_are_compared_as_far_as_both_go():
    assert differences(RUN, RUN[:2]) == differences(RUN[:1], RUN) == differences([], RUN) == []


def test_the_first_of_each_channel_is_told_with_how_many_there_are():
    found = differences(RUN, with_position(1))
    ((first, count),) = first_per_channel(found)
    assert (first, count) == (found[0], 6)


entries = st.lists(
    st.tuples(st.integers(1, 400_000), st.sampled_from("ab")), max_size=8, unique_by=lambda one: one[0]
).map(lambda found: [LogEntry(tick, text) for tick, text in sorted(found)])


@given(entries, entries, st.integers(0, 30_000))
def test_every_entry_is_alike_or_told_once_and_in_order(one, other, within):
    found = list(unlike(one, other, within))
    for side, whole in ((0, one), (1, other)):
        told = [pair[side] for pair in found if pair[side] is not None]
        assert all(each in whole for each in told)
        assert all(before.tick < after.tick for before, after in pairwise(told))
    left = [each for each in one if each not in [pair[0] for pair in found]]
    right = [each for each in other if each not in [pair[1] for pair in found]]
    assert [each.text for each in left] == [each.text for each in right]
    assert all(abs(a.tick - b.tick) <= within for a, b in zip(left, right, strict=True))


@given(entries, st.integers(-20_000, 20_000))
def test_a_run_that_is_shifted_as_a_whole_is_alike_within_the_shift(one, shift):
    apart = one[:1]
    for each in one[1:]:  # so far from each other that none can be taken for its neighbour
        if each.tick - apart[-1].tick > SAME_TICKS:
            apart.append(each)
    other = [LogEntry(each.tick + shift, each.text) for each in apart]
    assert list(unlike(apart, other, abs(shift))) == []
    if shift:
        assert len(list(unlike(apart, other, abs(shift) - 1))) == len(apart)


def test_a_difference_has_a_line_for_people_and_json_for_programs():
    found = Difference(24_000, 0, 1, 2, "pwm left sign", 1, None)
    assert str(found) == "tick 24000 (0.001000 s), /net1/robot2/pwm left sign: recorded 1, replayed nothing"
    assert found.line(("A", "B")).endswith("A 1, B nothing")
    place = {"tick": 24_000, "t_s": 0.001, "period": 0, "network": 1, "slot": 2, "channel": "pwm left sign"}
    assert found.as_json(("a", "b")) == {**place, "a": 1, "b": None}


def test_what_a_chip_answers_is_no_part_of_a_command():
    def left(robot, period, data):
        return replace(robot.left, commands=((period.tick, 0x0A, data),))

    def reading(data):
        return changed(lambda robot, period: replace(robot, left=left(robot, period, data)))

    one, other = reading("00000a3d"), reading("00000a46")
    assert differences(one, other, CompareRule(kind="commands")) == []
    assert differences(one, other)[0].recorded == "RDRP 0Ah 00000a3d at tick 0"
