"""When firmware is up: its serial receiver is on (REN in SCON), which is all that a robot on a radio has to do."""

from __future__ import annotations

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND
from miro_robot.image import Image
from miro_robot.mcs51.cpu import Cpu

BOOT_PERIODS = 8
"""Control periods, of 33.4 ms, that firmware may take."""
BOOT_MS = 1000 * BOOT_PERIODS * CONTROL_PERIOD_TICKS / TICKS_PER_SECOND
_SCON, _REN = 0x98, 0x10


def is_up(cpu: Cpu) -> bool:
    return bool(cpu.sfr(_SCON) & _REN)


def not_up(image: Image, remedy: str, waited_ms: float = BOOT_MS) -> BadInput:
    """What to raise for firmware that has not come up in time."""
    what = f"the firmware has not turned its serial receiver on {waited_ms:.0f} ms after power-on"
    return BadInput(image.path, "", what, remedy)
