"""The memories of a processor by the names of a program's variables."""

from __future__ import annotations

from typing import Any

from miro_robot.image import Image
from miro_robot.mcs51.cpu import Cpu


class Memory:
    """Variables of the firmware, each with its value at the moment of reading."""

    def __init__(self, cpu: Cpu, image: Image) -> None:
        self._cpu = cpu
        self._image = image

    def __getitem__(self, name: str) -> Any:
        """The variable `name` by its C type: int, float, bool, a list for an array, a dict for a struct.

        Names as `file:name`, `name[2]`, `name.x`. Raises BadInput for a name that is not in the .cdb beside the image.
        """
        from miro_robot.image.c_types import value_of  # few checks read variables: no run need load this
        from miro_robot.image.variables import find_variable
        from miro_robot.inspect.values import bytes_at

        variable, variables = find_variable(self._image, name)
        return value_of(variable.type, bytes_at(self._cpu, self._image, variable), variables.fields(variable))

    @property
    def iram(self) -> bytes:
        return bytes(self._cpu.peek_iram(address) for address in range(0x100))

    @property
    def xram(self) -> bytes:
        """The external RAM; empty where the board has none."""
        return self._cpu.bus.xram()

    def sfr(self, address: int) -> int:
        """A special function register (80h..FFh; ports: their latch)."""
        return self._cpu.sfr(address)
