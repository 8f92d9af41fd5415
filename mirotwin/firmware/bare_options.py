"""Options of an image on the bare processor or on a board, which `fw run` and the other `fw` commands share."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable
from enum import StrEnum
from typing import Annotated

import msgspec

from miro_exact.bad_input import BadInput, amount
from miro_exact.inputs import TEXT_BYTES, decode, read_input
from miro_robot.board_spec import CRYSTAL_HZ, BoardSpec
from miro_robot.empty_board import EmptyBoard
from miro_robot.faults import FirmwareFault
from miro_robot.image import FLASH_BYTES, SPACE_BYTES, Image
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_file import load_board
from miro_sim.scenario.terminal import InputPiece, PinEvent, TerminalSpec, read_pins
from miro_sim.world.terminal import Terminal
from miro_sim.world.wire import Wire
from miro_sim.world.world import World
from mirotwin.firmware.code_place import address_of, check_code_at, place_of
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.command import Option, Options, Word
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import BAUD, BOARD, IMAGE, NAME, StackFrom, Whole
from mirotwin.shell.program import complain
from mirotwin.shell.times import Time, TimeType
from mirotwin.shell.verdicts import exit_code

STDIN = "-"
FAULTS_LISTED = 100
_SCON, _NINE_BITS = 0x98, 0x80


def code_size(word: str) -> int:
    """A number of bytes up to 64 KB, or of KB with a k."""
    match = re.fullmatch(r"(\d{1,5})([kK]?)", word)
    size = int(match[1]) << (10 if match[2] else 0) if match else 0
    if not 1 <= size <= SPACE_BYTES:
        raise ValueError(f"{word!r} is no size of a program; give bytes or KB, up to 64k.")
    return size


CRYSTAL = Option(
    "--crystal",
    type=Whole(32_768, 100_000_000),
    metavar="HZ",
    help="Crystal frequency; a tick is one period, a machine cycle 12. Default 24000000; a board has its own.",
)


class BareOptions(Options, frozen=True, kw_only=True):
    """The options for a bare processor, or for the board of a board file."""

    HEADING = "Image on the bare processor, or on a board"

    board: Annotated[
        str | None,
        BOARD.saying(
            "Board on which the image runs: a NAME.board.toml, or one of `mirotwin boards`. Default: the bare"
            " processor with 64 KB of external RAM.",
        ),
    ] = None
    until: Annotated[
        str | None,
        Option(
            metavar="SYMBOL|ADDRESS", help="Stop before the instruction at this address (0x..) or symbol."
        ),
    ] = None
    max_cycles: Annotated[
        int | None, Option(type=Whole(1), metavar="N", help="Stop after N machine cycles, with exit code 42.")
    ] = None
    stdin: Annotated[
        tuple[str, ...],
        Option(
            type=NAME,
            metavar="FILE|-",
            help="File of bytes for the serial port, sent without a pause once its receiver is on; may be repeated,"
            " files are sent in order.",
        ),
    ] = ()
    stdin_when: Annotated[
        tuple[str, ...],
        Option(
            metavar="TEXT",
            help="Send --stdin when the program has sent TEXT. One for each --stdin, or for each but the first.",
        ),
    ] = ()
    stdin_by_line: Annotated[
        bool, Option(help="Send one line of --stdin each time the program has sent TEXT.")
    ] = False
    stdin_after: Annotated[
        tuple[Time, ...],
        Option(
            type=TimeType(),
            help="Delay of --stdin after the start, or after its TEXT, such as 200ms. Repeated, one for each --stdin:"
            " without a TEXT it counts from the end of the file before.",
        ),
    ] = ()
    stdin_gap: Annotated[
        Time | None,
        Option(type=TimeType(), help="Shortest pause between two characters of --stdin. Default 0."),
    ] = None
    stdin_wait: Annotated[
        bool,
        Option(help="Send each character of --stdin only when the program has taken the one before."),
    ] = False
    baud: Annotated[
        int | None,
        BAUD.saying(
            "Bit rate of --stdin. Default: that of the receiver. Needed by programs that measure the bit rate."
        ),
    ] = None
    pins: Annotated[
        str | None,
        Option(
            type=NAME,
            metavar="FILE",
            help="Levels for port pins: lines TICK * P1.0 0|1 in order of time, such as 4ms * P3.2 0.",
        ),
    ] = None
    go_on: Annotated[
        bool, Option(help="Continue after firmware faults; list them at the end, with exit code 3.")
    ] = False
    start: Annotated[
        str | None,
        Option(
            metavar="SYMBOL|ADDRESS", help="Begin there instead of at 0x0000, as after a jump by a monitor."
        ),
    ] = None
    crystal: Annotated[int | None, CRYSTAL] = None
    code_size: Annotated[
        int | None,
        Option(
            type=Word("SIZE", code_size),
            help="Program memory, up to 64k; external RAM stays separate. Default 8k.",
            heading=IMAGE,
        ),
    ] = None
    code_in_xram: Annotated[
        bool,
        Option(
            help="EA low: program and data share 64 KB of RAM, so that data may overwrite the program.",
            heading=IMAGE,
        ),
    ] = False
    stack_from: StackFrom = None

    @property
    def files(self) -> tuple[str | None, ...]:
        """The input files, which must not be written."""
        return (*(path for path in self.stdin if path != STDIN), self.pins, self.board)


def load_bare_image(path: str, options: BareOptions, named: bool = True) -> Image:
    """Raises BadInput for an image that does not fit, and, if it has to be `named`, for symbols of another one."""
    if options.code_in_xram and options.code_size is not None:
        raise BadInput(
            "", "--code-size", "program and data share 64 KB with --code-in-xram", "leave one of the two out"
        )
    whole = options.code_in_xram or options.board is not None
    limit = options.code_size or (SPACE_BYTES if whole else FLASH_BYTES)
    return load_firmware(path, limit, named, options.stack_from)


def target_of(path: str, image: Image, options: BareOptions) -> int | None:
    """The address of --until. Raises BadInput."""
    if options.until is None:
        return None
    address = address_of(options.until, image, path, "--until")
    if not options.code_in_xram:  # where the program may write it
        check_code_at(address, image, path, "--until")
    return address


class Ended(StrEnum):
    """Why a run ended."""

    UNTIL = "until"  # the requested address is next
    CYCLES = "cycles"  # the limit is reached
    FAULT = "fault"
    PAUSED = "paused"  # it can go on
    HALTED = "halted"  # nothing can ever make it go on: a jump to itself or asleep, with no interrupt to come


def make_world(
    image: Image,
    options: BareOptions,
    until: int | None = None,
    output: Callable[[bytes], object] | None = None,
    live: bool = False,
    seed: int = 0,
) -> World:
    """A world of one board, from the options. `output` gets the bytes that it sends; `seed`: of the noise of its parts.

    Raises BadInput, and errors of the files read.
    """
    board = msgspec.structs.replace(_board(options), start=_start(image, options))
    hz = board.crystal_hz
    pieces, pins = _pieces(options, hz), _pins(options, hz)
    gap_ticks = 0 if options.stdin_gap is None else options.stdin_gap.ticks(hz)
    terminal = TerminalSpec(
        pieces=pieces,
        baud=options.baud or board.baud or None,
        gap_ticks=gap_ticks,
        wait=options.stdin_wait,
        live=live,
        pins=pins,
    )
    scenario = BoardScenario(
        board=board,
        stop_on_fault=not options.go_on,
        stop_at=() if until is None else (until,),
        stop_at_end=True,
        terminal=terminal,
    )
    try:
        world = RunSpec(scenario=scenario, image=image, seed=seed).world()
    except ValueError as error:
        raise BadInput(
            "", "", f"--{error}" if str(error).startswith("baud") else f"--pins: {error}"
        ) from None
    wire_of(world).output = output
    return world


def wire_of(world: World) -> Wire:
    """The wire of a world of one board."""
    wire = world.lines[0]
    assert isinstance(wire, Wire)
    return wire


def board_of(world: World) -> EmptyBoard:
    """The board of a world of one board."""
    return wire_of(world).board


def terminal_of(world: World) -> Terminal:
    """The terminal at the end of the board's serial wire."""
    terminal = wire_of(world).terminal
    assert terminal is not None
    return terminal


