"""`mirotwin serve`: a live session, from its ports to its files."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from selectors import DefaultSelector
from typing import Annotated

from msgspec.structs import replace

from miro_sim.scenario.board_scenario import AnyText, BoardText, is_board, load_any
from miro_sim.scenario.file import LONGEST_S, builtin_names, for_session, lasting
from mirotwin.ports.put_lines import lines_of_stdin
from mirotwin.ports.serve_ports import PortOptions, open_ports
from mirotwin.ports.session import FASTEST, Pace, Session
from mirotwin.recording.recorder import source_of
from mirotwin.run.run_command import reported
from mirotwin.run.run_files import RunFiles
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.command import Option, Options, command_of
from mirotwin.shell.firmware_image import image_for
from mirotwin.shell.held_signals import held_signals
from mirotwin.shell.options import (
    OUT,
    QUIET,
    Engine,
    FiniteNumber,
    Firmware,
    ScenarioArgument,
    Seed,
    Settings,
    plain_parameters,
    refuse_steps,
)
from mirotwin.shell.outputs import FILES, KEPT, RECORDING, OutputFolder
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.shell.program import complain, show_line, tell_notes
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.times import Time, TimeType
from mirotwin.verify.checks.expect import expectations_in
from mirotwin.verify.expectations import Expected, as_settings

CASE = "case.stream"


class ServeOptions(Options, frozen=True, kw_only=True):
    COMMAND = "serve"
    scenario: ScenarioArgument
    ports: PortOptions = PortOptions()
    pace: Annotated[
        float,
        Option(
            type=FiniteNumber(0.0, FASTEST, min_open=True),
            help="Virtual seconds in a second of the wall clock.",
        ),
    ] = 1.0
    duration: Annotated[
        Time | None,
        Option(
            type=TimeType(positive=True, longest_s=LONGEST_S),
            help="Ends after so much virtual time, such as 30s. Default: a day.",
        ),
    ] = None
    once: Annotated[bool, Option(help="Ends when a client was there and none is left.")] = False
    out: Annotated[Path | None, OUT.saying("Folder for the files. Default: runs/SCENARIO-SEED-live.")] = None
    seed: Seed = 0
    settings: Settings = ()
    expected: Expected = ()
    firmware: Firmware = None
    plugins: PluginFiles = PluginFiles()
    engine: Engine = None
    quiet: Annotated[bool, QUIET.saying("Do not tell who comes and goes, and how late the world is.")] = False


@command_of(ServeOptions)
def serve(options: ServeOptions) -> int:
    """Runs SCENARIO in real time; your programs act as its PC. Each port is the serial port of the PC's radio, or of a
    PC that is wired to a board: SCENARIO may be that of a board, or a board file with --firmware.

    A line on stdout names each port, and `serving` follows. All ports may be used at once, each by one client: all
    receive the robots' answers, and all may send. For a port on another network than the first, give PORT@NETWORK or
    LINK@NETWORK.

    Lines on stdin act on a board's parts: `eyes.distance_cm = 30` puts a value, `lcd.text` shows one, `?` all of them.

    run.mcap and summary.json are those of `run`; `mirotwin replay run.mcap` sends the same bytes at the same ticks.
    Ctrl-C and SIGTERM leave run.part.mcap and summary.part.json with all control periods so far, and case.part.stream:
    the sent characters as text. A failed check leaves case.stream.

    Exit code 1: a check failed; 3: a firmware fault.
    """
    seed = options.seed
    options.plugins.bring()
    own, text = _texts(options)
    expected = expectations_in(own)
    tell_notes(text.notes)
    default = Path("runs") / f"{text.scenario.name}-{seed}-live"
    folder = OutputFolder(
        options.out or default, options.ports.force, (*FILES, CASE), ours=options.out is None
    )
    image = image_for(own, options.firmware)
    with plain_parameters(text.origin):
        run = Run.traced(replace(RunSpec.of(text, image, seed), expected=expected))
    run.is_session = True
    world = run.world
    run_files = RunFiles(folder, source_of(text, world), run, text.settings)

    def tell(line: str) -> None:
        if not options.quiet:
            complain(line)

    with (
        reported(run_files),
        plain_parameters(text.origin),
        held_signals() as hold,
        folder,
        DefaultSelector() as selector,
        open_ports(options.ports, world, selector, tell) as ports,
    ):
        for port in ports:
            show_line(f"{port.kind} {port.where}")
        show_line("serving")
        duration = options.duration
        end_tick = int(LONGEST_S * world.clock) if duration is None else duration.ticks(world.clock)
        puts = lines_of_stdin(world, selector, show_line, complain)
        pace = Pace(options.pace, world.clock)
        session = Session(world, pace, selector, ports, tell, end_tick, options.once, puts)
        run_files.move, run_files.live = session.run, session.live
        try:
            summary = run_files.fill(ProgressBar("serving", None, quiet=True), hold, None)
            if run.failures:
                _leave_case(folder, run)
        except BaseException:
            if world.index:
                folder.keep = (*KEPT, CASE)
                with suppress(OSError):  # a full disk, which is reported as what ended the session
                    _leave_case(folder, run)
            raise
        finally:
            live = session.live()
            behind = f"; by 20 ms or more for {live.late_s:.2f} s" if live.late_s else ""
            tell(f"at most {live.late_max_ms:.1f} ms behind the wall clock{behind}")
    tell(f"{summary.simulated_s:.2f} s are in {folder.path / RECORDING}")
    result = run.result()
    complain(*result.texts)
    return result.code


def _texts(options: ServeOptions) -> tuple[AnyText, AnyText]:
    """The scenario with checks for its own duration, and the same with the duration of the session."""
    source, settings = options.scenario, (*options.settings, *as_settings(options.expected))
    if source in builtin_names():
        own = for_session(source, settings)
        return own, lasting(own)
    day = f"duration_s={LONGEST_S!r}"
    read = load_any(source, (*settings, day) if is_board(source) else settings)
    if not isinstance(read, BoardText):
        return read, lasting(read)
    refuse_steps(read.scenario, read.origin)
    return read, load_any(source, (*settings, day))


def _leave_case(folder: OutputFolder, run: Run) -> None:
    """Writes the sent characters as a text file, with the failed check if there is one; `mirotwin replay` runs it
    again.
    """
    text = run.case() if run.failures else run.stream()
    folder.part(CASE).write_text(text, encoding="utf-8")
