"""The names of parts of a board: electronics, and those that move. None is imported before a board names it."""

from miro_exact.plugins import Registry
from miro_robot.parts import ELECTRONICS
from miro_robot.parts.keys import PartKeys

MOVING: dict[str, str] = {
    "car": "miro_sim.plant.car:Car",
    "dc_motor": "miro_sim.plant.dc_motor:DcMotor",
    "differential_drive": "miro_sim.plant.differential_drive:Drive",
    "encoder": "miro_sim.plant.encoder:Encoder",
    "line_sensors": "miro_sim.plant.line_sensors:LineSensors",
}
"""Parts that move: name to the struct of its keys, in `miro_sim.plant`."""
PARTS: Registry[PartKeys] = Registry(
    word="part",
    key="part",
    base="miro_robot.parts.keys:PartKeys",
    own={**ELECTRONICS, **MOVING},
)
