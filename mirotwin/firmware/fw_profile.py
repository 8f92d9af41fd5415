"""`mirotwin fw profile` and `fw coverage`: where the processor spends its time, and which lines ran."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

from miro_exact.bad_input import BadInput, amount
from miro_robot.inspect.counters import Activity, Counters
from miro_robot.inspect.coverage import counts_of
from miro_robot.inspect.lcov import Tracefile, add
from miro_robot.inspect.profile import Profile
from miro_robot.inspect.profile import profile as profile_of
from mirotwin.firmware.coverage_files import (
    collect,
    has_listing,
    is_of_another_image,
    listing_path,
    read_tracefile,
    table,
    write,
)
from mirotwin.firmware.subject import WindowOptions, look, open_window
from mirotwin.shell.command import Option, command_of
from mirotwin.shell.console import plain_table, show
from mirotwin.shell.debug_files import SourceFolders, source_folders, with_debug_files
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.options import FORCE, JSON, OUT
from mirotwin.shell.outputs import check_new


class ProfileOptions(WindowOptions, frozen=True, kw_only=True):
    COMMAND = "fw profile"
    as_json: Annotated[bool, JSON.saying("As JSON, for programs.")] = False


@command_of(ProfileOptions)
def profile(options: ProfileOptions) -> int:
    """Shows cycles by function, interrupts with their worst cases, the share of idling, and the depth of the stack.

    A machine cycle is 12 periods of the crystal: 0.5 us at 24 MHz. A function's cycles are its own, without those of
    what it calls. The latency of an interrupt is counted from the cycle in which its flag is latched to the first one
    of its routine: 3 at least.
    """
    run = open_window(options)

    image = with_debug_files(run.image)
    counters, activity = Counters(), Activity()
    code = look(run, options, counters, activity)
    result = profile_of(image, counters, activity)
    if options.as_json:
        click.echo(json_bytes(result, indent=2))
    else:
        _print(result, run.image.path.name)
    return code


def _print(result: Profile, name: str) -> None:
    awake = result.cycles - result.asleep_cycles
    show(
        f"{name}: {amount(result.cycles, 'machine cycle')}, {amount(result.instructions, 'instruction')}, "
        f"asleep {_percent(result.asleep_cycles, result.cycles)}"
    )
    counts = ("address", "calls", "instructions", "cycles", "of awake", "of all")
    functions = plain_table("function", right=counts)
    for function in result.functions:
        functions.add_row(
            function.name,
            f"{function.address:#06x}",
            str(function.calls),
            str(function.instructions),
            str(function.cycles),
            _percent(function.cycles, awake),
            _percent(function.cycles, result.cycles),
        )
    show(functions)
    worst = ("count", "worst latency", "at tick", "worst duration", "at tick", "of all")
    interrupts = plain_table("interrupt", right=worst)
    for interrupt in result.interrupts:
        if interrupt.count:
            interrupts.add_row(
                interrupt.source,
                str(interrupt.count),
                amount(interrupt.worst_latency, "cycle"),
                str(interrupt.worst_latency_tick),
                "never left" if interrupt.never_left else amount(interrupt.worst_duration, "cycle"),
                str(interrupt.unfinished_tick if interrupt.never_left else interrupt.worst_duration_tick),
                _percent(interrupt.total_cycles, result.cycles),
            )
    if interrupts.row_count:
        show(interrupts)
    stack = result.stack
    source = f" ({stack.source})" if stack.source else ""
    begins = "" if stack.first is None else f"from {stack.first:02X}h{source}, "
    used = "" if stack.first is None else f"{amount(stack.highest - stack.first + 1, 'byte')} used, "
    show(
        f"stack: {begins}highest {stack.highest:02X}h at tick {stack.highest_tick}: "
        + f"{used}{amount(stack.free, 'byte')} free"
        + ("" if stack.last == 0xFF else f" below the data at {stack.last + 1:02X}h")
    )
    unknown = f"; not followed: {', '.join(stack.unknown)}" if stack.unknown else ""
    show(
        f"stack by the code: at least {amount(stack.at_least, 'byte')}, in {' > '.join(stack.deepest)}{unknown}"
    )
    room = stack.last - stack.first + 1 if stack.first is not None else None
    if room is not None and stack.at_least > room:
        show(f"the stack has {amount(room, 'byte')}: it can run out by {stack.at_least - room}")


def _percent(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.1f} %" if whole else "-"


class CoverageOptions(WindowOptions, frozen=True, kw_only=True):
    COMMAND = "fw coverage"
    out: Annotated[
        Path | None, OUT.saying("Write an lcov tracefile (genhtml, CI services).", metavar="FILE.info")
    ] = None
    append: Annotated[bool, Option(help="Add the counts to the file at --out.", apart="force")] = False
    force: Annotated[bool, FORCE.saying("Replace the file at --out, and its listing.")] = False
    sources: SourceFolders = ()


@command_of(CoverageOptions)
def coverage(options: CoverageOptions) -> int:
    """Shows which C lines, branches and instructions ran in SUBJECT, and writes them as an lcov tracefile.

    For an image without debug files the lines are those of its listing, written beside FILE.info as FILE.info.lst.
    """
    out, append = options.out, options.append
    total: Tracefile = {}
    if out is not None:
        _check(out, options, append or options.force)
        total = read_tracefile(out) if append else {}
    run = open_window(options)

    image = with_debug_files(run.image)
    if out is not None and has_listing(image):
        _check(listing_path(out), options, append or options.force)
    counters = Counters()
    folders = source_folders(image, options.sources)
    code = look(run, options, counters)
    report = collect(image, counts_of(counters), folders, out)
    if append and out is not None and is_of_another_image(report, out):
        raise BadInput(
            listing_path(out),
            "",
            "is the listing of another image",
            "name another file with --out, or use --force",
        )
    add(total, report.tracefile)
    if out is not None:
        write(total, report, out, "--out")
    show(table(total))
    show(f"instructions of this run: {report.instructions}")
    return code


def _check(path: Path, options: WindowOptions, may_be_there: bool) -> None:
    check_new(path, "--out", may_be_there, *options.files, more="add to it with --append, ")
