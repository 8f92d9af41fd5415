"""`mirotwin fuzz --bare`: any firmware with a serial port, and its cases."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click
import msgspec
from click.core import ParameterSource

from miro_exact.bad_input import BadInput
from miro_robot.image import SPACE_BYTES, Image
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.shell.console import show
from mirotwin.shell.options import Whole, load_image
from mirotwin.shell.program import DIVERGENCE, complain

if TYPE_CHECKING:
    from mirotwin.fuzz.bare_oracle import BareProcessorOracle

Command = Callable[..., Any]
_ROBOTS_OWN = ("robots", "slot")
_BARE = "--bare"


class BareAsked(msgspec.Struct, frozen=True, kw_only=True):
    """The options of a bare processor."""

    bare: bool
    crystal: int | None
    baud: int | None
    boot_ms: int | None
    protocol: str | None
    expect_all: bool


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
        ("--expect-all", {"is_flag": True}, "With --bare: --expect judges each input, not only those that are new."),
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
    return load_image(path, SPACE_BYTES)


def bare_spec(
    image: str, kind: str, engine: Literal["compiled", "python"], asked: BareAsked, checks: tuple[str, ...]
) -> TargetSpec:
    """What the processes of the engine run."""
    if len(checks) > 1:
        raise click.UsageError(f"{_BARE} takes one --expect.")
    if asked.expect_all and not checks:
        raise click.UsageError("--expect-all needs an --expect.")
    parameters = {"crystal_hz": asked.crystal, "boot_ms": asked.boot_ms}
    return TargetSpec(
        board="bare",
        image=image,
        input=kind,
        protocol=asked.protocol or "",
        check=checks[0] if asked.expect_all else "",
        baud=asked.baud or 0,
        parameters={name: value for name, value in parameters.items() if value is not None},
        engine=engine,
    )


def bare_seeds(spec: TargetSpec) -> list[bytes]:
    """Inputs to begin with. Raises BadInput for a firmware or options with which there is no target."""
    from mirotwin.fuzz.bare import bare_target

    return bare_target(spec).seeds()


def bare_oracle(checks: tuple[str, ...]) -> tuple[BareProcessorOracle, dict[str, Any]]:
    """Who confirms crashes, and what new inputs are judged by. Raises BadInput for a check that there is not."""
    from mirotwin.fuzz.bare_oracle import BareProcessorOracle
    from mirotwin.verify.bare.exchange import check_named

    if not checks:
        return BareProcessorOracle(), {}
    check = check_named(checks[0])
    return BareProcessorOracle(check), {check.name: True}


def replay_bare_case(path: str, firmware: str | None, checks: tuple[str, ...]) -> int:
    """`mirotwin replay` of such a file; the exit code is that of its check. Raises BadInput without --firmware.

    `checks`: those of --expect, at most one, for a case that names one that is in a file.
    """
    from mirotwin.verify.bare.case import replay_bare

    if firmware is None:
        remedy = "give --firmware IMAGE.ihx"
        raise BadInput(path, "", "is for a bare processor, which has no firmware of its own", remedy)
    if len(checks) > 1:
        raise BadInput(path, "--expect", "a case of a bare processor has one check", "give one")
    verdict = replay_bare(path, load_image(firmware, SPACE_BYTES), checks[0] if checks else None)
    if verdict.failed or verdict.code == DIVERGENCE:
        complain(verdict.line)
    else:
        show(verdict.line)
    return verdict.code


def check_given(path: Path, checks: tuple[str, ...]) -> str | None:
    """The one of --expect that a case names, if any."""
    from mirotwin.verify.bare.case import check_of_case

    named = check_of_case(path)
    return next((text for text in checks if text.rpartition(":")[2] == named), None)


def problem_of_bare_case(path: Path, image: Image, check: str | None) -> str:
    """Why a case fails on `image`, or the empty string. `check`: as of --expect, for a case that names it."""
    from mirotwin.verify.bare.case import replay_bare

    verdict = replay_bare(path, image, check)
    return verdict.line if verdict.failed else ""
