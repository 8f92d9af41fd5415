"""`mirotwin decode`: the frames in the bytes of a file, and the damage between them."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from typing import Annotated

import click

from miro_exact.bad_input import one_line
from miro_protocol.table import ROBOT_COUNTS
from miro_protocol.transmission import DOWN, UP, Transmission
from mirotwin.recording.capture import render
from mirotwin.recording.capture.detect import FORMATS, NAMES, detect
from mirotwin.recording.capture.input import Input
from mirotwin.recording.capture.layout import Layouts, look
from mirotwin.recording.capture.rows import DecodedRow, rows
from mirotwin.recording.capture.source import READ_ERRORS, Source, open_source
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.options import JSON, NAME, QUIET, Engine
from mirotwin.shell.program import complain
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import DONE

DIRECTIONS = {"down": DOWN, "up": UP}


FORMAT = Option(
    "--format", type=click.Choice(FORMATS), help="Format of FILE. Default: recognized by its first bytes."
)
ROBOTS = Option(
    "--robots",
    type=click.Choice([str(count) for count in ROBOT_COUNTS]),
    help="Robots in the network. Default: as FILE says, else the number with which more frames can be decoded.",
)


class DecodeOptions(Options, frozen=True, kw_only=True):
    COMMAND = "decode"
    file: Annotated[str, Argument("FILE|-", NAME)]
    format: Annotated[str | None, FORMAT] = None
    robots: Annotated[str | None, ROBOTS] = None
    direction: Annotated[
        str | None,
        Option(
            type=click.Choice([*DIRECTIONS]),
            help="Direction of raw bytes and hex text: down to the robots (default, unless they decode as telemetry),"
            " or up.",
        ),
    ] = None
    as_json: Annotated[bool, JSON.saying("One JSON object per line, for programs.")] = False
    quiet: Annotated[bool, QUIET.saying("No progress bar.")] = False
    engine: Engine = None


@command_of(DecodeOptions)
def decode(options: DecodeOptions) -> int:
    """Decodes FILE (standard input for -) and prints one line a frame or damaged run of bytes.

    FILE may be hex text, raw bytes, a pcapng capture of a serial line, a recording (run.mcap) or a stream file; its
    first bytes tell which, and the first line printed says so. Any bytes can be decoded. A capture that is cut
    short or damaged is reported with the offset, after everything before it, and the exit code is 2.
    """
    format, robots, direction = options.format, options.robots, options.direction
    with Input(options.file) as given:
        if format is None:
            format, note = detect(given.peek())
            if note:
                complain(f"{given.label}: {note} (--format says otherwise)")
        source = open_source(given, format, complain, DIRECTIONS[direction or "down"])
        layouts = look(source, None if robots is None else int(robots), complain, direction is None)
        with ProgressBar("decoding", given.size, options.quiet or sys.stdout.isatty()) as bar:
            decoded = rows(_counted(source.sent, given, bar), layouts.of)
            return _print(given, source, layouts, decoded, options.as_json)


def _counted(sent: Iterable[Transmission], given: Input, bar: ProgressBar) -> Iterator[Transmission]:
    """Moves the progress bar; for input without a size (a pipe), flushes the lines printed so far."""
    for transmission in sent:
        yield transmission
        if given.size is None:
            sys.stdout.flush()
        else:
            bar.to(given.position)


def _print(
    given: Input, source: Source, layouts: Layouts, decoded: Iterable[DecodedRow], as_json: bool
) -> int:
    def put(line: object) -> None:
        sys.stdout.write(f"{line}\n")

    if as_json:
        head = {"file": given.label, "format": source.format, "timed": source.timed}
        put(render.json_event("input", **head, units=render.UNITS))
    else:
        put(f"{one_line(given.label)}: {NAMES[source.format]}{layouts}")
        put(render.units_line())
        put(render.head_line(source.timed))
    totals, line_of = render.Totals(), render.json_line if as_json else render.table_line
    try:
        for row in decoded:
            totals.add(row)
            put(line_of(row, source.timed))
    except READ_ERRORS as error:
        if as_json:
            put(render.json_event("error", text=str(error)))
        raise
    finally:
        put(render.json_event("end", **totals.as_dict()) if as_json else totals)
    return DONE