def has_terminal(world: World) -> bool:
    """True if the world is a single image whose serial input comes from the command line."""
    line = world.lines[0]
    return isinstance(line, Wire) and line.terminal is not None


def ended(world: World, max_cycles: int | None) -> Ended:
    """The reason why a world of one board has stopped."""
    board = board_of(world)
    if not world.stopped:
        return Ended.PAUSED if max_cycles is None or board.cpu.cycles < max_cycles else Ended.CYCLES
    if board.fault_count and board.stop_on_fault:
        return Ended.FAULT
    return Ended.HALTED if board.ended else Ended.UNTIL


def _board(options: BareOptions) -> BoardSpec:
    """The board of --board, or the bare processor. Raises BadInput for a board that cannot be, or cannot have this."""
    if options.board is None:
        return BoardSpec(crystal_hz=options.crystal or CRYSTAL_HZ, code_in_xram=options.code_in_xram)
    for option in options.given("crystal", "code_in_xram", "pins"):
        remedy = "put a button or a strap there" if option == "--pins" else "change the board file"
        raise BadInput(options.board, "", f"is a board, {option} does not apply to it", remedy)
    return load_board(options.board)


def _start(image: Image, options: BareOptions) -> int:
    """The first instruction. Raises BadInput for a program that has none there."""
    start = 0 if options.start is None else address_of(options.start, image, f"{image.path}", "--start")
    if not any(first <= start < end for first, end in image.used):
        first = image.used[0][0]
        place = "the processor starts there" if options.start is None else "--start names it"
        remedy = (
            f"give --start {first:#06x}, where it begins, or the monitor that jumps there as a second image"
        )
        raise BadInput(image.path, "", f"has no byte at {start:#06x}, and {place}", remedy)
    return start


