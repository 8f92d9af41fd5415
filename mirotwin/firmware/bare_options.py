"""Options of an image on the bare processor: `fw run` and the other `fw` commands have them in common."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from typing import Any

import click
import msgspec

from miro_exact import clock
from miro_exact.bad_input import BadInput
from miro_exact.inputs import TEXT_BYTES, read_input
from miro_robot.bare.input import Piece
from miro_robot.bare.machine import BareMachine, Ended
from miro_robot.bare.pins import PinEvent, read_pins
from miro_robot.image import Image
from mirotwin.firmware.code_place import FLASH_BYTES, SPACE_BYTES, address_of, place_of
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import STACK_FROM, STACK_FROM_HELP, Place, Whole
from mirotwin.shell.program import DONE, EXPECTATION_FAILED, FIRMWARE_FAULT, LIMIT_REACHED, complain
from mirotwin.shell.times import Time, TimeType

STDIN = "-"
_SCON, _NINE_BITS = 0x98, 0x80


class CodeSize(click.ParamType):  # type: ignore[type-arg, unused-ignore]
    """A number of bytes up to 64 KB, or of KB with a k."""

    name = "SIZE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        match = re.fullmatch(r"(\d{1,5})([kK]?)", str(value))
        size = int(match[1]) << (10 if match[2] else 0) if match else 0
        if not 1 <= size <= SPACE_BYTES:
            self.fail(f"{value!r} is no size of a program; give bytes or KB, up to 64k.", param, ctx)
        return size


class BareRequest(msgspec.Struct, frozen=True):
    """What the command line says about the bare processor; names as the options'."""

    until: str | None = None
    max_cycles: int | None = None
    stdin: tuple[str, ...] = ()
    stdin_when: tuple[str, ...] = ()
    stdin_by_line: bool = False
    stdin_after: Time | None = None
    stdin_gap: Time | None = None
    baud: int | None = None
    pins: str | None = None
    code_size: int | None = None
    code_in_xram: bool = False
    crystal: int | None = None
    stack_from: int | None = None
    start: str | None = None
    go_on: bool = False

    @property
    def crystal_hz(self) -> int:
        return self.crystal or clock.TICKS_PER_SECOND

    @property
    def files(self) -> tuple[str | None, ...]:
        """What is read, and so must not be written."""
        return (*(path for path in self.stdin if path != STDIN), self.pins)

    def given(self) -> list[str]:
        """The options that were used, as one writes them."""
        names = [name for name in self.__struct_fields__ if getattr(self, name) not in (None, False, ())]
        return [f"--{name.replace('_', '-')}" for name in names]


def bare_options(prefix: str = "") -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Gives a command these options; `prefix` begins their help, for commands that look into other things too."""
    words: tuple[tuple[str, dict[str, Any], str], ...] = (
        ("--until", {"metavar": "SYMBOL|ADDRESS"}, "Stop before the instruction at this address (0x..) or symbol."),
        ("--max-cycles", {"type": Whole(1), "metavar": "N"}, "Stop after N machine cycles, with exit code 42."),
        ("--stdin", {"type": Place(), "metavar": "FILE|-", "multiple": True},
         "File of bytes for the serial port, sent when the program listens; may be repeated, files are sent in order."),
        ("--stdin-when", {"metavar": "TEXT", "multiple": True},
         "Send --stdin when the program has sent TEXT. One for each --stdin, or for each but the first."),
        ("--stdin-by-line", {"is_flag": True}, "Send one line of --stdin each time the program has sent TEXT."),
        ("--stdin-after", {"type": TimeType()},
         "Delay of --stdin after the start, or after its TEXT, such as 200ms."),
        ("--stdin-gap", {"type": TimeType()}, "Shortest pause between two characters of --stdin. Default 0."),
        ("--baud", {"type": Whole(50)},
         "Bit rate of --stdin. Default: that of the receiver. Needed by programs that measure the bit rate."),
        ("--pins", {"type": Place(), "metavar": "FILE"},
         "Levels for port pins: lines TICK * P1.0 0|1 in order of time; # begins a comment."),
        ("--code-size", {"type": CodeSize()},
         "Program memory, up to 64k; external RAM stays separate. Default 8k."),
        ("--code-in-xram", {"is_flag": True},
         "EA low: program and data share 64 KB of RAM, so that data may overwrite the program."),
        ("--crystal", {"type": Whole(32_768, 100_000_000), "metavar": "HZ"},
         "Crystal frequency; a tick is one period, a machine cycle 12. Default 24000000."),
        ("--start", {"metavar": "SYMBOL|ADDRESS"}, "Begin there instead of at 0x0000, as after a jump by a monitor."),
        ("--stack-from", STACK_FROM, STACK_FROM_HELP),
        ("--go-on", {"is_flag": True}, "Continue after firmware faults; list them at the end, with exit code 3."),
    )  # fmt: skip

    def with_options(command: Callable[..., Any]) -> Callable[..., Any]:
        for name, settings, text in reversed(words):
            command = click.option(name, help=f"{prefix}{text}", **settings)(command)
        return command

    return with_options


def take_bare(given: dict[str, Any]) -> BareRequest:
    """Takes these options out of a command's arguments."""
    return BareRequest(**{name: given.pop(name) for name in BareRequest.__struct_fields__})


def load_bare_image(path: str, request: BareRequest, named: bool = True) -> Image:
    """Raises BadInput for an image that does not fit, and, if it has to be `named`, for symbols of another one."""
    if request.code_in_xram and request.code_size is not None:
        raise BadInput(
            "", "--code-size", "program and data share 64 KB with --code-in-xram", "leave one of the two out"
        )
    limit = SPACE_BYTES if request.code_in_xram else request.code_size or FLASH_BYTES
    return load_firmware(path, limit, named, request.stack_from)


