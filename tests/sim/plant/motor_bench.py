"""A bridge, its motor and an encoder on nets, driven by a test."""

from miro_robot.parts.l298 import L298
from miro_sim.plant.dc_motor import DcMotor
from miro_sim.plant.encoder import Encoder
from tests.robot.parts.bench import Bench

HZ = 12_000_000
INPUTS = {"coast": (0, 0, 0), "forward": (1, 1, 0), "backward": (1, 0, 1), "brake": (1, 0, 0)}


def bench(motor=None, encoder=None, names=("bridge", "motor", "wheel"), crystal_hz=HZ):
    """`names`: of bridge, motor and encoder; the order of names is the order of parts. No encoder: two names."""
    first, second, *third = names
    parts = {
        first: (L298(), {pin: pin for pin in ("ena", "in1", "in2", "out1", "out2")}),
        second: (motor or DcMotor(), {"a": "out1", "b": "out2", **({"shaft": "shaft"} if third else {})}),
    }
    if third:
        parts[third[0]] = (encoder or Encoder(), {"shaft": "shaft", "a": "a", "b": "b"})
    board = Bench(parts, ["ena", "in1", "in2"], crystal_hz)
    put_mode(board, "coast")
    board.run(1)
    return board


def put_mode(board, mode, tick=None):
    board.drive_all(dict(zip(("ena", "in1", "in2"), INPUTS[mode], strict=True)), tick)


def drive(board, stretches):
    """Stretches of (mode, ticks)."""
    for mode, ticks in stretches:
        put_mode(board, mode)
        board.run(board.tick + ticks)
