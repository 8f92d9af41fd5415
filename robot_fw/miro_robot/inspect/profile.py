"""The profile of one CPU, as data."""

from __future__ import annotations

import msgspec

from miro_robot.image import Image
from miro_robot.inspect.counters import Activity, Counters, InterruptProfile
from miro_robot.inspect.stack_depth import StackReader
from miro_robot.inspect.symbol_names import SymbolNames


class FunctionProfile(msgspec.Struct, frozen=True):
    """Machine cycles spent in the function itself; `calls`: how often its first instruction ran."""

    name: str
    address: int
    calls: int
    instructions: int
    cycles: int


class StackProfile(msgspec.Struct, frozen=True):
    """`first`: where the linker begins the stack (None: not known), or the instruction `source`, if that is not empty;
    `highest`: the last byte it reached.

    `last`: what lies above belongs to others. `free`: bytes between. `at_least`: bytes that the code itself can take,
    by the functions `deepest`; `unknown`: what of the code could not be followed.
    """

    first: int | None
    last: int
    highest: int
    highest_tick: int
    free: int
    at_least: int
    deepest: list[str]
    unknown: list[str]
    source: str


class Profile(msgspec.Struct, frozen=True):
    """`asleep_cycles` of `cycles` were spent in idle mode or power-down. Functions by cycles, most first."""

    cycles: int
    asleep_cycles: int
    instructions: int
    functions: list[FunctionProfile]
    interrupts: list[InterruptProfile]
    stack: StackProfile


def profile(image: Image, counters: Counters, activity: Activity) -> Profile:
    """The profile of a CPU that ran `image` under both watchers."""
    names = SymbolNames(image)
    by_function: dict[int, list[int]] = {}
    for address in counters.addresses():
        row = by_function.setdefault(names.function(address)[0], [0, 0])
        row[0] += counters.executed_at(address)
        row[1] += counters.cycles_at(address)
    functions = [
        FunctionProfile(names.place(first), first, counters.executed_at(first), executed, spent)
        for first, (executed, spent) in by_function.items()
    ]
    first_address, last = image.symbols.stack
    depth = StackReader(image).all()
    return Profile(
        cycles=activity.cycles,
        asleep_cycles=activity.asleep_cycles,
        instructions=sum(function.instructions for function in functions),
        functions=sorted(functions, key=lambda function: (-function.cycles, function.address)),
        interrupts=activity.interrupts,
        stack=StackProfile(
            first=first_address or None,
            last=last,
            source=image.symbols.stack_source,
            highest=activity.highest_sp,
            highest_tick=activity.highest_sp_tick,
            free=max(0, last - activity.highest_sp),
            at_least=depth.size,
            deepest=[names.place(address) for address in depth.main.path],
            unknown=sorted(depth.unknown),
        ),
    )
