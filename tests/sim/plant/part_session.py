"""Parts of a board in a long mixed session that depends on a number only: for comparing engines.

`python -m tests.sim.plant.part_session ENGINE SEED STEPS [car]` prints the digest of all their states.
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
        DRIVEN,
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
DRIVEN = ("ena", "in1", "in2", "enb", "in3", "in4", "trig")
READS = (
    "neck.angle_deg",
    "bridge.a.duty",
    "bridge.b.frequency_hz",
    "left.rpm",
    "right.turns",
    "horn.sounded_ms",
)


def car(seed):
    from miro_sim.plant.car import Car
    from tests.sim.plant import car_bench

    walls = (*car_bench.WALLS, (-60.0, -30.0, -50.0, 40.0))
    keys = Car(walls=walls, lines=(car_bench.RING,), picture=("#.#.#" * 6, ".#.#." * 6) * 8, cell_cm=3.0)
    return car_bench.bench(keys, crystal_hz=11_059_200, seed=seed)


CAR_PUTS = (
    ("car.x_cm", (0.0, 40.0, -70.0)),
    ("car.heading_deg", (0.0, 100.0, -170.0)),
    ("eyes.distance_cm", (33.3,)),
    ("eyes.sees", ("walls",)),
    ("line.s1", ("dark", "seen")),
    ("right.load_nm", (0.0, 0.02)),
)
CAR_READS = ("car.x_cm", "car.y_cm", "car.heading_deg", "car.bumps", "eyes.distance_cm", "line.pattern")
SESSIONS = {
    "parts": (bench, DRIVEN, PUTS, READS, ("la", "ra", "echo")),
    "car": (car, ("in1", "in2", "in3", "in4", "trig", "pwm"), CAR_PUTS, CAR_READS, ("count", "s1", "echo")),
}


def digest(seed, count, kind="parts"):
    make, driven, puts, reads, counted = SESSIONS[kind]
    board = make(seed)
    draw = random.Random(seed)
    seen = hashlib.sha256()
    for _ in range(count):
        board.run(board.tick + draw.choice((1, 50, 1000, 20_000, 200_000, 400_000)))
        if draw.random() < 0.2:
            path, values = draw.choice(puts)
            board.put(path, draw.choice(values))
        else:
            nets = draw.sample(driven, draw.randint(1, 3))
            board.drive_all({net: draw.randint(0, 1) for net in nets})
        values = [board.read(path) for path in reads]
        seen.update(board.save() + repr((board.tick, values)).encode())
    return " ".join([seen.hexdigest(), *(str(len(board.edges_of(net))) for net in counted)])


if __name__ == "__main__":
    engine.select(sys.argv[1])
    print(engine.active(), digest(int(sys.argv[2]), int(sys.argv[3]), *sys.argv[4:]))
