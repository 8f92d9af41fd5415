"""The robot's own firmware as built: `miro.ihx`, and beside it `miro.map` and `miro.cdb` (symbols), `miro.rst` (lines).

What belongs here: where the files are. What does not: their source (`robot_fw/firmware/`, which writes them)
and reading them (`miro_robot.image`).
"""

from pathlib import Path


def image_path() -> Path:
    """Intel HEX of the firmware that scenarios run by default."""
    return Path(__file__).parent / "miro.ihx"


def source_folder() -> Path | None:
    """The C source of it, where the package is used out of its checkout; None elsewhere."""
    folder = Path(__file__).parents[2] / "firmware"
    return folder if folder.is_dir() else None