def _alike(faults: Iterable[FirmwareFault]) -> list[list[FirmwareFault]]:
    """Faults grouped by kind and instruction: a loop has thousands."""
    places: dict[tuple[int, int, str], list[FirmwareFault]] = {}
    for fault in faults:
        places.setdefault((fault.kind, fault.pc, fault.detail), []).append(fault)
    return list(places.values())


def report(world: World, options: BareOptions) -> int:
    """Reports on stderr why a run ended early; returns the exit code."""
    board, serial, why = board_of(world), terminal_of(world).input, ended(world, options.max_cycles)
    verdict = "passed"
    left = board.fault_count
    for alike in _alike(board.faults)[:FAULTS_LISTED]:
        complain(f"firmware fault: {alike[0]}{f' (and {len(alike) - 1} like it)' if alike[1:] else ''}")
        left -= len(alike)
    if left:
        complain(f"firmware faults: {left} more are not listed")
    if why is Ended.CYCLES:
        complain(f"stopped at the limit, at {stopped_at(world)}")
        verdict = "limit"
    elif why is Ended.HALTED:
        complain(f"the program ended at {stopped_at(world)}; no interrupt can wake it")
        verdict = "passed" if options.until is None else "failed"
    if (board.faults or why in (Ended.CYCLES, Ended.HALTED)) and world.image.symbols.problem:
        complain(f"addresses have no names: {world.image.symbols.problem}")
    complain(*world.devices[0].notes())
    waiting = serial.waiting_for
    unsent = amount(serial.left, "byte of --stdin was", "bytes of --stdin were")
    if waiting:
        times = serial.seen[waiting]
        outcome = f"was not seen again after {amount(times, 'time')}" if times else "was not seen"
        complain(f"--stdin-when: {waiting!r} {outcome}; {unsent} not sent")
    elif serial.left and not serial.live and why is not Ended.UNTIL:
        reason = (
            "the run ended first" if serial.char_end else "the receiver was never on, and no --baud is given"
        )
        complain(f"{unsent} not sent: {reason}")
    if options.stdin and board.cpu.sfr(_SCON) & _NINE_BITS:
        complain("--stdin: the serial port takes characters of 9 bits; the ninth was 1 in all that were sent")
    changed = board.changed_code()
    if changed:
        complain(
            f"--code-in-xram: the program has overwritten {amount(len(changed), 'byte')} of its image, "
            f"the first at {changed[0]:#06x}"
        )
    return exit_code(verdict, *("fault" for _ in board.faults))


