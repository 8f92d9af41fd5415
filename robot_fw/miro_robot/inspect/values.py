"""The values of a firmware's variables, by name and type: `read_value(cpu, image, "last_left")`."""

from __future__ import annotations

from typing import Any

from miro_exact.bad_input import BadInput
from miro_robot.image import Image
from miro_robot.image.c_types import bytes_of, value_of
from miro_robot.image.variables import Variable, find_variable
from miro_robot.inspect.writes import cpu_bit
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import byte_of_bit

_FIRST_SFR = 0x80
_XRAM_BYTES = 0x10000


def read_value(cpu: Cpu, image: Image, name: str, as_type: str = "") -> Any:
    """The present value of the variable `name`: int (pointers, too), float, bool, a list for an array, a dict for a
    struct.

    `name` and `as_type` as in `find_variable`. Ports are read at their latch. Raises BadInput for a name that is not
    there, and one in external RAM that the board lacks.
    """
    variable, variables = find_variable(image, name, as_type)
    return value_of(variable.type, bytes_at(cpu, image, variable), variables.fields(variable))


def write_value(cpu: Cpu, image: Image, name: str, value: Any, as_type: str = "") -> None:
    """Puts `value` into a variable in internal RAM, between two instructions; of a struct, the members that are named.

    Raises BadInput as `read_value`, for a value that does not fit, and for a variable elsewhere.
    """
    variable, variables = find_variable(image, name, as_type)
    before = bytes_at(cpu, image, variable)
    try:
        data = bytes_of(variable.type, value, before, variables.fields(variable))
    except ValueError as error:
        raise BadInput(image.path, name, str(error)) from None
    if variable.space == "bit" and variable.address < _FIRST_SFR:
        at, mask = byte_of_bit(variable.address), 1 << (variable.address & 7)
        cpu.poke_iram(at, cpu.peek_iram(at) & ~mask | (mask if data[0] & 1 else 0))
    elif variable.space == "iram":
        for offset, byte in enumerate(data):
            cpu.poke_iram(variable.address + offset, byte)
    else:
        problem = f"is in {variable.space}, not in internal RAM"
        raise BadInput(image.path, name, problem, "write it by firmware")


def bytes_at(cpu: Cpu, image: Image, variable: Variable) -> bytes:
    """The bytes of a variable, as many as its type has."""
    space, address = variable.space, variable.address
    if space == "bit":
        return bytes([cpu_bit(cpu, address)])
    places = range(address, address + variable.type.size)
    if space == "code":
        return bytes(cpu.code_at(place) for place in places)
    if space == "iram":
        return bytes(cpu.peek_iram(place) for place in places)
    if space == "sfr" and address >= _FIRST_SFR and places.stop <= 0x100:
        return bytes(cpu.sfr(place) for place in places)
    if space == "xram" and cpu.bus.HAS_XRAM and places.stop <= _XRAM_BYTES:
        return bytes(cpu.bus.movx_read(place, 0) for place in places)
    raise BadInput(image.path, variable.name, f"is in {space}: the board has no such memory")
