"""The robot's own firmware as built: `miro.ihx` and, for symbols, `miro.map` and `miro.cdb` beside it.

What belongs here: where the files are. What does not: their source (`robot_fw/firmware/`, which writes them)
and reading them (`miro_robot.image`).
"""

from pathlib import Path


def image_path() -> Path:
    """Intel HEX of the firmware that scenarios run by default."""
    return Path(__file__).parent / "miro.ihx"
