"""A car of two motors behind a bridge on a plane, with a ranger on a servo and line sensors, driven by a test."""

from miro_robot.parts.hc_sr04 import HcSr04
from miro_robot.parts.l298 import L298
from miro_robot.parts.servo import Servo
from miro_sim.plant.car import Car
from miro_sim.plant.dc_motor import DcMotor
from miro_sim.plant.encoder import Encoder
from miro_sim.plant.line_sensors import LineSensors
from tests.robot.parts.bench import Bench

HZ = 12_000_000
MS = HZ // 1000
WALLS = ((-100.0, -100.0, 100.0, -100.0), (100.0, -100.0, 100.0, 100.0), (100.0, 100.0, -100.0, 100.0))
RING = tuple(
    (30.0 * x, 30.0 * y) for x, y in ((1, 0), (0.7, 0.7), (0, 1), (-0.7, 0.7), (-1, 0), (0, -1), (1, 0))
)
WAYS = {"forward": (1, 0), "backward": (0, 1), "brake": (0, 0)}


def bench(car=None, eyes=None, sensors=None, motor=None, crystal_hz=HZ, seed=0, four=False):
    """Nets: in1 to in4 and `trig` are the test's, `pwm` the servo's. `four`: wheels, with one motor each."""
    motor = motor or DcMotor()
    rear = {"rear_left": "rl", "rear_right": "rr"} if four else {}
    parts = {
        "bridge": (
            L298(),
            {name: name for name in ("in1", "in2", "in3", "in4", "out1", "out2", "out3", "out4")},
        ),
        "car": (car or Car(walls=WALLS, lines=(RING,)), {"left": "l", "right": "r", "body": "body", **rear}),
        "left": (motor, {"a": "out1", "b": "out2", "shaft": "l"}),
        "right": (motor, {"a": "out3", "b": "out4", "shaft": "r"}),
        "disc": (Encoder(), {"shaft": "l", "a": "count"}),
        "neck": (Servo(), {"pwm": "pwm", "horn": "horn"}),
        "eyes": (eyes or HcSr04(), {"trig": "trig", "echo": "echo", "body": "body", "horn": "horn"}),
        "line": (sensors or LineSensors(), {"body": "body", "s1": "s1", "s2": "s2", "s3": "s3"}),
    }
    if four:
        parts["back_left"] = (motor, {"a": "out1", "b": "out2", "shaft": "rl"})
        parts["back_right"] = (motor, {"a": "out3", "b": "out4", "shaft": "rr"})
    board = Bench(parts, ["in1", "in2", "in3", "in4", "trig", "pwm"], crystal_hz, seed)
    drive(board, "brake", "brake")
    board.drive_all({"trig": 0, "pwm": 0})
    return board


def drive(board, left, right, ticks=1):
    """Both sides of the bridge for so long."""
    (in1, in2), (in3, in4) = WAYS[left], WAYS[right]
    board.drive_all({"in1": in1, "in2": in2, "in3": in3, "in4": in4})
    board.run(board.tick + ticks)


def pose(board):
    return tuple(board.read(f"car.{key}") for key in ("x_cm", "y_cm", "heading_deg"))
