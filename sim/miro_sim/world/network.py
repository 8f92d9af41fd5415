"""One radio network: a host station, the air both ways, and the robots that share the frequency."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

from miro_exact.clock import ticks
from miro_exact.rng import Stream
from miro_exact.state import TICK
from miro_host.pilot import WheelCommand
from miro_host.station import Station
from miro_host.telemetry_receiver import TelemetryReceiver
from miro_host.wheels import Wheels, wheel_command
from miro_protocol.actions import Action, RadioState, ScriptItem
from miro_protocol.decoder import Received
from miro_protocol.transmission import DOWN, UP, Transmission, check_bad_stop, of_symbols
from miro_robot.image import Image
from miro_robot.mcs51.cpu import STOPPED
from miro_sim.radio.downlink import Downlink
from miro_sim.radio.params import LINK_STATES
from miro_sim.radio.uplink import Uplink
from miro_sim.scenario import keys as sc
from miro_sim.world.actions import SETTLE_TICKS
from miro_sim.world.events import HostLog
from miro_sim.world.medium import LONGEST_TRANSMISSION_TICKS, Medium, sent_to
from miro_sim.world.outbox import Outbox
from miro_sim.world.robot import Robot
from miro_sim.world.sight import PixelSight, Sight, sight_of


class Network(Medium):
    """Station, radio and robots of one frequency. `script` replaces what the station would send.

    `host` is who sends: the PC's "controller", once a control period; a "script"; "silent", only who injects.
    """

    STATE = {
        "sight": Sight,
        "station": Station,
        "downlink": Downlink,
        "uplink": Uplink,
        "telemetry": TelemetryReceiver,
        "frames_sent": TICK,
    }
    NOT_STATE = ("spec", "compute_ticks", "draws")

    def __init__(
        self,
        spec: sc.NetworkSpec,
        scenario: sc.Scenario,
        index: int,
        seed: int,
        image: Image,
        script: Sequence[Transmission] | None,
    ) -> None:
        robots = [
            Robot(robot, scenario, index, spec.robots, seed, image)
            # The order in the file must not change a bit: all loops over robots follow this one.
            for robot in sorted(spec.robot, key=lambda robot: robot.slot)
        ]
        radio = spec.radio
        self.spec = spec
        self.compute_ticks = ticks(scenario.host.compute_s)
        self.sight: Sight = sight_of(scenario.camera, robots, seed)
        self.draws = [Stream(seed, f"net{index}/robot{robot.slot}/control") for robot in robots]
        self.station = Station(spec.robots, telemetry=radio.telemetry)
        self.downlink = Downlink(radio, seed, f"net{index}/down")
        self.uplink = Uplink(radio, seed, f"net{index}/up")
        for robot in robots:
            self.downlink.listen(robot.spec.slot, robot.board.cpu.rxd)
            self.uplink.band.add(robot.spec.slot, robot.board.cpu.txd)
        self.telemetry = TelemetryReceiver(spec.robots)
        self.frames_sent = 0
        Medium.__init__(
            self,
            index,
            "script" if script is not None else spec.host,
            robots,
            # A carrier that is always on needs no time to come up.
            Outbox(0 if radio.carrier == "on" else radio.keyup_ticks, index),
            HostLog(index, self.uplink.known_tick, spec.robots),
            self.downlink.sender.latency,
        )
        for sent in script or ():
            check_bad_stop(sent.bad_stop, len(sent.data))
            self.outbox.inject(sent, 0)

    @property
    def robots(self) -> list[Robot]:
        """By slot."""
        return self.devices

    def robot(self, slot: int) -> Robot:
        """The robot in `slot`. Raises ValueError where there is none."""
        robot = self.device(slot)
        assert isinstance(robot, Robot)
        return robot

    def begin_period(self, tick: int) -> None:
        """Camera, PC and station, in this order."""
        # All robots before any pilot computes: they are on one picture.
        measured = self.sight.expose(tick)
        self.sent = []
        steered = self.host == "controller"
        commands: list[WheelCommand | None] = []
        for place, robot in enumerate(self.devices):
            answer = self.telemetry.last[robot.slot]
            commands.append(robot.steer(measured[place], answer, tick) if steered else None)
        if steered:
            self._transmit(tick + self.compute_ticks + self.outbox.lead_ticks, commands)
        self.seen = []
        for place, robot in enumerate(self.devices):
            self.seen.append(robot.record(tick, measured[place], commands[place]))

    def _transmit(self, start_tick: int, commands: Sequence[WheelCommand | None]) -> None:
        wheels = [(0, 0)] * self.spec.robots
        for place, robot in enumerate(self.devices):
            command = commands[place]
            if command is not None:
                bounds, draws = self.spec.control_noise, self.draws[place]
                wheels[robot.slot] = noisy(command, bounds, robot.pilot.wheels, draws, self.sight.frame)
        sent = Transmission(start_tick, DOWN, self.station.frame(wheels), self.index)
        self.outbox.post(sent, self.downlink.free_tick)

    def send(self, sent: Transmission) -> None:
        self.downlink.send(sent.tick, sent.data, sent.bad_stop)
        self.frames_sent += 1

    def settle(self, rendezvous_tick: int) -> None:
        """All networks have sent: the line is known up to where the robots stop next."""
        # Further than the stop: the last instruction before it may read RXD some cycles later.
        self.downlink.settle(rendezvous_tick + SETTLE_TICKS)

    def free_tick(self) -> int:
        return self.downlink.free_tick

    def run(self, tick: int) -> bool:
        """Runs every robot to `tick`, one after the other; true when a firmware fault stopped one.

        A robot stops where more than 2048 edges of its TXD wait. When all robots are there or at `tick`, the PC hears
        what came before the first 2048th edge, and those that have stopped go on. That tick depends on the wires'
        content alone, so the PC hears the same however the run is cut.
        """
        while True:
            stopped = False
            for robot in self.devices:
                stopped = robot.run(tick) == STOPPED or stopped
            if stopped:
                return True
            full_tick = self.uplink.band.full_tick()
            if full_tick >= tick:
                return False
            self.hear(full_tick)

    def hear(self, tick: int) -> None:
        """The PC's receiver hears what the robots sent up to `tick`."""
        received = self.uplink.receive(tick)
        if not received:
            return
        # Characters first: the answer is an event right after its last one.
        self.log.note_heard(received)
        for frame in self.telemetry.receive(received):
            if isinstance(frame, Received):
                self.log.note(frame)
        self.heard += received

    def end_period(self) -> list[Transmission]:
        """The host's transmissions and receptions in the period that has ended."""
        transmissions = [*self.sent, *of_symbols(self.heard, UP, self.index)]
        self.heard = []
        return transmissions

    def check_action(self, action: Action) -> None:
        if not isinstance(action, RadioState):
            Medium.check_action(self, action)
        elif action.state not in LINK_STATES:
            raise ValueError(f"net{self.index}: a radio {action.state!r}; give {', '.join(LINK_STATES)}")

    def set_radio(self, state: int, up: bool) -> None:
        if up:
            self.uplink.band.link_state = state
            return
        for listener in self.downlink.listeners.values():
            listener.link_state = state

    def reseed(self, seed: int, tick: int, up: bool) -> None:
        if not up:
            self.downlink.reseed(seed, tick)
            return
        self.uplink.band.reseed(seed, tick)
        self.sight.reseed(seed)
        for stream in (*self.draws, *(robot.noise for robot in self.robots)):
            stream.reseed(seed)

    def set_rxd(self, slot: int, state: int) -> None:
        self.downlink.listeners[slot].rxd_state = state

    @property
    def bit_errors(self) -> int:
        """Bits inverted by the radio so far, down at every listener and up."""
        down = 0
        for listener in self.downlink.listeners.values():
            down += listener.bit_errors
        return down + self.uplink.bit_errors

    def link_counts(self) -> tuple[int, int]:
        return self.frames_sent, self.bit_errors

    def vision_counts(self) -> dict[str, int]:
        return self.sight.counts()

    def check_times(self, earliest_tick: int, tick: int) -> None:
        settled_tick = self.downlink.settled_tick
        # At tick 0 nothing has been settled yet.
        if settled_tick != tick + SETTLE_TICKS and settled_tick + tick != 0:
            raise ValueError(f"the radio is settled up to tick {settled_tick}, at tick {tick}")
        if not earliest_tick <= self.uplink.now <= tick:
            raise ValueError(f"the PC has heard everything up to tick {self.uplink.now}, at tick {tick}")
        if self.downlink.busy_tick > tick + LONGEST_TRANSMISSION_TICKS:
            raise ValueError(f"the transmitter is busy until tick {self.downlink.free_tick}, at tick {tick}")
        Medium.check_times(self, earliest_tick, tick)
        if any(answer is not None and answer.tick > tick for answer in self.telemetry.last):
            raise ValueError(f"a robot's last answer came after tick {tick}")
        self.check_rxd(settled_tick)


