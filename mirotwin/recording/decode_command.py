"""`mirotwin decode`: the frames in the bytes of a file, and the damage between them."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from typing import Annotated

import click

from miro_exact.bad_input import one_line
from miro_protocol.table import ROBOT_COUNTS
from miro_protocol.transmission import Transmission
from mirotwin.recording.capture import render
from mirotwin.recording.capture.input import Input
from mirotwin.recording.capture.layout import Layouts, look
from mirotwin.recording.capture.options import CaptureOptions
from mirotwin.recording.capture.rows import DecodedRow, rows
from mirotwin.recording.capture.source import READ_ERRORS, Source, open_capture
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.options import JSON, NAME, QUIET, Engine
from mirotwin.shell.program import complain
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import DONE

ROBOTS = Option(
    "--robots",
    type=click.Choice([str(count) for count in ROBOT_COUNTS]),
    help="Robots in the network. Default: as FILE says, else the number with which more frames can be decoded.",
)


class DecodeOptions(Options, frozen=True, kw_only=True):
    COMMAND = "decode"
    file: Annotated[str, Argument("FILE|-", NAME)]
    robots: Annotated[str | None, ROBOTS] = None
    as_json: Annotated[bool, JSON.saying("One JSON object per line, for programs.")] = False
    quiet: Annotated[bool, QUIET.saying("No progress bar.")] = False
    capture: CaptureOptions = CaptureOptions()
    engine: Engine = None


@command_of(DecodeOptions)
def decode(options: DecodeOptions) -> int:
    """Decodes FILE (standard input for -) and prints one line a frame or damaged run of bytes.

    FILE may be a recording (run.mcap), a stream file, or a capture of a serial line by another tool: pcapng, pcap,
    tables and sessions of logic analysers, logs of hex digits, dumps, raw bytes. The format is detected from its
    beginning and reported on stderr. A capture that is cut short or damaged is reported with the place, after
    everything before it, and the exit code is 2.
    """
    with Input(options.file) as given:
        source = open_capture(given, complain, options.capture)
        layouts = look(source, None if options.robots is None else int(options.robots), complain)
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
        head = {"file": given.label, "format": source.form.name, "timed": source.timed}
        put(render.json_event("input", **head, units=render.UNITS))
    else:
        put(f"{one_line(given.label)}: {source.form.title}{layouts}")
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
