"""A live session in this process, under a wall clock that stands where the test puts it, and the radio's port."""

import time

import pytest

from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, ticks
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import live_scenario, source_text
from miro_sim.world.world import World
from mirotwin.ports.endpoint import ByteFifo, Endpoint, PortContext
from mirotwin.ports.radio_port import TRANSMIT_CHARACTERS, RadioPort
from mirotwin.ports.session import Session
from mirotwin.ports.sockets import TcpEndpoint
from mirotwin.runs.job import script_of
from tests.mirotwin.ports.rig import NO_SELECTOR, FakePace, Rig, own_image, question


class Scripted(Endpoint):
    """A port whose client sends `data` at once as soon as the world is at `tick`, and reads everything."""

    kind = "scripted"

    def __init__(self, context, sends):
        super().__init__(context, "here")
        self.sends = sends
        self.got = b""
        self.has_come("a test")

    def receive(self):
        if self.sends and self.port.world.tick >= self.sends[0][0]:
            return self.sends.pop(0)[1]
        return b""

    def push(self):
        self.got += self.out.take(len(self.out))


def session_of(*sends, ports=1, **more):
    scenario = live_scenario("fig6", ("network.radio.bit_error_rate=0",)).scenario
    world = World(scenario, 1, own_image())
    told = []
    context = PortContext(RadioPort(world), NO_SELECTOR, told.append)
    found = [Scripted(context, list(sends) if index == 0 else []) for index in range(ports)]
    session = Session(
        world, FakePace(1.0), NO_SELECTOR, found, told.append, **{"end_tick": ticks(0.5), **more}
    )
    return session, found, told


def test_a_session_ends_with_the_period_in_which_its_duration_does_and_replays_to_its_digests():
    session, (client,), _ = session_of((ticks(0.05), question(0)), (ticks(0.2), question(3)))
    session.pace.per_look = ticks(0.0007)
    periods = []
    session.world.observers.append(periods.append)
    session.run()
    assert session.world.tick == 15 * CONTROL_PERIOD_TICKS >= ticks(0.5)
    assert len(client.got) == 2 * 19
    script = script_of(periods)
    assert [one.data for one in script] == [question(0), question(3)]
    again = World(session.world.scenario, 1, own_image(), script=script)
    assert [again.step().digest for _ in periods] == [period.digest for period in periods]


def test_what_is_sent_goes_on_the_air_where_the_world_stands_when_it_arrives():
    session, _, _ = session_of((ticks(0.1), question(0)))
    session.pace.per_look = ticks(0.0003)
    periods = []
    session.world.observers.append(periods.append)
    session.run()
    (sent,) = script_of(periods)
    assert ticks(0.101) <= sent.tick < ticks(0.101 + 0.002) + 121 + 1  # at most a slice later, and the key-up


def test_what_arrives_while_the_world_is_behind_goes_on_the_air_when_it_arrived():
    session, (client,), _ = session_of()
    session.pace.per_look = ticks(0.0001)
    session.run_to(ticks(0.105))
    arrived = session.pace.now = ticks(0.120)
    client.sends = [(0, question(0))]
    periods = []
    session.world.observers.append(periods.append)
    session.run()
    (sent,) = script_of(periods)
    assert arrived <= sent.tick < arrived + ticks(0.002)


def test_in_a_world_that_is_far_behind_what_arrives_goes_on_the_air_where_its_control_period_ends():
    session, (client,), _ = session_of()
    session.pace.per_look = ticks(0.1)
    session.run_to(ticks(0.105))
    client.sends = [(0, question(0))]
    periods = []
    session.world.observers.append(periods.append)
    session.run()
    (sent,) = script_of(periods)
    assert 0 <= sent.tick - 4 * CONTROL_PERIOD_TICKS < ticks(0.002)


def test_the_last_frame_of_a_client_that_reads_no_answer_is_on_the_air():
    rig = Rig()
    port, client = rig.connected(TcpEndpoint)
    port.out.add(b"an answer")
    port.push()
    client.sendall(question(0))
    client.close()  # with something unread: whoever writes to it now is refused
    port.out.add(b"another")
    session = Session(rig.world, FakePace(1.0), NO_SELECTOR, [port], rig.told.append, ticks(0.1))
    session.pace.per_look = ticks(0.001)
    session.run()
    rig.close()
    assert (port.bytes_in, rig.world.networks[0].frames_sent) == (23, 1)


