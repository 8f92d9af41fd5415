"""Parts of a board in a long mixed session that depends on a number only: for comparing engines.

`python -m tests.sim.plant.part_session ENGINE SEED STEPS` prints the digest of all their states.
"""

import hashlib
import random
import sys

from miro_exact import engine


def bench(seed):
    from miro_robot.parts.button import Button
    from miro_robot.parts.buzzer import Buzzer
    from miro_robot.parts.hc_sr04 import HcSr04
    from miro_robot.parts.l298 import L298
    from miro_robot.parts.led import Led
    from miro_robot.parts.servo import Servo
    from miro_sim.plant.dc_motor import DcMotor
    from miro_sim.plant.encoder import Encoder
    from tests.robot.parts.bench import Bench  # hot modules: not before the engine was chosen

    bridge = {pin: pin for pin in ("ena", "in1", "in2", "enb", "in3", "in4", "out1", "out2", "out3", "out4")}
    return Bench(
        {
            "bridge": (L298(still_ms=5.0), bridge),
            "eyes": (HcSr04(noise_cm=1.0), {"trig": "trig", "echo": "echo"}),
            "horn": (Buzzer(kind="passive"), {"pin": "in4"}),
            "key": (Button(bounce_ms=3.0), {"pin": "key"}),
            "lamp": (Led(), {"pin": "key"}),
            "left": (DcMotor(inertia_kg_m2=1e-5), {"a": "out1", "b": "out2", "shaft": "left"}),
            "neck": (Servo(), {"pin": "trig"}),
            "right": (DcMotor(inertia_kg_m2=1e-6), {"a": "out3", "b": "out4", "shaft": "right"}),
            "wheel_left": (Encoder(lines=200), {"shaft": "left", "a": "la", "b": "lb"}),
            "wheel_right": (Encoder(lines=512), {"shaft": "right", "a": "ra"}),
        },
        ["ena", "in1", "in2", "enb", "in3", "in4", "trig"],
        11_059_200,
        seed,
    )


PUTS = (
    ("key.pressed", (True, False)),
    ("eyes.distance_cm", (2.0, 33.3, 400.0)),
    ("eyes.echo", ("normal", "none", "low", "high")),
    ("left.load_nm", (0.0, 0.01, 0.02)),
    ("right.blocked", (True, False)),
    ("right.load_nm", (0.0, 0.1, 1.0)),
    ("wheel_left.b.broken", ("none", "low", "high")),
)
READS = (
    "neck.angle_deg",
    "bridge.a.duty",
    "bridge.b.frequency_hz",
    "left.rpm",
    "right.turns",
    "horn.sounded_ms",
)


def digest(seed, count):
    board = bench(seed)
    draw = random.Random(seed)
    seen = hashlib.sha256()
    for _ in range(count):
        board.run(board.tick + draw.choice((1, 50, 1000, 20_000, 200_000, 400_000)))
        if draw.random() < 0.2:
            path, values = draw.choice(PUTS)
            board.put(path, draw.choice(values))
        else:
            nets = draw.sample(["ena", "in1", "in2", "enb", "in3", "in4", "trig"], draw.randint(1, 3))
            board.drive_all({net: draw.randint(0, 1) for net in nets})
        values = [board.read(path) for path in READS]
        seen.update(board.save() + repr((board.tick, values)).encode())
    return f"{seen.hexdigest()} {len(board.edges_of('la'))} {len(board.edges_of('ra'))} {len(board.edges_of('echo'))}"


if __name__ == "__main__":
    engine.select(sys.argv[1])
    print(engine.active(), digest(int(sys.argv[2]), int(sys.argv[3])))