def stopped_at(world: World) -> str:
    """The place and time of the stop, as text."""
    cpu = board_of(world).cpu
    return f"{place_of(cpu.pc, world.image)} after {amount(cpu.cycles, 'machine cycle')}"


def _pieces(options: BareOptions, crystal_hz: int) -> tuple[InputPiece, ...]:
    """The pieces of --stdin and their conditions, in order."""
    texts = [text.encode(errors="surrogateescape") for text in options.stdin_when]
    files = len(options.stdin)
    if not files:
        for name in options.given("stdin_when", "stdin_by_line", "stdin_after", "stdin_gap", "stdin_wait"):
            raise BadInput("", name, "has no effect without --stdin", "give both")
    if b"" in texts:
        raise BadInput("", "--stdin-when", "the text is empty", "give text that the program sends")
    if options.stdin.count(STDIN) > 1:
        raise BadInput(
            "", "--stdin", "standard input can be read only once", "name a file instead of the second -"
        )
    if texts and len(texts) not in (files, files - 1):
        raise BadInput(
            "",
            "--stdin-when",
            f"{len(texts)} for {files} --stdin",
            "give one for each --stdin, or for each but the first",
        )
    if options.stdin_by_line and not texts:
        raise BadInput("", "--stdin-by-line", "has no effect without --stdin-when", "give that too")
    whens = [b""] * (files - len(texts)) + texts
    pieces: list[InputPiece] = []
    for path, when, delay in zip(options.stdin, whens, _delays(whens, options, crystal_hz), strict=True):
        data = _stdin_bytes(path)
        parts = data.splitlines(keepends=True) if options.stdin_by_line and when else [data]
        pieces += [InputPiece(part, when, delay) for part in parts]
    return tuple(pieces)


def _delays(whens: list[bytes], options: BareOptions, crystal_hz: int) -> list[int | None]:
    """The delay of each --stdin: its own, or the only one for the first and for all that wait for a text."""
    after = [time.ticks(crystal_hz) for time in options.stdin_after]
    if len(after) not in (0, 1, len(whens)):
        reason = f"{len(after)} for {len(whens)} --stdin"
        raise BadInput("", "--stdin-after", reason, "give one for all, or one for each --stdin")
    if len(after) == 1:
        return [after[0] if when or not index else None for index, when in enumerate(whens)]
    return list(after) or [None] * len(whens)


def _stdin_bytes(path: str) -> bytes:
    if path != STDIN:
        return read_input(path)
    if vars(sys)["stdin"] is None:
        raise BadInput("", "--stdin", "standard input is closed", "name a file")
    data = sys.stdin.buffer.read(TEXT_BYTES + 1)
    if len(data) > TEXT_BYTES:
        raise BadInput("", "--stdin", f"standard input holds more than {TEXT_BYTES >> 20} MiB", "give less")
    return data


def _pins(options: BareOptions, hz: int) -> tuple[PinEvent, ...]:
    if options.pins is None:
        return ()
    return read_pins(decode(read_input(options.pins)), options.pins, hz)
