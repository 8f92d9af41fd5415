"""`mirotwin export`: the characters of a run, or all of it, as files for other programs."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Annotated

import click
from msgspec.structs import replace

from miro_exact.bad_input import BadInput, amount
from miro_exact.inputs import check_memory
from miro_protocol.actions import ScriptItem
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import check_single
from mirotwin.recording.capture import render
from mirotwin.recording.capture.forms import Form
from mirotwin.recording.capture.input import STDIN, Input
from mirotwin.recording.capture.layout import look
from mirotwin.recording.capture.options import CaptureOptions
from mirotwin.recording.capture.source import READ_ERRORS, form_of, timed_capture
from mirotwin.recording.reader import read
from mirotwin.report.board_export import HEAD_BYTES, board_rows, board_stream, is_of_board
from mirotwin.report.tables import Named, Tables, recorded_rows, wire_row
from mirotwin.runs.job import Job, load_job
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.console import show
from mirotwin.shell.options import FIRMWARE, FORCE, NAME, NETWORK, OUT, QUIET, Engine
from mirotwin.shell.outputs import RECORDINGS, check_new, file_in, whole_file
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.shell.program import complain
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import BAD_INPUT, DONE
from mirotwin.verify.cases.artifacts import CASES


def export_foxglove(given: Input, form: Form, out: str, quiet: bool) -> int:
    """Writes the content of `given` with Foxglove's topics to `out`; returns the exit code. Raises BadInput."""
    if form.name != "recording":
        reason = f"{form.title}, which holds no postures"
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


SUFFIXES = {".pcapng": "pcapng", ".stream": "stream", ".txt": "stream", ".mcap": "foxglove", ".csv": "csv"}
TARGETS = ("pcapng", "stream", "foxglove", "csv")


def target_of(out: str, target: str | None) -> str:
    """The form to write: `target`, else that of the suffix, and pcapng where there is none. Raises BadInput."""
    suffix = Path(out).suffix.lower()
    if target or suffix in SUFFIXES:
        return target or SUFFIXES[suffix]
    if suffix:
        waves = "; `mirotwin fw vcd` writes waveforms" if suffix == ".vcd" else ""
        reason = f"files that end in {suffix} are not written"
        raise BadInput("", f"--out {out}", reason, f"end it in {', '.join(SUFFIXES)}, or give --as{waves}")
    return "pcapng"


class Exported:
    """Passes transmissions on and counts them. Unreadable input ends them; `failure` is set if anything came before."""

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
    file: Annotated[str, Argument("RUN|FILE|-", NAME)]
    out: Annotated[str, OUT.saying("File to write, or - for standard output.", type=NAME)]
    target: Annotated[
        str | None,
        Option(
            "--as",
            type=click.Choice(TARGETS),
            help="What to write. Default, by suffix: .pcapng, .stream, .txt (stream), .mcap (foxglove), .csv; without"
            " one pcapng.",
        ),
    ] = None
    firmware: Annotated[str | None, FIRMWARE.saying("Stream of a board: its image, which runs for CSV.")] = (
        None
    )
    channel: Annotated[
        str | None,
        Option(metavar="CHANNEL", help="CSV: only this table, such as net0/robot0/truth, into --out itself."),
    ] = None
    network: Annotated[int | None, NETWORK.saying("Only this network. Default: all.")] = None
    plugins: PluginFiles = PluginFiles()
    capture: CaptureOptions = CaptureOptions()
    force: Annotated[bool, FORCE] = False
    quiet: Annotated[bool, QUIET.saying("No progress bar and no closing line.")] = False
    engine: Engine = None


