"""Loads the firmware image that a command, a test, a campaign or a port runs, and reports when it is up.

It is up when its serial receiver is on (REN in SCON), which is all that a robot on a radio has to do.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND
from miro_exact.inputs import check_regular
from miro_robot.firmware import image_path
from miro_robot.image import FLASH_BYTES, Image, load_hex
from miro_robot.image.symbol_files import STACK

if TYPE_CHECKING:
    from miro_robot.mcs51.cpu import Cpu
    from miro_sim.scenario.board_scenario import AnyText


def load_firmware(
    path: str | Path | None = None,
    limit: int = FLASH_BYTES,
    named: bool = True,
    stack_from: int | None = None,
) -> Image:
    """The firmware image at `path`, or the robot's own. Parsed images are cached (`image`).

    `named`: its symbols are needed; the files beside it are read at once, and BadInput is raised for wrong ones.
    `stack_from`: first address of its stack; allowed only for an image without a linker's map. Raises BadInput for a
    file that is no image, or is larger than `limit` bytes.
    """
    file = Path(path) if path else image_path()
    check_regular(file)
    image = load_hex(file, limit)
    if named:
        _ = image.symbols.names
    if stack_from is None:
        return image
    known = image.symbols.find(STACK)
    if known is not None:
        reason = f"the .map beside the image begins its stack at {known.address:#04x}"
        raise BadInput(image.path, "--stack-from", reason, "leave the option out, or link with that stack")
    return msgspec.structs.replace(image, symbols=image.symbols.with_stack(stack_from))


def image_for(text: AnyText, firmware: str | Path | None = None, stack_from: int | None = None) -> Image:
    """The image that a scenario runs on: `firmware`, or the one that a board's scenario names, or the robot's own.

    Raises BadInput as `load_firmware` does, and for a board without an image.
    """
    from miro_sim.scenario.board_scenario import BoardText, firmware_beside  # only some commands need it

    if not isinstance(text, BoardText):
        return load_firmware(firmware, stack_from=stack_from)
    from miro_robot.mcs51.chips import CHIPS

    limit = CHIPS[text.scenario.board.chip].flash_bytes
    return load_firmware(firmware or firmware_beside(text), limit, stack_from=stack_from)


BOOT_PERIODS = 8
"""Control periods, of 33.4 ms, that firmware may take."""
BOOT_MS = 1000 * BOOT_PERIODS * CONTROL_PERIOD_TICKS / TICKS_PER_SECOND
_SCON, _REN = 0x98, 0x10


def is_up(cpu: Cpu) -> bool:
    return bool(cpu.sfr(_SCON) & _REN)


def not_up(image: Image, remedy: str, waited_ms: float = BOOT_MS) -> BadInput:
    """The error for firmware that has not booted in time."""
    reason = f"the firmware has not turned its serial receiver on {waited_ms:.0f} ms after power-on"
    return BadInput(image.path, "", reason, remedy)
