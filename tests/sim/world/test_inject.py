"""Characters from outside: when they go on the air, what they meet there, and that nothing else changes."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import HOST_CHARACTER_TICKS
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.transmission import Transmission
from miro_sim.world import conditions as wait
from tests.sim.world.random_cuts import differing, differing_ticks
from tests.sim.world.rig import PERIOD, fig6, image, two_networks, world_of

FRAME = encode(TeamFrame(0, 5, ((100, 100), (0, 0), (0, 0))), 3)
KEYUP_TICKS = 24_000


def silent(**options):
    return two_networks("host = 'silent'", **options)


def recorded(periods=6):
    """What the hosts of a run sent, and its digest with the same as a script."""
    world = two_networks()
    runs = []
    for _ in range(periods):
        runs += [sent for sent in world.step().wire if sent.direction == ">"]
    scripted = two_networks(script=runs)
    scripted.run_to(periods * PERIOD)
    return runs, scripted.digest


def test_a_silent_host_sends_nothing_by_itself():
    world = silent()
    periods = [world.step() for _ in range(3)]
    assert {run.network for period in periods for run in period.wire if run.direction == ">"} == {1}


def test_injected_bytes_of_a_recording_give_the_digest_of_a_scripted_run():
    runs, digest = recorded()
    world = two_networks(script=[])
    for sent in runs:
        world.run_to(max(world.tick, sent.tick - 2 * PERIOD + 1))
        world.inject(sent.data, sent.network, sent.tick, sent.bad_stop)
    world.run_to(6 * PERIOD)
    assert world.digest == digest


@pytest.mark.slow
@settings(max_examples=15)
@given(st.data())
def test_when_input_is_announced_changes_nothing(data):
    runs, digest = recorded(4)
    world = two_networks(script=[])
    for sent in runs:
        latest = sent.tick - 120 - KEYUP_TICKS
        world.run_to(data.draw(st.integers(min(world.tick, latest), latest)))
        world.inject(sent.data, sent.network, sent.tick)
    world.run_to(4 * PERIOD)
    assert world.digest == digest


@pytest.mark.parametrize("radio", ["", "latency_s = 0.01", "latency_s = 0.02", 'carrier = "on"'])
def test_what_is_announced_at_the_begin_of_a_period_is_not_in_the_digest_of_the_one_before(radio):
    late, early = (two_networks(f"host = 'silent'\n[network.radio]\n{radio}") for _ in range(2))
    late.run_to(PERIOD)
    tick = late.inject(FRAME)
    early.inject(FRAME, at_tick=tick)
    late.run_to(3 * PERIOD)
    early.run_to(3 * PERIOD)
    assert late.digest == early.digest


@pytest.mark.parametrize("latency_s", [0.0, 0.005])
def test_what_is_injected_at_the_last_moment_of_a_period_gives_the_digest_of_a_script(latency_s):
    settings = "duration_s=0.3", "network.host=silent", f"network.radio.latency_s={latency_s}"
    live, script = world_of("fig6", *settings), []
    for seq in range(4):
        live.run_to((seq + 1) * PERIOD)
        data = encode(TeamFrame(0, seq, ((1, 2),) * 3), 3)
        script.append(Transmission(live.inject(data), ">", data))
    scripted = world_of("fig6", *settings, script=script)
    for world in (live, scripted):
        world.run_to(8 * PERIOD)
    assert live.digest == scripted.digest


def test_a_robot_hears_an_injected_frame():
    world = silent()
    tick = world.inject(FRAME)
    event = world.run_until(wait.Frame(), within=PERIOD)
    assert event.frame.message(3).velocities[0] == (100, 100)
    assert tick + len(FRAME) * HOST_CHARACTER_TICKS > event.tick > tick + 22 * HOST_CHARACTER_TICKS


def test_the_earliest_tick_is_kept_and_the_one_before_refused():
    world = silent()
    world.run_to(1_000_000)
    earliest = world.earliest_tick()
    assert earliest == 1_000_000 + 120 + KEYUP_TICKS
    with pytest.raises(
        ValueError, match=f"net0: tick {earliest - 1} is out of range; the earliest is {earliest}"
    ):
        world.inject(FRAME, at_tick=earliest - 1)
    assert world.inject(FRAME, at_tick=earliest) == earliest


@pytest.mark.parametrize("tick", [2_073_600_000_001, 1 << 62, 1 << 63, 10**30, -1, -(1 << 63)])
def test_a_tick_before_the_start_or_after_a_day_is_refused_with_the_range(tick):
    within = "the earliest is 24120, the latest 2073600000000"
    with pytest.raises(ValueError, match=f"net0: tick {tick} is out of range; {within}"):
        silent().inject(FRAME, at_tick=tick)


@pytest.mark.parametrize("tick", [True, False, 1e6, float("nan"), "1000000"])
def test_what_is_no_whole_number_is_no_tick(tick):
    for act in (lambda: silent().inject(FRAME, at_tick=tick), lambda: silent().run_to(tick)):
        with pytest.raises(ValueError, match="is no whole number of ticks"):
            act()


def test_without_a_tick_characters_queue_behind_each_other():
    world = silent()
    first = world.inject(b"\x55\x55")
    assert world.inject(b"\x55") == first + 2 * HOST_CHARACTER_TICKS
    assert world.inject(b"\x55") == first + 3 * HOST_CHARACTER_TICKS


def test_a_transmission_over_another_one_is_refused():
    world = silent()
    world.inject(FRAME, at_tick=100_000)
    busy = 100_000 + len(FRAME) * HOST_CHARACTER_TICKS
    with pytest.raises(ValueError, match=f"the transmitter is busy from tick 100000 to {busy}"):
        world.inject(b"\x00", at_tick=busy - 1)
    world.run_to(150_000)
    with pytest.raises(ValueError, match=f"busy until tick {busy}"):
        world.inject(b"\x00", at_tick=busy - 1)
    assert world.inject(b"\x00", at_tick=busy) == busy


def test_a_frame_of_the_station_that_meets_a_busy_transmitter_is_dropped_and_counted():
    world = fig6()
    world.inject(b"\x55" * 4, at_tick=90_000)
    world.step()
    assert world.networks[0].outbox.dropped == 1
    assert [run.data for run in world.last.wire if run.direction == ">"] == [b"\x55" * 4]
    world.step()
    assert world.networks[0].outbox.dropped == 1


def test_an_injection_into_a_frame_of_the_station_is_refused():
    world = fig6()
    world.run_to(1000)
    with pytest.raises(ValueError, match="the transmitter is busy from tick 96000"):
        world.inject(b"\x55", at_tick=97_000)


@pytest.mark.parametrize(("place", "indices"), [(8, (8,)), (22, [22])])
def test_a_frame_with_a_bad_stop_bit_is_recorded_as_sent_and_refused_by_the_robot(place, indices):
    world = silent()
    tick = world.inject(FRAME, at_tick=100_000, bad_stop=indices)
    world.run_to(tick + place * HOST_CHARACTER_TICKS)
    event = world.run_until(wait.Received(byte=FRAME[place]), within=2 * HOST_CHARACTER_TICKS)
    while event.tick < tick + place * HOST_CHARACTER_TICKS:
        event = world.run_until(wait.Received(byte=FRAME[place]), within=2 * HOST_CHARACTER_TICKS)
    assert not event.good_stop
    second = world.inject(FRAME, at_tick=2 * PERIOD)
    world.run_to(4 * PERIOD)
    assert world.robot().counter(0) == 1
    sent = [Transmission(tick, ">", FRAME, 0, (place,)), Transmission(second, ">", FRAME)]
    scripted = two_networks(script=sent)
    wire = [one for _ in range(4) for one in scripted.step().wire if one.direction == ">"]
    assert wire == sent
    assert scripted.robot().counter(0) == 1


def test_bad_stop_bits_that_wait_or_are_on_the_air_are_saved():
    straight, cut = silent(), silent()
    for world in (straight, cut):
        world.inject(FRAME, at_tick=100_000, bad_stop=(0, 9))
        world.inject(FRAME, at_tick=3 * PERIOD, bad_stop=(22,))
        world.run_to(300_000)
    other = silent()
    other.load(cut.save())
    for world in (straight, other):
        world.run_to(5 * PERIOD)
    assert other.digest == straight.digest
    assert other.networks[0].frames_sent == 2


def test_a_bad_stop_bit_is_part_of_the_digest():
    digests = set()
    for bad_stop in ((), (3,), (4,)):
        world = silent()
        world.inject(FRAME, at_tick=PERIOD - 100_000, bad_stop=bad_stop)
        world.step()
        digests.add(world.digest)
    assert len(digests) == 3


@pytest.mark.parametrize("bad_stop", [(23,), (-1,), (2, 1)])
def test_a_bad_stop_bit_of_no_character_is_refused(bad_stop):
    with pytest.raises(
        ValueError, match=r"net0: bad_stop holds .*: must be ascending indices of 23 characters"
    ):
        silent().inject(FRAME, bad_stop=bad_stop)


@pytest.mark.parametrize(
    ("sent", "what"),
    [
        (Transmission(5, "<", b"a"), "tick 5: no host sends '<'; give '>'"),
        (Transmission(5, ">", b"a", 2), "tick 5: network 2 does not exist; there are 2, numbered from 0"),
        (Transmission(5, ">", b"a", 0, (1,)), "must be ascending indices of 1 characters"),
    ],
)
def test_a_script_that_no_host_can_send_is_refused(sent, what):
    with pytest.raises(ValueError, match=what):
        two_networks(script=[sent])


@pytest.mark.parametrize("network", [-1, 2])
def test_a_network_that_is_not_there_is_refused(network):
    with pytest.raises(ValueError, match=f"network {network} does not exist; there are 2, numbered from 0"):
        silent().inject(FRAME, network)


@pytest.mark.parametrize("data", [b"", bytes((1 << 20) + 1)])
def test_no_characters_or_too_many_are_refused(data):
    with pytest.raises(ValueError, match=f"net0: {len(data)} characters; give 1 to 1048576"):
        silent().inject(data)


def test_what_waits_to_be_sent_is_saved_but_not_part_of_the_digest():
    world = silent()
    world.step()
    world.inject(FRAME, at_tick=3 * PERIOD)
    other = silent()
    other.load(world.save())
    other.step()
    without = silent()
    without.step()
    without.step()
    assert other.digest == without.digest
    other.run_to(5 * PERIOD)
    world.run_to(5 * PERIOD)
    assert other.digest == world.digest
    assert other.networks[0].frames_sent == 1


def test_runs_that_are_cut_anywhere_and_told_at_any_moment_have_the_digest_of_the_run_in_one_piece():
    assert differing(250, 1, image(), lambda done: None) == []


@settings(max_examples=3)
@given(st.integers(0, 20_000_000), st.integers(0, 1000))
def test_going_on_from_a_world_saved_at_any_tick_equals_not_stopping(first_tick, seed):
    assert differing_ticks(first_tick, 40, seed, image()) == []
