"""The robot's own firmware as built: `miro.ihx`, and beside it `miro.map` and `miro.cdb` (symbols), `miro.rst` (lines).

What belongs here: where the files are. What does not: their source (`robot_fw/firmware/`, which writes them)
and reading them (`miro_robot.image`).
"""

from pathlib import Path


def image_path() -> Path:
    """Intel HEX of the firmware that scenarios run by default."""
    return Path(__file__).parent / "miro.ihx"


def source_folder() -> Path | None:
    """The C source of it: in a checkout, or in a wheel beside the image; None where neither is."""
    for folder in (Path(__file__).parents[2] / "firmware", Path(__file__).parent / "source"):
        if (folder / "Makefile").is_file():
            return folder
    return None
