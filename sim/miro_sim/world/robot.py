"""One robot of the world: its electronics and drive, and the pilot on the PC that steers it.

The pilot never reads the robot: it gets the camera's measurement and the robot's last answer by radio, and answers
with a command.
"""

from __future__ import annotations

from collections.abc import Callable

from msgspec.structs import astuple

from miro_exact.clock import CYCLE_TICKS, NEVER_TICK, seconds
from miro_exact.plugins import PluginError
from miro_exact.rng import Stream
from miro_host.pilot import Pilot, WheelCommand
from miro_host.posture import Posture
from miro_host.telemetry_receiver import LastTelemetry
from miro_robot.board import Board
from miro_robot.event_log import TRUE
from miro_robot.image import Image
from miro_robot.lm629.chip import Lm629
from miro_robot.wiring import load_wiring
from miro_sim.periods import Axis, Control, RobotPeriod
from miro_sim.pitch.contact import GRID_TICKS
from miro_sim.scenario import keys as sc
from miro_sim.scenario.build import drive_for, pilot_for, reference_and_start
from miro_sim.world.events import RobotLog

COUNTERS = ("frames_accepted", "frames_rejected", "frames_stale")


class Robot:
    """A robot on the pitch and its pilot. `network` and `spec.slot` name it in records and noise streams."""

    STATE = {"board": Board, "pilot": Pilot}
    NOT_STATE = (
        "spec", "network", "slot", "reference", "counter_addresses", "log", "marks", "asked",
        "drive",  # the board saves it
        "grid_tick", "noted",  # where it was in the piece that runs
    )  # fmt: skip

    def __init__(
        self, spec: sc.RobotSpec, scenario: sc.Scenario, network: int, robots: int, seed: int, image: Image
    ) -> None:
        name = f"net{network}/robot{spec.slot}"
        self.spec = spec
        self.network = network
        self.slot = spec.slot
        try:
            self.reference, start = reference_and_start(spec, scenario.duration_s)
            self.pilot: Pilot = pilot_for(spec, self.reference, scenario, network)
        except PluginError as error:
            raise self._named(error, 0) from error
        noise = Stream(seed, f"{name}/disturbance")
        self.drive = drive_for(spec, start, Stream(seed, f"{name}/wheels"), noise)
        strap = spec.slot if spec.strap is None else spec.strap
        self.board = Board(load_wiring(), self.drive, strap, robots, scenario.lm629, scenario.stop_on_fault)
        self.log = RobotLog(self.board.log, network, spec.slot)
        self.board.load(image)
        self.marks: tuple[int, ...] = ()
        self.asked: list[tuple[Callable[[Robot], object], str]] = []
        self.note_from(NEVER_TICK)
        self.counter_addresses = [_iram_address(image, f"_{counter}") for counter in COUNTERS]

    def note_from(self, tick: int) -> None:
        """Notes where the robot is at ticks of the contact grid, from `tick` on."""
        self.grid_tick = tick
        self.noted: list[tuple[float, float, float]] = []

    def run(self, tick: int) -> int:
        """Runs the board to `tick`, watching out for what a wait asked for; not 0 when a firmware fault stopped it."""
        while self.grid_tick <= tick:
            stopped = self._run(self.grid_tick)
            if stopped:
                return stopped
            self.noted.append(self.drive.pose_at(self.grid_tick))
            self.grid_tick += GRID_TICKS
        return self._run(tick)

    def _run(self, tick: int) -> int:
        if self.asked:
            return self._run_asking(tick)
        if self.marks:
            return self.board.run_to_any(self.marks, tick)
        return self.board.run(tick)

    def _run_asking(self, tick: int) -> int:
        """The same in steps, with the predicates asked after each."""
        board = self.board
        stopped = 0
        while not stopped and board.cpu.cycles * CYCLE_TICKS < tick:
            now = board.cpu.cycles * CYCLE_TICKS
            sample_tick = board.left.sample_tick
            step_tick = now + 1 if any(at == "instruction" for _, at in self.asked) else sample_tick
            step_tick = min(step_tick, tick)
            stopped = board.run_to_any(self.marks, step_tick)
            reached = board.cpu.cycles * CYCLE_TICKS if step_tick == now + 1 else step_tick
            for predicate, at in self.asked:
                if (at == "instruction" or step_tick == sample_tick) and predicate(self):
                    board.log.note(TRUE, reached, 0, 0)
        return stopped

    def steer(self, measured: Posture | None, telemetry: LastTelemetry | None, tick: int) -> WheelCommand:
        """Wheel commands from what the PC measured and the robot's last telemetry. Raises PluginError."""
        try:
            return self.pilot.update(measured, seconds(tick), telemetry)
        except PluginError as error:
            raise self._named(error, tick) from error

    def _named(self, error: PluginError, tick: int) -> PluginError:
        """The same with the robot it is of, and when."""
        place = f"net{self.network}/robot{self.spec.slot}: tick {tick} ({seconds(tick):.6f} s)"
        return PluginError(f"{place}: {error.what}", error.remedy)

    def counter(self, index: int) -> int | None:
        """A frame counter of the firmware (16 bit), or None when the image exports no such symbol."""
        address = self.counter_addresses[index]
        if address is None:
            return None
        cpu = self.board.cpu
        return cpu.peek_iram(address) | cpu.peek_iram(address + 1) << 8

    def record(self, tick: int, measured: Posture | None, command: WheelCommand | None) -> RobotPeriod:
        """What observers see of this robot at `tick`; drains the lists of completed LM629 commands."""
        v_m_s, w_rad_s = self.drive.velocity_at(tick)
        try:
            reference = self.pilot.reference_at(seconds(tick)).posture
        except PluginError as error:
            raise self._named(error, tick) from error
        return RobotPeriod(
            self.network,
            self.slot,
            reference,
            Posture(*self.drive.pose_at(tick)),
            v_m_s,
            w_rad_s,
            measured,
            None if command is None else _control(command),
            self.counter(0),
            self.counter(1),
            self.counter(2),
            _axis(self.board.left),
            _axis(self.board.right),
        )

    def __repr__(self) -> str:
        return f"Robot(net{self.network}/robot{self.spec.slot}, {self.drive!r}, {self.board!r})"


def _iram_address(image: Image, name: str) -> int | None:
    symbol = image.symbols.find(name)
    return symbol.address if symbol is not None and symbol.space == "iram" else None


def _control(command: WheelCommand) -> Control:
    left, right, v_m_s, w_rad_s, inner, _, _, estimate = astuple(command)
    return Control(v_m_s, w_rad_s, left, right, dict(inner), dict(estimate))  # observers may change theirs


def _axis(chip: Lm629) -> Axis:
    commands = tuple([(tick, opcode, data.hex()) for tick, opcode, data in chip.commands])
    del chip.commands[:]
    profile = chip.trajectory
    return Axis(
        profile.position >> 16,
        chip.real_position,
        profile.velocity,
        chip.signals.word & 0xFE,
        chip.sign,
        chip.pwm_magnitude,
        commands,
    )