def networks_of(
    scenario: sc.Scenario, seed: int, image: Image, script: Sequence[ScriptItem] | None
) -> list[Network]:
    """The networks of a scenario. Networks on one frequency hear each other; a picture shows all robots."""
    networks = [
        Network(spec, scenario, index, seed, image, sent_to(index, script))
        for index, spec in enumerate(scenario.networks)
    ]
    for listener, neighbour in permutations(networks, 2):
        if (
            listener.spec.radio.channel is not None
            and listener.spec.radio.channel == neighbour.spec.radio.channel
        ):
            listener.downlink.overhear(neighbour.downlink)
    for network in networks:
        if isinstance(network.sight, PixelSight):
            # Only here all of them exist: robots of the other network are in the picture, too.
            network.sight.everyone = [robot for each in networks for robot in each.robots]
    return networks


def noisy(
    command: WheelCommand, bounds: sc.ControlNoise, wheels: Wheels, draws: Stream, period: int
) -> tuple[int, int]:
    """(left, right) in 1/256 count per sample: what the paper's analogue link added to a command (Yang & Kim, section
    V-A, disturbance 2), where that signal had it: after controller and integrator, before the frame and its CRC.

    Chosen, because the paper gives neither bounds nor distribution: v and w of every robot get a draw each, once a
    control period, uniform within +- the bound and independent. Wheel limits and rounding follow.
    """
    if bounds.v_m_s == 0.0 and bounds.w_rad_s == 0.0:
        return command.left, command.right
    v_m_s = command.v_m_s + bounds.v_m_s * (2.0 * draws.uniform(2 * period) - 1.0)
    w_rad_s = command.w_rad_s + bounds.w_rad_s * (2.0 * draws.uniform(2 * period + 1) - 1.0)
    return wheel_command(wheels, v_m_s, w_rad_s, command.left_factor, command.right_factor)
