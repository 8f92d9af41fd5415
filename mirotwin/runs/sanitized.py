"""Runs under the sanitizer: each that begins while a `Sanitized` is at work, and what is allowed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Annotated, Any

import click
import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.inputs import decode, read_input
from miro_robot.empty_board import EmptyBoard
from miro_robot.image import Image
from miro_robot.inspect.findings import KINDS, Finding, Reader
from miro_robot.inspect.sanitizer import Sanitizer
from miro_robot.inspect.sanitizer_layout import layout_of
from miro_robot.inspect.watcher import attach
from miro_robot.mcs51.chips import CHIPS
from miro_sim.world.device import Device
from miro_sim.world.world import World
from mirotwin.runs.result import Line
from mirotwin.runs.run import on_world
from mirotwin.shell.command import Option, Options
from mirotwin.shell.debug_files import with_debug_files
from mirotwin.shell.options import NAME

REASON = "#"
KIND = Option("--kind", type=click.Choice(tuple(KINDS)), help="Only findings of this kind; may be repeated.")
ALLOW = Option(
    "--allow",
    type=NAME,
    metavar="FILE",
    help="Findings that are meant: lines `race robot.c:77 stamp  # why`.",
)


class SanitizerOptions(Options, frozen=True, kw_only=True):
    """Options: watch a command's runs with the sanitizer, and the findings that count."""

    HEADING = "Sanitizer"
    sanitize: Annotated[
        bool, Option(help="Also find what the firmware does without noticing, as `fw sanitize` does.")
    ] = False
    kinds: Annotated[tuple[str, ...], KIND.saying(KIND.help, needs="sanitize")] = ()
    allow: Annotated[str | None, ALLOW.saying(ALLOW.help, needs="sanitize")] = None


class Allowed(msgspec.Struct, frozen=True):
    """An entry of an allow file: the beginning of a finding's key, with its reason and line."""

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
    findings: Sequence[Finding], allowed: Sequence[Allowed], kinds: Sequence[str] = ()
) -> tuple[list[Finding], list[Allowed]]:
    """The findings that nothing allows, and what is allowed and was not found."""
    wanted = [finding for finding in findings if not kinds or finding.kind in kinds]
    fits = {
        entry: [each for each in wanted if f"{each.key} ".startswith(f"{entry.key} ")] for entry in allowed
    }
    meant = {each.key for several in fits.values() for each in several}
    stale = [
        entry for entry in allowed if not fits[entry] and (not kinds or entry.key.partition(" ")[0] in kinds)
    ]
    return [finding for finding in wanted if finding.key not in meant], stale


def place_of(finding: Finding) -> dict[str, Any]:
    """The options of `mirotwin debug` that lead to it."""
    slot = None if finding.slot < 0 else finding.slot
    return {"network": finding.network or None, "slot": slot, "at": f"{finding.tick}t"}


def line_of(finding: Finding) -> Line:
    """The line of a finding: an observed one is a firmware fault, a possible one a failure."""
    return ("fault" if finding.did else "failed"), f"{finding}"


def stale_line(path: str | None, allowed: Allowed) -> str:
    return f"{path}:{allowed.number}: {allowed.key} was not found: take it out, or run what shows it"


def ram_of(device: Device) -> int:
    """Bytes of external RAM; -1 where other things answer to MOVX, or may."""
    board = device.board
    if (
        not isinstance(board, EmptyBoard)
        or board.spec.latches
        or board.spec.buffers
        or board.spec.code_in_xram
    ):
        return -1
    inner = CHIPS[board.spec.chip].xram_bytes if board.spec.xram == "internal" else 0
    return board.spec.xram_bytes if board.spec.xram == "external" else inner


class Sanitized:
    """Watches the processors of runs. `unseen`: images without debug files, of which races cannot be told."""

    def __init__(self) -> None:
        self.unseen: dict[str, None] = {}
        self._readers: dict[bytes, Reader] = {}
        self._pending: list[tuple[Reader, Sanitizer, int, int]] = []  # with the network and the slot
        self._found: dict[tuple[str, ...], Finding] = {}

    def watch(self, world: World) -> None:
        """From now on; what earlier runs showed is worked out, since a sanitizer takes 10 MB."""
        self._settle()
        for number, line in enumerate(world.lines):
            for index, device in enumerate(line.devices):
                reader = self._reader(device.image)
                sanitizer = Sanitizer(reader.layout, ram_of(device))
                attach(device.board.cpu, sanitizer).once.append(sanitizer)
                self._pending.append((reader, sanitizer, number, device.slot if index else -1))

    def take(self) -> list[Finding]:
        """Findings since the last call, one for each cause."""
        self._settle()
        findings, self._found = [*self._found.values()], {}
        return sorted(findings, key=lambda finding: (not finding.did, finding))

    def _settle(self) -> None:
        pending, self._pending = self._pending, []
        for reader, sanitizer, network, slot in pending:
            for finding in reader.findings(sanitizer):
                known = self._found.get(finding.cause)
                if known is None or (finding.did and not known.did):
                    self._found[finding.cause] = msgspec.structs.replace(finding, network=network, slot=slot)

    def _reader(self, image: Image) -> Reader:
        if image.code not in self._readers:
            known = with_debug_files(image)
            reader = self._readers[image.code] = Reader(known, layout_of(known))
            if reader.layout.unseen:
                self.unseen[f"{known.path.name}: {reader.layout.unseen}"] = None
        return self._readers[image.code]


@contextmanager
def sanitized(wanted: bool = True) -> Iterator[Sanitized]:
    """Runs that begin within are watched, if `wanted`."""
    watching = Sanitized()
    token = on_world.set(watching.watch if wanted else None)
    try:
        yield watching
    finally:
        on_world.reset(token)
