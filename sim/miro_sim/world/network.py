"""One radio network: a host station, the air both ways, and the robots that share the frequency.

What belongs here: what happens to all robots of a network together in a control period. What does not: the air
itself (`radio/`), the order of networks and the clock (`world.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from msgspec import convert

from miro_exact.clock import CONTROL_PERIOD_TICKS, CYCLE_TICKS, HOST_CHARACTER_TICKS, ticks
from miro_exact.saved import LAST_TICK, whole
from miro_host.pilot import Command
from miro_host.station import Station
from miro_protocol.decoder import Symbol, TelemetryDecoder
from miro_robot.image import Image
from miro_robot.mcs51.execute import STOPPED
from miro_sim.periods import RobotPeriod, WireRun
from miro_sim.radio import Downlink, Uplink
from miro_sim.scenario import keys as sc
from miro_sim.scenario.build import radio_for
from miro_sim.world.control_noise import NoisyCommands
from miro_sim.world.robot import Robot

SETTLE_TICKS = 120
"""How far beyond a robot's stop the line must be known: an instruction may overrun by four machine cycles."""


class Network:
    """Station, radio and robots of one frequency. `script` replaces what the station would send."""

    NOT_STATE = (
        "spec",
        "index",
        "compute_ticks",
        "keyup_ticks",
        "noisy_commands",
        "script",
        "sent",
        "seen",
    )  # the last two: records

    def __init__(
        self,
        spec: sc.Network,
        scenario: sc.Scenario,
        index: int,
        seed: int,
        image: Image,
        script: Sequence[tuple[int, bytes]] | None,
    ) -> None:
        self.spec = spec
        self.index = index
        self.compute_ticks = ticks(scenario.host.compute_s)
        self.keyup_ticks = ticks(spec.radio.keyup_s) if spec.radio.carrier == "keyed" else 0
        self.robots = [
            Robot(robot, scenario, index, spec.robots, seed, image)
            for robot in sorted(spec.robot, key=lambda robot: robot.slot)
        ]
        self.noisy_commands = [
            NoisyCommands(
                spec.control_noise, robot.pilot.wheels, seed, f"net{index}/robot{robot.spec.slot}/control"
            )
            for robot in self.robots
        ]
        self.station = Station(spec.robots, telemetry=spec.radio.telemetry)
        radio = radio_for(spec.radio)
        self.downlink = Downlink(radio, seed, f"net{index}/down")
        self.uplink = Uplink(radio, seed, f"net{index}/up")
        for robot in self.robots:
            self.downlink.listen(robot.spec.slot, robot.board.cpu.rxd)
            self.uplink.listen(robot.board.cpu.txd, robot.spec.slot)
        self.telemetry = TelemetryDecoder()
        self.script = list(script) if script is not None else None
        self.script_next = 0
        self.frames_sent = 0
        self.heard: list[Symbol] = []  # in this period so far
        self.sent: list[WireRun] = []
        self.seen: list[RobotPeriod] = []

    def begin_period(self, tick: int, end_tick: int) -> None:
        """Camera, PC and station, in this order."""
        measured = [robot.expose(tick) for robot in self.robots]
        self.sent = []
        if self.script is None:
            commands: list[Command | None] = [
                robot.steer(posture, tick) for robot, posture in zip(self.robots, measured, strict=True)
            ]
            self._transmit(tick + self.compute_ticks + self.keyup_ticks, commands)
        else:
            commands = [None] * len(self.robots)
            self._transmit_script(end_tick)
        self.seen = [
            robot.record(tick, posture, command)
            for robot, posture, command in zip(self.robots, measured, commands, strict=True)
        ]

    def share_frequency(self, other: Network) -> None:
        """Lets the robots of this network hear the other one's transmitter too."""
        self.downlink.overhear(other.downlink)

    def settle(self, end_tick: int) -> None:
        """All networks have sent: the line is known up to the end of the period."""
        self.downlink.settle(end_tick + SETTLE_TICKS)

    def _transmit(self, start_tick: int, commands: Sequence[Command | None]) -> None:
        wheels = [(0, 0)] * self.spec.robots
        for robot, noise, command in zip(self.robots, self.noisy_commands, commands, strict=True):
            if command is not None:
                wheels[robot.spec.slot] = noise.wheels_of(command, robot.frame)
        self._send(start_tick, self.station.frame(wheels))

    def _transmit_script(self, end_tick: int) -> None:
        """Announces every scripted run whose carrier may come up before the line is settled."""
        assert self.script is not None
        limit = end_tick + SETTLE_TICKS + self.keyup_ticks
        while self.script_next < len(self.script) and self.script[self.script_next][0] <= limit:
            self._send(*self.script[self.script_next])
            self.script_next += 1

    def _send(self, start_tick: int, data: bytes) -> None:
        self.downlink.send(start_tick, data)
        self.frames_sent += 1
        self.sent.append(WireRun(start_tick, ">", self.index, -1, data))

    def run(self, tick: int) -> bool:
        """Runs every robot to `tick`, one after the other; true when a firmware fault stopped one.

        A robot stops where more than 2048 edges of its TXD wait. When all robots are there or at `tick`, the PC hears
        what came before the first 2048th edge, and those that have stopped go on. That tick depends on the wires'
        content alone, so the PC hears the same however the run is cut.
        """
        while True:
            reasons = [robot.board.run(tick) for robot in self.robots]
            if STOPPED in reasons:
                return True
            full_tick = self.uplink.full_tick()
            if full_tick >= tick:
                return False
            self.heard += self.uplink.receive(full_tick)

    def end_period(self, tick: int) -> list[WireRun]:
        """The PC's receiver hears what the robots sent; returns all runs of bytes of the period."""
        heard = [*self.heard, *self.uplink.receive(tick)]
        self.heard = []
        self.telemetry.feed_symbols(heard)
        return [*self.sent, *runs(heard, self.index)]

    @property
    def bit_errors(self) -> int:
        """Bits that the radio turned over so far, down at every listener and up."""
        down = 0
        for listener in self.downlink.listeners.values():
            down += listener.bit_errors
        return down + self.uplink.bit_errors

    def snapshot(self) -> dict[str, object]:
        return {
            "robots": [robot.snapshot() for robot in self.robots],
            "station": self.station.snapshot(),
            "downlink": self.downlink.snapshot(),
            "uplink": self.uplink.snapshot(),
            "telemetry": self.telemetry.snapshot(),
            "script_next": self.script_next,
            "frames_sent": self.frames_sent,
            **({"heard": list(self.heard)} if self.heard else {}),
        }

    def restore(self, state: dict[str, Any]) -> None:
        for robot, saved in zip(self.robots, state["robots"], strict=True):
            robot.restore(saved)
        self.station.restore(state["station"])
        self.downlink.restore(state["downlink"])
        self.uplink.restore(state["uplink"])
        self.telemetry.restore(state["telemetry"])
        self.heard = convert(state.get("heard", []), list[Symbol])
        self.script_next = whole(state, "script_next", 0, len(self.script or ()))
        self.frames_sent = whole(state, "frames_sent", 0, LAST_TICK)

    def check_times(self, begun_tick: int, tick: int, in_period: bool) -> None:
        """Raises ValueError unless the restored parts are at `tick`, in the period that began at `begun_tick`.

        A part that is far behind would take for ever to catch up.
        """
        settled_tick = self.downlink.settled_tick
        until = begun_tick + (CONTROL_PERIOD_TICKS if in_period else 0)
        if settled_tick != (until + SETTLE_TICKS if until else 0):
            raise ValueError(
                f"the radio is settled up to tick {settled_tick}, in the period from {begun_tick}"
            )
        if self.script is None and self.downlink.free_tick > until + CONTROL_PERIOD_TICKS:
            raise ValueError(f"the station is busy until tick {self.downlink.free_tick}, at tick {tick}")
        if not begun_tick - CONTROL_PERIOD_TICKS <= self.uplink.now <= tick:
            raise ValueError(f"the PC has heard everything up to tick {self.uplink.now}, at tick {tick}")
        for robot in self.robots:
            cpu = robot.board.cpu
            if not begun_tick - CONTROL_PERIOD_TICKS <= cpu.cycles * CYCLE_TICKS <= tick + SETTLE_TICKS:
                raise ValueError(f"a CPU is at cycle {cpu.cycles}, at tick {tick}")
            if cpu.rxd.settled_tick != settled_tick or cpu.rxd.last_tick() >= max(settled_tick, 1):
                raise ValueError(
                    f"RXD is settled up to tick {cpu.rxd.settled_tick}, the radio up to {settled_tick}"
                )


def runs(symbols: Sequence[tuple[int, bool, int]], network: int) -> list[WireRun]:
    """Received symbols as runs of bytes without a gap; a bad stop bit ends a run after its byte."""
    found: list[WireRun] = []
    start, data, expected = 0, bytearray(), -1
    for byte, stop_good, tick in symbols:
        if data and tick > expected:
            found.append(WireRun(start, "<", network, -1, bytes(data)))
            data = bytearray()
        if not data:
            start = tick
        data.append(byte)
        expected = tick + HOST_CHARACTER_TICKS + HOST_CHARACTER_TICKS // 20 if stop_good else -1
    if data:
        found.append(WireRun(start, "<", network, -1, bytes(data)))
    return found
