"""One robot of the world: its electronics and drive, and the pilot on the PC that steers it.

The pilot never reads the robot: it gets the camera's measurement and the robot's last answer by radio, and answers
with a command.
"""

from __future__ import annotations

from typing import Any

from msgspec.structs import astuple

from miro_exact.clock import NEVER_TICK, seconds
from miro_exact.plugins import PluginError
from miro_exact.rng import Stream
from miro_host.pilot import Pilot, WheelCommand
from miro_host.posture import Posture
from miro_host.telemetry_receiver import LastTelemetry
from miro_protocol.actions import fault_text
from miro_robot.board import Board
from miro_robot.broken import break_board
from miro_robot.image import Image
from miro_robot.lm629.chip import Lm629
from miro_robot.lm629.options import Lm629Options
from miro_robot.plant import Plant
from miro_robot.processor_board import ProcessorBoard
from miro_robot.wiring import load_wiring
from miro_sim.periods import Axis, Control, RobotPeriod
from miro_sim.pitch.contact import GRID_TICKS
from miro_sim.plant.chassis import BLOCKED_NM
from miro_sim.scenario import keys as sc
from miro_sim.scenario.build import pilot_and_drive
from miro_sim.world.device import Device

ENCODERS = {"lost": (1, 1), "a0": (0, -1), "a1": (1, -1), "b0": (-1, 0), "b1": (-1, 1), "ok": (-1, -1)}
"""Levels at which A and B are held, -1: not at all. Lost: both wires are open, with pull-ups at the LM629."""


class Robot(Device):
    """A robot on the pitch and its pilot. `network` and `spec.slot` name it in records and noise streams."""

    STATE = {"pilot": Pilot}
    NOT_STATE = (
        "spec",
        "drive",  # the board saves it
        "noise",
        "grid_tick", "noted",  # where it was in the piece that runs
    )  # fmt: skip

    def __init__(
        self, spec: sc.RobotSpec, scenario: sc.Scenario, network: int, robots: int, seed: int, image: Image
    ) -> None:
        name = f"net{network}/robot{spec.slot}"
        self.spec = spec
        wheels, self.noise = Stream(seed, f"{name}/wheels"), Stream(seed, f"{name}/disturbance")
        self.pilot: Pilot
        try:
            self.pilot, self.drive = pilot_and_drive(spec, scenario, network, wheels, self.noise)
        except PluginError as error:
            raise _named(error, name, 0) from error
        strap = spec.slot if spec.strap is None else spec.strap
        board = make_board(self.drive, strap, robots, scenario.lm629, scenario.stop_on_fault, image=image)
        Device.__init__(self, board, network, spec.slot, image)
        self.board: Board
        self.note_from(NEVER_TICK)

    def note_from(self, tick: int) -> None:
        """Notes where the robot is at ticks of the contact grid, from `tick` on."""
        self.grid_tick = tick
        self.noted: list[tuple[float, float, float]] = []

    def run(self, tick: int) -> int:
        """Runs the board to `tick`, watching for the conditions of a wait; not 0 when a firmware fault stopped it."""
        while self.grid_tick <= tick:
            stopped = Device.run(self, self.grid_tick)
            if stopped:
                return stopped
            self.noted.append(self.drive.pose_at(self.grid_tick))
            self.grid_tick += GRID_TICKS
        return Device.run(self, tick)

    def sample_tick(self) -> int:
        """Of the left LM629."""
        return self.board.left.sample_tick

    def check_fault(self, fault: str) -> None:
        fault_text(fault)

    def break_hardware(self, fault: str) -> None:
        word, *values = fault.split()
        break_board(self.board, fault)
        if word == "encoder":
            encoder = self.drive.left_encoder if values[0] == "left" else self.drive.right_encoder
            level_a, level_b = ENCODERS[values[1]]
            encoder.hold(level_a, level_b)
        elif word == "motor":
            winding = self.drive.left_winding if values[0] == "left" else self.drive.right_winding
            winding.open(int(values[1] == "open"))
        elif word == "wheel":
            brake_nm = BLOCKED_NM if values[1] == "blocked" else 0.0
            setattr(self.drive.body, f"{values[0]}_brake_nm", brake_nm)
        # The network has broken the wire to RXD.

    def is_whole(self) -> bool:
        """True if no part of it is broken now."""
        drive, body = self.drive, self.drive.body
        broken = self.board.left.port.broken or self.board.right.port.broken
        is_open = drive.left_winding.is_open or drive.right_winding.is_open
        left, right = drive.left_encoder, drive.right_encoder
        held = left.held_a >= 0 or left.held_b >= 0 or right.held_a >= 0 or right.held_b >= 0
        return not (
            broken or self.board.is_stuck() or is_open or held or body.left_brake_nm or body.right_brake_nm
        )

    def steer(self, measured: Posture | None, telemetry: LastTelemetry | None, tick: int) -> WheelCommand:
        """Wheel commands from what the PC measured and the robot's last telemetry. Raises PluginError."""
        try:
            return self.pilot.update(measured, seconds(tick), telemetry)
        except PluginError as error:
            raise _named(error, f"net{self.network}/robot{self.slot}", tick) from error

    def record(self, tick: int, measured: Posture | None, command: WheelCommand | None) -> RobotPeriod:
        """The robot's record at `tick` for observers; drains the lists of completed LM629 commands."""
        v_m_s, w_rad_s = self.drive.velocity_at(tick)
        try:
            reference = self.pilot.reference_at(seconds(tick)).posture
        except PluginError as error:
            raise _named(error, f"net{self.network}/robot{self.slot}", tick) from error
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

    def records(self) -> list[Any]:
        board = self.board
        return [*Device.records(self), list(board.left.commands), list(board.right.commands)]

    def put_back(self, records: list[Any]) -> None:
        Device.put_back(self, records)
        self.board.left.commands[:] = records[2]
        self.board.right.commands[:] = records[3]

    def __repr__(self) -> str:
        return f"Robot(net{self.network}/robot{self.spec.slot}, {self.drive!r}, {self.board!r})"


def make_board(
    drive: Plant, slot: int, robots: int, options: Lm629Options, stop_on_fault: bool, *, image: Image
) -> ProcessorBoard:
    """The electronics of a robot. Tests put the net list that they are compared with in its place."""
    board = Board(load_wiring(), drive, slot, robots, options, stop_on_fault)
    board.load(image)
    return board


def _named(error: PluginError, robot: str, tick: int) -> PluginError:
    """The error with its robot and its tick."""
    return PluginError(f"{robot}: tick {tick} ({seconds(tick):.6f} s): {error.what}", error.remedy)


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
