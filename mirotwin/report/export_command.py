"""`mirotwin export`: the characters of a run, or all of it, as a file for other programs."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Annotated

import click

from miro_exact.bad_input import BadInput, amount
from miro_exact.inputs import check_memory
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import check_single
from mirotwin.recording.capture import render
from mirotwin.recording.capture.detect import NAMES, TIMED, detect
from mirotwin.recording.capture.input import STDIN, Input
from mirotwin.recording.capture.layout import look
from mirotwin.recording.capture.source import READ_ERRORS, open_source
from mirotwin.recording.decode_command import FORMAT
from mirotwin.report.board_export import HEAD_BYTES, board_csv, board_stream, is_of_board
from mirotwin.runs.job import load_job
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.console import show
from mirotwin.shell.options import FIRMWARE, FORCE, NAME, NETWORK, OUT, QUIET, Engine
from mirotwin.shell.outputs import check_new, whole_file
from mirotwin.shell.part_files import Parts, bring_parts
from mirotwin.shell.program import complain
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import BAD_INPUT, DONE


def export_foxglove(given: Input, format: str, out: str, quiet: bool) -> int:
    """Writes what `given` holds with Foxglove's topics to `out`; returns the exit code. Raises BadInput."""
    if format != "recording":
        reason = f"{NAMES[format]}, which holds no postures"
        raise BadInput(given.label, "", reason, "give a run.mcap that `mirotwin run` wrote")
    from mirotwin.report.foxglove.convert import Conversion  # loads most of the package

    if given.size is not None:
        check_memory(given.label, given.size)
    made = BytesIO()
    conversion = Conversion(b"".join(iter(given.read_some, b"")), given.label, made)
    _write(out, [made.getvalue()])
    for note in conversion.notes:
        complain(note)
    if not quiet and out != STDIN:
        frames = f" and {conversion.images} camera frames" if conversion.images else ""
        show(f"{out}: {amount(len(conversion.periods), 'control period')}{frames} for Foxglove")
    return DONE


DEFAULTS = {".csv": "csv", ".stream": "stream", ".txt": "stream", ".mcap": "foxglove"}
TARGETS = ("pcapng", "stream", "foxglove", "csv")


class Exported:
    """Hands transmissions on and counts them. What cannot be read ends them; `failure` if anything came before."""

    def __init__(
        self, sent: Iterator[Transmission], network: int | None, given: Input, bar: ProgressBar
    ) -> None:
        self.sent = sent
        self.network = network
        self.given = given
        self.bar = bar
        self.down = 0
        self.up = 0
        self.bad_stops = 0
        self.networks: set[int] = set()
        self.failure: Exception | None = None

    def __iter__(self) -> Iterator[Transmission]:
        try:
            for transmission in self.sent:
                self.networks.add(transmission.network)
                if self.network in (None, transmission.network):
                    self.down += transmission.direction == DOWN
                    self.up += transmission.direction != DOWN
                    self.bad_stops += len(transmission.bad_stop)
                    yield transmission
                self.bar.to(self.given.position)
        except READ_ERRORS as error:
            if not self.down + self.up:
                raise
            self.failure = error


class ExportOptions(Options, frozen=True, kw_only=True):
    COMMAND = "export"
    file: Annotated[str, Argument("FILE|-", NAME)]
    out: Annotated[str, OUT.saying("File to write, or - for standard output.", type=NAME)]
    target: Annotated[
        str | None,
        Option(
            "--as",
            type=click.Choice(TARGETS),
            help="What to write. Default, by ending: .stream, .txt stream; .mcap foxglove; .csv csv; else pcapng.",
        ),
    ] = None
    firmware: Annotated[str | None, FIRMWARE.saying("Stream of a board: its image, which runs for CSV.")] = (
        None
    )
    format: Annotated[str | None, FORMAT.saying(FORMAT.help, type=click.Choice(TIMED))] = None
    network: Annotated[int | None, NETWORK.saying("Only this network. Default: all.")] = None
    parts: Parts = ()
    force: Annotated[bool, FORCE] = False
    quiet: Annotated[bool, QUIET.saying("No progress bar and no closing line.")] = False
    engine: Engine = None