@command_of(ExportOptions)
def export(options: ExportOptions) -> int:
    """Writes the characters in FILE as pcapng or as a stream file, all channels as CSV, or a recording for Foxglove.

    RUN is the folder of a run; FILE is a recording, a stream file, or a capture of any form that `mirotwin decode`
    reads; one without times needs --assume-contiguous.

    pcapng is for Wireshark and tshark: one packet a transmission (characters without a pause), with virtual time,
    direction, and the network as interface; link type 250 (RTAC serial). A script for Wireshark shows the
    fields:

    \b
        mirotwin export run.mcap --out run.pcapng
        python -m miro_protocol.dissector > miro.lua
        tshark -X lua_script:miro.lua -d rtacser.data,miro -r run.pcapng -V

    A stream file is for `mirotwin replay`, for editors and for git; a capture does not hold stop bits, a stream file
    does. The same input gives the same bytes. Of an input that is cut short, the readable part is written, and the exit
    code is 2. An interrupted run (run.part.mcap) is written to its end, with a note.

    For Foxglove, the content of the recording is written again, with the scene, transforms, log and camera frames that
    Foxglove draws; `mirotwin examples foxglove` writes a layout for it:

    \b
        mirotwin export run.mcap --out foxglove.mcap

    As CSV, each channel of a recording is a table of its own, with units in the names of its columns: run.csv stands
    for run-net0-robot0-truth.csv, run-net0-wire.csv and so on. A capture or a stream file is one table.

    \b
        mirotwin export run.mcap --out run.csv
        mirotwin export run.mcap --out truth.csv --channel net0/robot0/truth

    The stream file of a board's run contains the board, the values put into its parts, and its output. For CSV it is
    run again: the table `changes` has the first state of all nets and values of parts, and each change, with its tick.
    """
    options = replace(options, file=file_in(options.file, (*RECORDINGS, *CASES)))
    out, network, quiet = options.out, options.network, options.quiet
    to = "csv" if options.channel and out == STDIN else target_of(out, options.target)
    if to == "foxglove" and network is not None:
        raise click.UsageError("--network does not go with --as foxglove, which writes all networks.")
    if options.channel is not None and to != "csv":
        raise click.UsageError("--channel goes with --as csv only.")
    if out != STDIN and to != "csv":
        check_new(Path(out), "--out", options.force, options.file)
    with Input(options.file) as given, ProgressBar("exporting", given.size, quiet) as bar:
        form = form_of(given, options.capture, complain)
        if to == "foxglove":
            return export_foxglove(given, form, out, quiet)
        of_board = to != "pcapng" and is_of_board(given.peek(HEAD_BYTES), form.name)
        if to == "csv":
            if of_board and options.file == STDIN:
                raise BadInput(given.label, "--as csv", "a board is run again for it", "give a file, not -")
            return export_tables(options, given, form, bar, of_board)
        if of_board and options.file != STDIN:
            return export_board(options)
        source = timed_capture(given, complain, options.capture, form)
        layouts = look(source, None, complain) if to == "stream" else None
        exported = Exported(source.sent, network, given, bar)
        actions = _actions(options, form) if layouts else []
        pieces = (
            render.to_stream(exported, layouts.of, source, actions) if layouts else render.to_pcapng(exported)
        )
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


def _actions(options: ExportOptions, form: Form) -> list[ScriptItem]:
    """Resets, faults and other actions of a recording. From a pipe they cannot be read a second time."""
    if form.name != "recording" or options.file == STDIN:
        return []
    try:
        periods = read(options.file).periods
    except READ_ERRORS:
        return []  # the characters meet the same damage, and say so
    return [
        action for period in periods for action in period.actions if options.network in (None, action.network)
    ]


def export_tables(options: ExportOptions, given: Input, form: Form, bar: ProgressBar, of_board: bool) -> int:
    """Writes the readable part as CSV; returns the exit code. Raises BadInput."""
    recorded, only = form.name == "recording", options.channel
    only = only and only.strip("/")
    if options.out == STDIN and recorded and not only:
        remedy = "give --channel, such as net0/robot0/truth"
        raise BadInput(given.label, "--out -", "takes one table, and a recording is several", remedy)
    job = _board(options) if of_board else None
    failure: Exception | None = None
    with Tables(options.out, bool(only) or not recorded, only, options.force, options.file) as tables:
        try:
            for table, row in _rows(options, given, form, job):
                tables.add(table, row)
                bar.to(given.position)
        except READ_ERRORS as error:
            if not tables.rows:
                raise
            failure = error
        if not tables.rows:
            remedy = f"tables that have some: {', '.join(tables.passed_over) or 'none'}"
            raise BadInput(given.label, f"--channel {only}" if only else "--as csv", "has no rows", remedy)
    if not options.quiet and options.out != STDIN:
        more = f" and {len(tables.paths) - 1} more" if len(tables.paths) > 1 else ""
        show(f"{tables.paths[0]}{more}: {amount(tables.rows.total(), 'row')}")
    if failure is not None:
        complain(f"error: {failure}; everything before it was written")
        return BAD_INPUT
    return DONE


def _rows(options: ExportOptions, given: Input, form: Form, job: Job | None) -> Iterator[Named]:
    """The rows of a file; of a board's run, `job`, also its changes, for which it is run again."""
    if form.name == "recording":
        yield from recorded_rows(given, options.network)
    elif job is None:
        sent = timed_capture(given, complain, options.capture, form).sent
        yield from (
            wire_row(transmission) for transmission in sent if options.network in (None, transmission.network)
        )
    if job is not None:
        with ProgressBar("running it again", job.end_tick, options.quiet) as bar:
            yield from board_rows(job, bar.to)


def _board(options: ExportOptions) -> Job:
    options.plugins.bring()
    job = load_job(options.file, options.firmware)
    complain(*job.notes)
    if isinstance(job.spec.scenario, BoardScenario):
        check_single(job.spec.scenario, options.file, "CSV")
    return job


def export_board(options: ExportOptions) -> int:
    """Writes a run of a board as a stream file; returns the exit code. Raises BadInput."""
    options.plugins.bring()
    job = load_job(options.file, options.firmware)
    complain(*job.notes)
    _write(options.out, [board_stream(job).encode()])
    if not options.quiet and options.out != STDIN:
        line = f"mirotwin replay {options.out} --firmware IMAGE plays it again"
        show(f"{options.out}: {job.end_tick / job.spec.scenario.clock:.3f} s of a board; {line}")
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
