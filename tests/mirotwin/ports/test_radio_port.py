"""The radio's port in virtual time: when bytes go on the air, and that a replay gives the same digests."""

import time

import pytest

from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, ticks
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import live_scenario, source_text
from miro_sim.world.world import World
from mirotwin.ports.radio_port import TRANSMIT_CHARACTERS, RadioPort
from mirotwin.rerun.job import script_of
from tests.mirotwin.ports.rig import own_image, question


def live_world(*settings, scenario="fig6"):
    return World(live_scenario(scenario, settings).scenario, 1, own_image())


@pytest.mark.parametrize("latency_s", [0.0, 0.005])
@pytest.mark.parametrize("off_ticks", [-121, -1, 0, 1, 120, 24_000, 119_999, 120_000, 400_000])
def test_what_is_sent_at_any_tick_replays_to_the_same_digests(latency_s, off_ticks):
    world = live_world(f"network.radio.latency_s={latency_s}")
    periods = []
    world.observers.append(periods.append)
    world.run_to(2 * CONTROL_PERIOD_TICKS + off_ticks)
    RadioPort(world).send(question(0))
    world.run_to(5 * CONTROL_PERIOD_TICKS)
    again = World(world.scenario, 1, own_image(), script=script_of(periods))
    assert [again.step().digest for _ in periods] == [period.digest for period in periods]
    assert len(script_of(periods)) == 1


def test_bytes_queue_behind_each_other_and_the_buffer_has_room_for_4096():
    world = live_world()
    port = RadioPort(world)
    assert (port.waiting, port.room) == (0, TRANSMIT_CHARACTERS)
    first = port.send(b"a" * 10)
    second = port.send(b"b" * (TRANSMIT_CHARACTERS - 12))
    assert second - first == 10 * HOST_CHARACTER_TICKS
    assert port.room == 1  # key-up takes the time of a character
    world.run_to(port.free_tick)
    assert (port.waiting, port.room) == (0, TRANSMIT_CHARACTERS)


def test_purging_takes_back_what_has_not_begun():
    world = live_world()
    port = RadioPort(world)
    port.send(b"a" * 10)
    world.run_to(ticks(0.005))
    port.send(b"b" * 100)
    port.purge()
    assert 0 < port.waiting <= 10
    world.run_to(ticks(0.2))
    assert world.networks[0].frames_sent == 1


def test_what_the_pc_hears_is_given_once():
    world = live_world("network.radio.bit_error_rate=0")
    port = RadioPort(world)
    port.send(question(0))
    world.run_to(ticks(0.1))
    answer = port.received()
    assert (len(answer), answer[:4]) == (19, b"\x55" * 4)
    assert port.received() == b""


@pytest.mark.parametrize(
    "scenario", ["fig6", "fig7", "fig8", "fig9", "fig10", "curve", "line", "sine", "waypoints"]
)
def test_every_scenario_that_comes_with_the_package_can_be_lived_in_for_a_day(scenario):
    world = live_world(scenario=scenario)
    assert world.scenario.duration_s == 86_400.0
    assert {network.host for network in world.networks} == {"silent"}
    for network in world.networks:
        assert RadioPort(world, network.index).waiting == 0


def test_a_scenario_with_steps_is_refused(tmp_path):
    path = tmp_path / "steps.toml"
    path.write_text(source_text("fig6") + '\n[[step]]\nradio = "down"\n')
    with pytest.raises(
        ScenarioError, match="step: a live session does no steps; run them by `mirotwin test`"
    ):
        live_scenario(str(path))


def test_what_was_sent_in_an_hour_is_announced_within_seconds():
    sent = [Transmission(100_000 + index * 1_000_000, DOWN, b"x") for index in range(80_000)]
    begun_s = time.process_time()
    world = World(live_world().scenario, 1, own_image(), script=sent)
    assert time.process_time() - begun_s < 10  # it was minutes, when each was compared with all before
    assert [one.sent for one in world.networks[0].outbox.waiting] == sent
