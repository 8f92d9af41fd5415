"""One radio network: a host station, the air both ways, and the robots that share the frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from miro_exact.clock import CONTROL_PERIOD_TICKS, CYCLE_TICKS, ticks
from miro_exact.rng import Stream
from miro_exact.state import TICK, Rows
from miro_host.pilot import WheelCommand
from miro_host.station import Station
from miro_host.telemetry_receiver import TelemetryReceiver
from miro_host.wheels import Wheels, wheel_command
from miro_protocol.decoder import Received, Symbol
from miro_protocol.transmission import DOWN, UP, Transmission, check_bad_stop, of_symbols
from miro_robot.image import Image
from miro_robot.mcs51.cpu import STOPPED
from miro_sim.periods import RobotPeriod
from miro_sim.radio.downlink import Downlink
from miro_sim.radio.uplink import Uplink
from miro_sim.scenario import keys as sc
from miro_sim.world.actions import SETTLE_TICKS, Actions
from miro_sim.world.events import HostLog
from miro_sim.world.outbox import LATEST_TICK, LONGEST_BYTES, Outbox
from miro_sim.world.robot import Robot
from miro_sim.world.sight import Sight, sight_of

LONGEST_TRANSMISSION_TICKS = 1 << 40
"""Twelve hours: no saved transmission ends later than so long after now."""


class Network:
    """Station, radio and robots of one frequency. `script` replaces what the station would send.

    `host` is who sends: the PC's "controller", once a control period; a "script"; "silent", only who injects.
    """

    STATE = {
        "robots": [Robot],
        "sight": Sight,
        "station": Station,
        "downlink": Downlink,
        "uplink": Uplink,
        "telemetry": TelemetryReceiver,
        "frames_sent": TICK,
        "outbox": Outbox,
        "actions": Actions,
        "heard": Rows(1 << 20, "B", "?", TICK),
    }
    NOT_HASHED = ("outbox", "actions", "heard")
    """They depend on when input was announced and where the world stopped."""
    NOT_STATE = (
        *("spec", "index", "host", "compute_ticks", "draws"),
        *("sent", "seen", "log"),  # records
    )

    def __init__(
        self,
        spec: sc.NetworkSpec,
        scenario: sc.Scenario,
        index: int,
        seed: int,
        image: Image,
        script: Sequence[Transmission] | None,
    ) -> None:
        self.spec = spec
        self.index = index
        self.compute_ticks = ticks(scenario.host.compute_s)
        self.robots = [
            Robot(robot, scenario, index, spec.robots, seed, image)
            for robot in sorted(spec.robot, key=lambda robot: robot.slot)
        ]
        self.sight: Sight = sight_of(scenario.camera, self.robots, seed)
        self.draws = [Stream(seed, f"net{index}/robot{robot.slot}/control") for robot in self.robots]
        self.station = Station(spec.robots, telemetry=spec.radio.telemetry)
        radio = spec.radio
        self.downlink = Downlink(radio, seed, f"net{index}/down")
        self.uplink = Uplink(radio, seed, f"net{index}/up")
        for robot in self.robots:
            self.downlink.listen(robot.spec.slot, robot.board.cpu.rxd)
            self.uplink.band.add(robot.spec.slot, robot.board.cpu.txd)
        self.telemetry = TelemetryReceiver(spec.robots)
        self.host: str = "script" if script is not None else spec.host
        self.actions = Actions(index)
        self.outbox = Outbox(0 if radio.carrier == "on" else radio.keyup_ticks, index)
        for sent in script or ():
            check_bad_stop(sent.bad_stop, len(sent.data))
            self.outbox.inject(sent, 0)
        self.frames_sent = 0
        self.heard: list[Symbol] = []  # in this period so far
        self.sent: list[Transmission] = []
        self.seen: list[RobotPeriod] = []
        self.log = HostLog(index, self.uplink.known_tick, spec.robots)

    def begin_period(self, tick: int) -> None:
        """Camera, PC and station, in this order."""
        measured = self.sight.expose(tick)
        self.sent = []
        steered = self.host == "controller"
        commands: list[WheelCommand | None] = []
        for place, robot in enumerate(self.robots):
            answer = self.telemetry.last[robot.slot]
            commands.append(robot.steer(measured[place], answer, tick) if steered else None)
        if steered:
            self._transmit(tick + self.compute_ticks + self.outbox.lead_ticks, commands)
        self.seen = []
        for place, robot in enumerate(self.robots):
            self.seen.append(robot.record(tick, measured[place], commands[place]))

    def robot(self, slot: int) -> Robot:
        """The robot in `slot`. Raises ValueError where there is none."""
        for robot in self.robots:
            if robot.spec.slot == slot:
                return robot
        there = ", ".join(str(robot.spec.slot) for robot in self.robots)
        raise ValueError(f"net{self.index} has no robot in slot {slot}; there is {there}")

    def send_due(self, rendezvous_tick: int) -> None:
        """Puts on the air what may come up before the tick up to which it is settled next, and nothing else: what may
        still be announced at the rendezvous is not in the state there, whenever it was announced.
        """
        for sent in self.outbox.due(rendezvous_tick + SETTLE_TICKS - self.downlink.sender.latency):
            self.downlink.send(sent.tick, sent.data, sent.bad_stop)
            self.frames_sent += 1
            self.sent.append(sent)
            self.log.note(sent)

    def settle(self, rendezvous_tick: int) -> None:
        """All networks have sent: the line is known up to where the robots stop next."""
        self.downlink.settle(rendezvous_tick + SETTLE_TICKS)

    def earliest_tick(self, now: int) -> int:
        """The earliest first start bit of characters that are injected at tick `now`."""
        return max(0, now + SETTLE_TICKS + self.outbox.lead_ticks - self.downlink.sender.latency)

    def inject(self, data: bytes, at_tick: int | None, now: int, bad_stop: tuple[int, ...]) -> int:
        """See `World.inject`."""
        earliest = self.earliest_tick(now)
        if not 0 < len(data) <= LONGEST_BYTES:
            raise ValueError(f"net{self.index}: {len(data)} characters; give 1 to {LONGEST_BYTES}")
        if at_tick is not None and not earliest <= at_tick <= LATEST_TICK:
            limits = f"the earliest is {earliest}, the latest {LATEST_TICK} (a day)"
            raise ValueError(f"net{self.index}: tick {at_tick} is out of range; {limits}")
        free_tick = self.downlink.free_tick
        tick = max(earliest, self.outbox.end_tick(free_tick)) if at_tick is None else at_tick
        try:
            check_bad_stop(bad_stop, len(data))
            self.outbox.inject(Transmission(tick, DOWN, bytes(data), self.index, bad_stop), free_tick)
        except ValueError as error:
            raise ValueError(f"net{self.index}: {error}") from None
        return tick

    def _transmit(self, start_tick: int, commands: Sequence[WheelCommand | None]) -> None:
        wheels = [(0, 0)] * self.spec.robots
        for place, robot in enumerate(self.robots):
            command = commands[place]
            if command is not None:
                bounds, draws = self.spec.control_noise, self.draws[place]
                wheels[robot.slot] = noisy(command, bounds, robot.pilot.wheels, draws, self.sight.frame)
        sent = Transmission(start_tick, DOWN, self.station.frame(wheels), self.index)
        self.outbox.post(sent, self.downlink.free_tick)

    def run(self, tick: int) -> bool:
        """Runs every robot to `tick`, one after the other; true when a firmware fault stopped one.

        A robot stops where more than 2048 edges of its TXD wait. When all robots are there or at `tick`, the PC hears
        what came before the first 2048th edge, and those that have stopped go on. That tick depends on the wires'
        content alone, so the PC hears the same however the run is cut.
        """
        while True:
            stopped = False
            for robot in self.robots:
                stopped = robot.run(tick) == STOPPED or stopped
            if stopped:
                return True
            full_tick = self.uplink.band.full_tick()
            if full_tick >= tick:
                return False
            self.hear(full_tick)

    def hear(self, tick: int) -> None:
        """The PC's receiver hears what the robots sent up to `tick`."""
        heard = self.uplink.receive(tick)
        if not heard:
            return
        self.log.note_heard(heard)
        for found in self.telemetry.receive(heard):
            if isinstance(found, Received):
                self.log.note(found)
        self.heard += heard

    def end_period(self) -> list[Transmission]:
        """What the host sent and what it heard in the period that is over."""
        found = [*self.sent, *of_symbols(self.heard, UP, self.index)]
        self.heard = []
        return found

    @property
    def bit_errors(self) -> int:
        """Bits that the radio turned over so far, down at every listener and up."""
        down = 0
        for listener in self.downlink.listeners.values():
            down += listener.bit_errors
        return down + self.uplink.bit_errors

    def records(self) -> list[Any]:
        """What observers take away and no snapshot holds, to go back to with `put_back`."""
        boards = [robot.board for robot in self.robots]
        return [
            list(self.sent),
            list(self.actions.done),
            self.log.end,
            [(list(b.left.commands), list(b.right.commands), list(b.faults), b.log.end) for b in boards],
        ]

    def put_back(self, records: list[Any]) -> None:
        """Takes back what `records` gave; nothing but more of the same may have happened since."""
        sent, done, log_end, boards = records
        self.sent = list(sent)
        self.actions.done = list(done)
        self.log.cut(log_end)
        for robot, (left, right, faults, end) in zip(self.robots, boards, strict=True):
            robot.board.left.commands[:] = left
            robot.board.right.commands[:] = right
            robot.board.faults[:] = faults
            robot.board.log.cut(end)

    def check_times(self, begun_tick: int, tick: int) -> None:
        """Raises ValueError unless the restored parts are at `tick`, in the period that began at `begun_tick`.

        A part that is far behind would need hours to catch up.
        """
        settled_tick = self.downlink.settled_tick
        if settled_tick != tick + SETTLE_TICKS and settled_tick + tick != 0:
            raise ValueError(f"the radio is settled up to tick {settled_tick}, at tick {tick}")
        if not begun_tick - CONTROL_PERIOD_TICKS <= self.uplink.now <= tick:
            raise ValueError(f"the PC has heard everything up to tick {self.uplink.now}, at tick {tick}")
        if max(self.downlink.free_tick, self.downlink.busy_tick) > tick + LONGEST_TRANSMISSION_TICKS:
            raise ValueError(f"the transmitter is busy until tick {self.downlink.free_tick}, at tick {tick}")
        if self.actions.next_tick < tick - SETTLE_TICKS:
            raise ValueError(f"an action waits for tick {self.actions.next_tick}, at tick {tick}")
        self.actions.check([robot.slot for robot in self.robots])
        if self.outbox.waiting and self.outbox.waiting[0].sent.tick < self.downlink.free_tick:
            raise ValueError(
                f"characters wait, but the transmitter is busy until tick {self.downlink.free_tick}"
            )
        if any(answer is not None and answer.tick > tick for answer in self.telemetry.last):
            raise ValueError(f"a robot's last answer came after tick {tick}")
        for robot in self.robots:
            cpu = robot.board.cpu
            if not begun_tick - CONTROL_PERIOD_TICKS <= cpu.cycles * CYCLE_TICKS <= tick + SETTLE_TICKS:
                raise ValueError(f"a CPU is at cycle {cpu.cycles}, at tick {tick}")
            if cpu.rxd.settled_tick != settled_tick or cpu.rxd.last_tick() >= max(settled_tick, 1):
                raise ValueError(
                    f"RXD is settled up to tick {cpu.rxd.settled_tick}, the radio up to {settled_tick}"
                )


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
