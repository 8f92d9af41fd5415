"""`mirotwin fw sanitize`: what firmware does without noticing, such as variables that an interrupt may tear."""

from __future__ import annotations

from typing import Annotated

import click
import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.inputs import decode, read_input
from miro_robot.empty_board import EmptyBoard
from miro_robot.inspect.findings import KINDS, Finding, Reader
from miro_robot.inspect.sanitizer import Sanitizer
from miro_robot.inspect.sanitizer_layout import layout_of
from miro_robot.mcs51.chips import CHIPS
from mirotwin.firmware.subject import SubjectOptions, WindowOptions, look, open_window
from mirotwin.runs.inspected_run import InspectedRun
from mirotwin.shell.command import Option, command_of
from mirotwin.shell.debug_files import with_debug_files
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.options import AT, JSON, NAME
from mirotwin.shell.program import complain, show_line
from mirotwin.shell.verdicts import VERDICTS, exit_code

REASON = "#"


class SanitizeOptions(WindowOptions, frozen=True, kw_only=True):
    COMMAND = "fw sanitize"
    kinds: Annotated[
        tuple[str, ...],
        Option(
            "--kind", type=click.Choice(tuple(KINDS)), help="Only findings of this kind; may be repeated."
        ),
    ] = ()
    allow: Annotated[
        str | None,
        Option(
            type=NAME, metavar="FILE", help="Findings that are meant: lines `race robot.c:77 stamp  # why`."
        ),
    ] = None
    as_json: Annotated[bool, JSON] = False


class _DebugLine(SubjectOptions, frozen=True, kw_only=True):
    """The subject as `mirotwin debug` takes it."""

    COMMAND = "debug"
    at: Annotated[str, AT] = ""


class Allowed(msgspec.Struct, frozen=True):
    """What a file allows: the beginning of a finding's key, with its reason and line."""

    key: str
    reason: str
    number: int


def read_allowed(path: str | None) -> list[Allowed]:
    """The lines of an --allow file. Raises BadInput for one without a reason, or of no kind."""
    allowed = []
    lines = [] if path is None else decode(read_input(path)).splitlines()
    for number, line in enumerate(lines, 1):
        words, _, reason = line.partition(REASON)
        key = " ".join(words.split())
        if not key:
            continue
        if key.partition(" ")[0] not in KINDS:
            kinds = ", ".join(KINDS)
            raise BadInput(
                f"{path}", f"line {number}", f"{key.partition(' ')[0]!r} is no kind", f"use {kinds}"
            )
        if not reason.strip():
            raise BadInput(
                f"{path}", f"line {number}", "says no reason", f"end it with {REASON} and why it is meant"
            )
        allowed.append(Allowed(key, reason.strip(), number))
    return allowed


def judged(
    findings: list[Finding], allowed: list[Allowed], kinds: tuple[str, ...] = ()
) -> tuple[list[Finding], list[Allowed]]:
    """The findings that nothing allows, and what is allowed and was not found."""
    wanted = [one for one in findings if not kinds or one.kind in kinds]
    fits = {one: [each for each in wanted if f"{each.key} ".startswith(f"{one.key} ")] for one in allowed}
    meant = {each.key for several in fits.values() for each in several}
    stale = [one for one in allowed if not fits[one] and (not kinds or one.key.partition(" ")[0] in kinds)]
    return [one for one in wanted if one.key not in meant], stale


def verdict_of(finding: Finding) -> str:
    """What happened is a fault of the firmware, what may is a failure."""
    return "fault" if finding.did else "failed"


def ram_of(run: InspectedRun) -> int:
    """Bytes of external RAM; -1 where other things answer to MOVX, or may."""
    board = run.device.board
    if (
        not isinstance(board, EmptyBoard)
        or board.spec.latches
        or board.spec.buffers
        or board.spec.code_in_xram
    ):
        return -1
    inner = CHIPS[board.spec.chip].xram_bytes if board.spec.xram == "internal" else 0
    return board.spec.xram_bytes if board.spec.xram == "external" else inner


@command_of(SanitizeOptions)
def sanitize(options: SanitizeOptions) -> int:
    """Runs SUBJECT and reports what its firmware does without noticing: variables torn by interrupts, and such.

    A finding is a line of C, the variable, and the line that comes between; "did" happened in this run, "may" needs
    another moment of an interrupt. The command below it stands there.

    Exit codes: 3 something happened, 1 something may, else that of the run.
    """
    allowed = read_allowed(options.allow)
    run = open_window(options)
    image = with_debug_files(run.image)
    layout = layout_of(image)
    if not layout.lines:
        complain(f"{image.path.name}: no .cdb beside it: races and overlays are not observable")
    sanitizer = Sanitizer(layout, ram_of(run))
    code = look(run, options, sanitizer)
    found, stale = judged(Reader(image, layout).findings(sanitizer), allowed, options.kinds)
    subject = {name: getattr(options, name) for name in SubjectOptions.__struct_fields__ if name != "engine"}
    lines = [_DebugLine(**subject, at=f"{one.tick}t").command_line() for one in found]
    for entry in stale:
        complain(
            f"{options.allow}:{entry.number}: {entry.key} was not found: take it out, or run what shows it"
        )
    if options.as_json:
        shown = [
            {**msgspec.structs.asdict(one), "debug": line} for one, line in zip(found, lines, strict=True)
        ]
        click.echo(json_bytes({"findings": shown, "not_found": [one.key for one in stale]}, indent=2))
    else:
        for one, line in zip(found, lines, strict=True):
            show_line(f"{one}")
            show_line(f"    {line}")
        if not found:
            show_line("nothing found")
    worst = exit_code(*map(verdict_of, found))
    return code if code == VERDICTS["fault"].code or not found else worst
