"""Three mistakes as people make them, one in the firmware of each board of examples/boards.

    python -m tests.mirotwin.fuzz.boards.planted         builds the images in `planted/` again; needs SDCC

An image is that of the example with one change in its C source. `looks_for`: how `mirotwin fuzz` finds it.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from tests import children

BOARDS = Path(__file__).parents[4] / "examples" / "boards"
FOLDER = Path(__file__).parent / "planted"
CHECKS = FOLDER / "checks.py"


class Planted(NamedTuple):
    """`right` of `source` becomes `wrong`. `scenario`: of the board; `options`: of the command; `check`: what fails."""

    name: str
    source: str
    right: str
    wrong: str
    scenario: str
    options: tuple[str, ...]
    check: str

    @property
    def image(self) -> Path:
        return FOLDER / f"{self.name}.ihx"

    def text(self) -> str:
        text = (BOARDS / self.source).read_text("utf-8")
        assert text.count(self.right) == 1, self.name
        return text.replace(self.right, self.wrong)

    def looks_for(self) -> list[str]:
        """The arguments of `mirotwin fuzz`."""
        return [str(BOARDS / self.scenario), "--firmware", str(self.image), *self.options]


ALL = [
    Planted(
        "car_near",  # readings below 5 cm are taken for noise: nearest to the wall the car does not stop
        "car/car.c",
        "distance_cm < STOP_CM)",
        "(distance_cm >= 5 && distance_cm < STOP_CM))",
        "car/stops.scenario.toml",
        ("--after", "300ms", "--expect", f"{CHECKS}:StandsBeforeObstacles"),
        "stands_before_obstacles",
    ),
    Planted(
        "modbus_long",  # nobody looks whether a frame fits its buffer
        "modbus/module.c",
        "            if (length <= LONGEST)\n                frame[length++]",
        "            frame[length++]",
        "modbus/coils.scenario.toml",
        ("--protocol", f"{FOLDER / 'modbus_rtu.py'}:ModbusRtu"),
        "no_fault",
    ),
    Planted(
        "rover_hang",  # it waits for the echo for ever, with its motors on
        "rover/rover.c",
        "    while (!ECHO)\n        if (now() - begun > 36000u)\n            return NO_ECHO;\n",
        "    while (!ECHO)\n        ;\n",
        "rover/pause.scenario.toml",
        ("--after", "400ms", "--expect", f"{CHECKS}:StandsWithoutEcho"),
        "stands_without_echo",
    ),
]
BY_NAME = {planted.name: planted for planted in ALL}


def built(planted: Planted, folder: Path) -> bytes:
    """The image as SDCC makes it, by the line of the example's Makefile."""
    source = folder / Path(planted.source).name
    source.write_text(planted.text(), "utf-8")
    line = ["sdcc", "-mmcs51", "--model-small", source.name, "-o", "image.ihx"]
    children.run(line, cwd=folder, check=True, capture_output=True)
    return (folder / "image.ihx").read_bytes()


def main() -> int:
    for planted in ALL:
        with tempfile.TemporaryDirectory() as folder:
            planted.image.write_bytes(built(planted, Path(folder)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
