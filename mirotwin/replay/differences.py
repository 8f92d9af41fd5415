"""What `replay` and `diff` say of the differences they found: lines, tables and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click
import msgspec
from rich.table import Table

from miro_exact.clock import seconds
from mirotwin.recording.difference import WORDS, Difference, first_per_channel, shown
from mirotwin.replay.builds import VariableDifference
from mirotwin.replay.firmwares import FirmwareDifference
from mirotwin.replay.instructions import InstructionDifference
from mirotwin.shell.console import show
from mirotwin.shell.program import complain

LISTED = 5
"""Variables and registers that are named in a line."""


def print_differences(found: Sequence[Difference], everything: bool, words: tuple[str, str] = WORDS) -> None:
    """The first difference of each channel, or all of them."""
    rows = [(one, 1) for one in found] if everything else first_per_channel(found)
    table = Table(box=None, pad_edge=False)
    for name in ("period", "tick", "t [s]"):
        table.add_column(name, justify="right")
    table.add_column("channel", no_wrap=True)
    for word in words:
        table.add_column(word, overflow="fold")
    if not everything:
        table.add_column("in all", justify="right")
    for one, count in rows:
        place = (str(one.period), str(one.tick), f"{seconds(one.tick):.6f}", one.topic)
        counted = () if everything else (str(count),)
        table.add_row(*place, *one.values(), *counted)
    show(table)
    if len(rows) < len(found):
        channels = "channel" if len(rows) == 1 else "channels"
        show(f"{len(found)} differences in {len(rows)} {channels}; --all lists them")


def print_firmwares(found: FirmwareDifference, words: tuple[str, str] = WORDS) -> None:
    """Lines on stderr: where two firmwares go apart."""
    if found.changed is not None:
        _print_instruction("the first changed instruction that is executed", found.changed, words)
    if found.mapped is not None:
        _print_instruction("the first changed instruction that is executed", found.mapped, words)
    if found.effect is not None and found.effect != found.changed:
        _print_instruction("the states differ for good from here on", found.effect, words)
    if found.effect is not None and found.effect.parted is not None:
        complain(f"they go on at different places after {found.effect.parted}")
    for one in found.variables[:LISTED]:
        _print_variable(one, words)
    if len(found.variables) > LISTED:
        complain(f"{len(found.variables) - LISTED} more variables differ; --json lists them")
    for note in found.notes:
        complain(note)


def _print_instruction(what: str, found: InstructionDifference, words: tuple[str, str]) -> None:
    complain(f"{what}: net{found.network}/robot{found.slot}: {words[0]} {found.one}")
    if (found.one.pc, found.one.text) != (found.other.pc, found.other.text):
        complain(f"  {words[1]} {found.other}")
    values = [
        f"{one.path}: {words[0]} {shown(one.one)}, {words[1]} {shown(one.other)}" for one in found.values
    ]
    if values:
        more = f"; {len(values) - LISTED} more" if len(values) > LISTED else ""
        complain(f"  behind it {'; '.join(values[:LISTED])}{more}")


def _print_variable(found: VariableDifference, words: tuple[str, str]) -> None:
    place = f"net{found.network}/robot{found.slot}: {found.name}"
    at = f"tick {found.tick} ({seconds(found.tick):.6f} s)"
    complain(f"from {at} on {place} differs: {words[0]} {found.one}, {words[1]} {found.other}")
    for word, writer in zip(words, found.writers, strict=True):
        if writer is not None:
            complain(f"  {word}: written at {writer}")


def differences_as_json(
    found: Sequence[Difference], everything: bool, words: tuple[str, str] = WORDS
) -> dict[str, Any]:
    """`count`, `first`, `channels` (the first of each, with `count`), and `differences` if all are wanted."""
    listed = {"differences": [one.as_json(words) for one in found]} if everything else {}
    return {
        "count": len(found),
        "first": found[0].as_json(words) if found else None,
        "channels": [{**one.as_json(words), "count": count} for one, count in first_per_channel(found)],
        **listed,
    }


def print_json(document: dict[str, Any]) -> None:
    click.echo(msgspec.json.format(msgspec.json.encode(document), indent=2))