def test_all_ports_of_a_network_hear_its_robots():
    session, clients, _ = session_of((0, question(0)), ports=3)
    session.pace.per_look = ticks(0.001)
    session.run()
    assert len(clients[0].got) == 19
    assert clients[0].got == clients[1].got == clients[2].got


def test_a_world_that_is_behind_catches_up_without_skipping_and_says_by_how_much():
    session, _, told = session_of()
    session.pace.per_look = ticks(0.000125)
    session.run_to(ticks(0.1))
    assert session.live().late_max_ms < 3
    session.pace.now += ticks(0.25)
    session.run_to(ticks(0.8))  # a slice of 0.5 ms takes 0.25 ms: after 0.46 s it is 20 ms after
    live = session.live()
    assert 240 < live.late_max_ms < 260
    assert 0.44 < live.late_s < 0.48
    assert [line.partition(": ")[2] for line in told[1:]] == ["250 ms behind the wall clock"]
    assert session.world.tick == ticks(0.8)


def test_once_ends_it_when_the_last_client_has_gone():
    session, (client, other), _ = session_of(ports=2, once=True)
    session.pace.per_look = ticks(0.001)
    session.run_to(session.world.period_end)
    client.has_gone()
    session.run_to(session.world.period_end)
    assert not session.finished
    other.port.send(question(0))
    other.has_gone()
    assert not session.finished  # what it sent is still under way
    session.run_to(session.world.period_end)
    assert session.finished


def test_a_full_buffer_drops_what_comes_in_and_counts_it():
    buffer = ByteFifo(10)
    buffer.add(b"abcdefgh")
    buffer.add(b"ijkl")
    assert (bytes(buffer.data), buffer.dropped) == (b"abcdefghij", 2)
    assert buffer.take(4) == b"abcd"
    buffer.add(b"mnop")
    assert (bytes(buffer.data), buffer.dropped) == (b"efghijmnop", 2)


@pytest.mark.parametrize("reads", [True, False])
def test_a_client_that_does_not_read_loses_what_comes_when_its_buffer_is_full(reads):
    _, (client,), told = session_of()
    client.out = ByteFifo(16)
    for _ in range(4):
        client.deliver(b"12345678")
        if reads:
            client.push()
    client.has_gone()
    assert client.plug().dropped == (0 if reads else 32)
    assert any("does not read; 16 bytes wait, more are dropped" in line for line in told) is not reads


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


class Looked:
    """What waits in an outbox; counts how often it is looked at."""

    looks = 0

    def __init__(self, sent):
        self._sent = sent

    @property
    def sent(self):
        Looked.looks += 1
        return self._sent


@pytest.mark.parametrize("waiting", [1, 100, TRANSMIT_CHARACTERS])
def test_room_is_found_by_a_look_at_the_last_character_that_waits(waiting):
    """A client that never pauses fills the buffer with single characters, and every loop asks several times."""
    world = World(live_world().scenario, 1, own_image())
    port, outbox = RadioPort(world), world.networks[0].outbox
    outbox.waiting = [
        Looked(Transmission(place * HOST_CHARACTER_TICKS, DOWN, b"U")) for place in range(waiting)
    ]
    before = Looked.looks
    assert (port.waiting, port.room) == (waiting, TRANSMIT_CHARACTERS - waiting)
    assert Looked.looks - before == 2


def test_the_transmitter_is_free_when_the_last_of_what_waits_has_been_sent():
    world = World(live_world().scenario, 1, own_image())
    outbox = world.networks[0].outbox
    assert outbox.end_tick(700) == 700
    for tick, data in ((9_000_000, b"abc"), (3_000_000, b"d"), (6_000_000, b"ef")):
        world.inject(data, at_tick=tick)
    assert outbox.end_tick(700) == 9_000_000 + 3 * HOST_CHARACTER_TICKS
    assert outbox.end_tick(10_000_000) == 10_000_000