def target_of(path: str, image: Image, request: BareRequest) -> int | None:
    """The address of --until. Raises BadInput."""
    return None if request.until is None else address_of(request.until, image, path, "--until")


def make_machine(
    image: Image,
    request: BareRequest,
    output: Callable[[bytes], object] | None = None,
    live: bool = False,
) -> BareMachine:
    """The machine that was asked for. Raises BadInput, and errors of the files read."""

    pieces = _pieces(request)
    pins = _pins(request)
    try:
        return BareMachine(
            image,
            code_in_xram=request.code_in_xram,
            stdin=pieces,
            baud=request.baud,
            output=output,
            stop_on_fault=not request.go_on,
            crystal_hz=request.crystal_hz,
            gap_ticks=_ticks(request.stdin_gap, request) or 0,
            live=live,
            pins=pins,
            start=_start(image, request),
        )
    except ValueError as error:
        raise BadInput(
            "", "", f"--{error}" if str(error).startswith("baud") else f"--pins: {error}"
        ) from None


def _start(image: Image, request: BareRequest) -> int:
    """The first instruction. Raises BadInput for a program that has none there."""
    start = 0 if request.start is None else address_of(request.start, image, f"{image.path}", "--start")
    if not any(first <= start < end for first, end in image.used):
        first = image.used[0][0]
        place = "the processor starts there" if request.start is None else "--start names it"
        remedy = (
            f"give --start {first:#06x}, where it begins, or the monitor that jumps there as a second image"
        )
        raise BadInput(image.path, "", f"has no byte at {start:#06x}, and {place}", remedy)
    return start


def report(machine: BareMachine, ended: Ended, request: BareRequest) -> int:
    """Says on stderr why a run ended that did not end as planned; returns the exit code."""

    code = DONE
    for fault in machine.faults:
        complain(f"firmware fault: {fault}")
    if machine.faults_lost:
        complain(f"firmware faults: {machine.faults_lost} more are not listed")
    if ended is Ended.CYCLES:
        complain(f"stopped at the limit, at {_stopped_at(machine)}")
        code = LIMIT_REACHED
    elif ended is Ended.HALTED:
        complain(f"the program ended at {_stopped_at(machine)}; no interrupt can wake it")
        code = DONE if request.until is None else EXPECTATION_FAILED
    if (machine.faults or ended in (Ended.CYCLES, Ended.HALTED)) and machine.image.symbols.problem:
        complain(f"addresses have no names: {machine.image.symbols.problem}")
    waiting = machine.input.waiting_for
    if waiting:
        seen = (
            f"was not seen again after {machine.input.seen} times" if machine.input.seen else "was not seen"
        )
        complain(f"--stdin-when: {waiting!r} {seen}; {machine.input.left} bytes of --stdin were not sent")
    if request.stdin and machine.cpu.sfr(_SCON) & _NINE_BITS:
        complain("--stdin: the serial port takes characters of 9 bits; the ninth was 1 in all that were sent")
    changed = machine.changed_code()
    if changed:
        complain(
            f"--code-in-xram: the program has overwritten {len(changed)} bytes of its image, "
            f"the first at {changed[0]:#06x}"
        )
    return FIRMWARE_FAULT if machine.faults else code


def _stopped_at(machine: BareMachine) -> str:
    return f"{place_of(machine.cpu.pc, machine.image)} after {machine.cpu.cycles} machine cycles"


def _ticks(time: Time | None, request: BareRequest) -> int | None:
    return None if time is None else time.ticks(request.crystal_hz)


def _pieces(request: BareRequest) -> tuple[Piece, ...]:
    """What --stdin and its conditions say, in order."""

    texts = [text.encode(errors="surrogateescape") for text in request.stdin_when]
    files = len(request.stdin)
    if not files:
        for name in ("--stdin-when", "--stdin-by-line", "--stdin-after", "--stdin-gap"):
            if name in request.given():
                raise BadInput("", name, "has no effect without --stdin", "give both")
    if b"" in texts:
        raise BadInput("", "--stdin-when", "the text is empty", "give text that the program sends")
    if request.stdin.count(STDIN) > 1:
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
    if request.stdin_by_line and not texts:
        raise BadInput("", "--stdin-by-line", "has no effect without --stdin-when", "give that too")
    delay = _ticks(request.stdin_after, request)
    pieces: list[Piece] = []
    for path, when in zip(request.stdin, [b""] * (files - len(texts)) + texts, strict=True):
        data = _stdin_bytes(path)
        parts = data.splitlines(keepends=True) if request.stdin_by_line and when else [data]
        pieces += [Piece(part, when, delay if when or not pieces else None) for part in parts]
    return tuple(pieces)


def _stdin_bytes(path: str) -> bytes:
    if path != STDIN:
        return read_input(path)
    if vars(sys)["stdin"] is None:
        raise BadInput("", "--stdin", "standard input is closed", "name a file")
    data = sys.stdin.buffer.read(TEXT_BYTES + 1)
    if len(data) > TEXT_BYTES:
        raise BadInput("", "--stdin", f"standard input holds more than {TEXT_BYTES >> 20} MiB", "give less")
    return data


def _pins(request: BareRequest) -> tuple[PinEvent, ...]:

    if request.pins is None:
        return ()
    return read_pins(read_input(request.pins).decode("utf-8", errors="replace"), request.pins)
