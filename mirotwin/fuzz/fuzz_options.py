"""The options of `mirotwin fuzz --bare`: any firmware with a serial port."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import click
import msgspec
from click.core import ParameterSource

from miro_robot.image import SPACE_BYTES, Image
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import Whole

Command = Callable[..., Any]
_ROBOTS_OWN = ("robots", "slot", "checks")
_BARE = "--bare"


class BareAsked(msgspec.Struct, frozen=True, kw_only=True):
    """The options of a bare processor."""

    bare: bool
    crystal: int | None
    baud: int | None
    boot_ms: int | None
    protocol: str | None
    check: str | None
    check_all: bool


def bare_fuzz_options(command: Command) -> Command:
    """Gives the command these options."""
    words: tuple[tuple[str, dict[str, Any], str], ...] = (
        (_BARE, {"is_flag": True}, "Fuzz IMAGE.ihx on a bare processor instead: any 8051 firmware with a serial port."),
        ("--crystal", {"type": Whole(32_768, 100_000_000), "metavar": "HZ"},
         "With --bare: its crystal. Default 24000000."),
        ("--baud", {"type": Whole(50), "metavar": "RATE"},
         "With --bare: rate on RXD. Default: what the firmware sets."),
        ("--boot-ms", {"type": Whole(1, 60_000), "metavar": "MS"},
         "With --bare: time to start up, unless it sleeps earlier. Default 200."),
        ("--protocol", {"metavar": "NAME[:KEY=VALUE,..]"}, "With --bare: the format that makes frames of bodies."),
        ("--check", {"metavar": "NAME"},
         "With --bare: a check in Python that judges each input that found something new: by its name, or"
         " FILE.py:FUNCTION."),
        ("--check-all", {"is_flag": True}, "With --bare: --check judges each input, not only those that are new."),
    )  # fmt: skip
    for name, settings, text in reversed(words):
        command = click.option(name, help=text, **settings)(command)
    return command


def take_bare_fuzz(given: dict[str, Any]) -> BareAsked:
    """Takes these options out of a command's arguments. Raises UsageError for some that do not go together."""
    asked = BareAsked(**{name: given.pop(name) for name in BareAsked.__struct_fields__})
    context = click.get_current_context()
    foreign = _ROBOTS_OWN if asked.bare else BareAsked.__struct_fields__
    for param in context.command.params:
        typed = context.get_parameter_source(f"{param.name}") is ParameterSource.COMMANDLINE
        if typed and param.name in foreign:
            raise click.UsageError(
                f"{param.opts[0]} does not go {'with' if asked.bare else 'without'} {_BARE}."
            )
    return asked


def load_bare_firmware(path: str | None) -> Image:
    """The image of --bare, of any size that fits into a processor. Raises UsageError without one."""
    if path is None:
        raise click.UsageError(f"{_BARE} needs an IMAGE.ihx.")
    return load_firmware(path, SPACE_BYTES)


def bare_spec(image: str, kind: str, engine: Literal["compiled", "python"], asked: BareAsked) -> TargetSpec:
    """What the processes of the engine run."""
    if asked.check_all and asked.check is None:
        raise click.UsageError("--check-all needs a --check.")
    parameters = {"crystal_hz": asked.crystal, "boot_ms": asked.boot_ms}
    return TargetSpec(
        board="bare",
        image=image,
        input=kind,
        protocol=asked.protocol or "",
        check=(asked.check or "") if asked.check_all else "",
        baud=asked.baud or 0,
        parameters={name: value for name, value in parameters.items() if value is not None},
        engine=engine,
    )