@command_of(ExportOptions)
def export(options: ExportOptions) -> int:
    """Writes the characters in FILE (a recording, a stream file or a pcapng capture) as pcapng or as a stream file, or
    a recording for Foxglove.

    pcapng is for Wireshark and tshark: one packet a transmission (characters without a pause), with virtual time,
    direction, and the network as interface; link type 250 (RTAC serial). A script for Wireshark shows the
    fields:

    \b
        mirotwin export run.mcap --out run.pcapng
        python -m miro_protocol.dissector > miro.lua
        tshark -X lua_script:miro.lua -d rtacser.data,miro -r run.pcapng -V

    A stream file is for `mirotwin replay`, for editors and for git; a capture does not hold stop bits, a stream file
    does. The same input gives the same bytes. Of an input that is cut short, all that could be read is written, and the
    exit code is 2. A run that was broken off (run.part.mcap) is written as far as it goes, with a note.

    For Foxglove, all that is in the recording is written again, with the scene, transforms, log and camera frames that
    Foxglove draws; `mirotwin examples foxglove` writes a layout for it:

    \b
        mirotwin export run.mcap --out foxglove.mcap

    The stream file of a board's run holds the board, what was put into its parts, and what it sent. As CSV it is run
    again: how all nets and values of parts stood, and each change, with its tick.
    """
    out, network, quiet = options.out, options.network, options.quiet
    if out != STDIN:
        check_new(Path(out), "--out", options.force, options.file)
    to = options.target or DEFAULTS.get(Path(out).suffix, "pcapng")
    if to == "foxglove" and network is not None:
        raise click.UsageError("--network does not go with --as foxglove, which writes all networks.")
    with Input(options.file) as given, ProgressBar("exporting", given.size, quiet) as bar:
        format = options.format or detect(given.peek())[0]
        if to == "foxglove":
            return export_foxglove(given, format, out, quiet)
        if to != "pcapng" and options.file != STDIN and is_of_board(given.peek(HEAD_BYTES), format):
            return export_board(options, to)
        if to == "csv":
            reason = f"CSV holds nets and values of a board, and no board is in it ({NAMES[format]})"
            if options.file == STDIN:
                reason = "CSV is made by running a board again, which takes a file"
            raise BadInput(given.label, "--as csv", reason, "give a file (not -) of a run of a board")
        if format not in TIMED:
            raise BadInput(
                given.label, "", f"{NAMES[format]} without times", "give a recording, stream or capture"
            )
        source = open_source(given, format, complain)
        layouts = look(source, None, complain) if to == "stream" else None
        exported = Exported(source.sent, network, given, bar)
        pieces = render.to_stream(exported, layouts.of) if layouts else render.to_pcapng(exported)
        with BadInput.at(given.label):
            _write(out, _some(pieces, exported, given.label))
    if not quiet and out != STDIN:
        show(f"{out}: {amount(exported.down, 'transmission')} from the host and {exported.up} from robots")
    if exported.bad_stops and to == "pcapng":
        complain(
            f"{exported.bad_stops} bad stop bits were left out: a capture holds none, a stream file does"
        )
    if exported.failure is not None:
        complain(f"error: {exported.failure}; everything before it was written")
        return BAD_INPUT
    return DONE


def export_board(options: ExportOptions, to: str) -> int:
    """Writes a run of a board; returns the exit code. Raises BadInput."""
    bring_parts(options.parts)
    job = load_job(options.file, options.firmware)
    complain(*job.notes)
    with ProgressBar("running it again", job.end_tick, options.quiet or to != "csv") as bar:
        pieces: Iterable[bytes]
        if to == "csv":
            if isinstance(job.spec.scenario, BoardScenario):
                check_single(job.spec.scenario, options.file, "CSV")
            pieces = board_csv(job, bar.to)
        else:
            pieces = [board_stream(job).encode()]
        _write(options.out, pieces)
    if not options.quiet and options.out != STDIN:
        line = f"; mirotwin replay {options.out} --firmware IMAGE plays it again" if to == "stream" else ""
        show(f"{options.out}: {job.end_tick / job.spec.scenario.clock:.3f} s of a board{line}")
    return DONE


def _some(pieces: Iterable[bytes], exported: Exported, label: str) -> Iterator[bytes]:
    """Passes `pieces` on. Raises BadInput for a requested network that is not there, before a file is replaced."""
    yield from pieces
    if exported.network is not None and not exported.down + exported.up and exported.failure is None:
        there = ", ".join(map(str, sorted(exported.networks))) or "none"
        raise BadInput(
            label,
            f"--network {exported.network}",
            "has no transmissions",
            f"networks that have some: {there}",
        )


def _write(out: str, pieces: Iterable[bytes]) -> None:
    if out == STDIN:
        for piece in pieces:
            sys.stdout.buffer.write(piece)
        return
    with whole_file(Path(out), "--out") as staging, staging.open("wb") as file:
        for piece in pieces:
            file.write(piece)
