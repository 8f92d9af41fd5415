"""Options that say how two runs are compared, for `replay` and `diff`, and what they come to."""

from __future__ import annotations

import functools
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import click
import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from mirotwin.recording.compare import (
    KINDS,
    WITHIN_COUNTS,
    WITHIN_COUNTS_PER_SAMPLE,
    WITHIN_TICKS,
    Kind,
    Rule,
)
from mirotwin.shell.options import Number, Whole
from mirotwin.shell.times import Time, TimeType

_MS = TICKS_PER_SECOND // 1000
APPLIES = {
    "within_ms": ("bytes", "commands"),
    "within_counts": ("wheels",),
    "within_counts_per_sample": ("wheels",),
}
"""A tolerance, and the comparisons that have it."""


class Asked(msgspec.Struct, frozen=True):
    """How to compare and what to tell; names as the options'. `given`: some of it was asked for by an option."""

    rule: Rule
    everything: bool
    as_json: bool
    given: str

    def described(self) -> str:
        """The comparison in words."""
        rule = self.rule
        if rule.kind in APPLIES["within_ms"]:
            return f"{rule.kind}, within {rule.within_ticks / _MS:g} ms"
        if rule.kind == "wheels":
            return f"wheels, within {rule.within_counts} counts and {rule.within_counts_per_sample:g} counts per sample"
        return rule.kind

    def rule_as_json(self) -> dict[str, Any]:
        rule = self.rule
        tolerances = {
            "within_ms": rule.within_ticks / _MS,
            "within_counts": rule.within_counts,
            "within_counts_per_sample": rule.within_counts_per_sample,
        }
        own = {name: value for name, value in tolerances.items() if rule.kind in APPLIES[name]}
        return {"compare": rule.kind, **own, "from_tick": rule.from_tick, "to_tick": rule.to_tick}


_OPTIONS: tuple[Callable[[Any], Any], ...] = (
    click.option("--compare", "kind", type=click.Choice(KINDS), default="bits", show_default=True,
                 help="bits: all that robots did. bytes: the characters the PC heard. commands: the commands of each"
                 " LM629. wheels: positions and desired velocities. The last three have tolerances."),
    click.option("--within-ms", type=Number(0, 1000), metavar="MS",
                 help=f"bytes, commands: how far apart in time. Default {WITHIN_TICKS / _MS:g}."),
    click.option("--within-counts", type=Whole(0, 1 << 30), metavar="COUNTS",
                 help=f"wheels: how far apart in position. Default {WITHIN_COUNTS}."),
    click.option("--within-counts-per-sample", type=Number(0, 1 << 14), metavar="COUNTS",
                 help=f"wheels: how far apart in desired velocity. Default {WITHIN_COUNTS_PER_SAMPLE:g}."),
    click.option("--from", "from_time", type=TimeType(), help="Compare from there on, such as 1.5s, 20ms or 48000t."),
    click.option("--to", "to_time", type=TimeType(), help="Stop there. Default: the end of the recording."),
    click.option("--all-differences", "all_differences", is_flag=True,
                 help="List every difference, not only the first of each channel."),
    click.option("--json", "as_json", is_flag=True, help="Print one JSON document instead of tables."),
)  # fmt: skip


def compare_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Gives a command these options, as one `asked`."""

    @functools.wraps(command)
    def gathered(**given: Any) -> Any:
        return command(asked=_taken(given), **given)

    with_options: Callable[..., Any] = gathered
    for option in reversed(_OPTIONS):
        with_options = option(with_options)
    return with_options


def _taken(given: dict[str, Any]) -> Asked:
    """Takes these options out of a command's arguments. Raises BadInput for those that do not go together."""
    kind: Kind = given.pop("kind")
    tolerances = {name: given.pop(name) for name in APPLIES}
    start, end = _ticks(given.pop("from_time")), _ticks(given.pop("to_time"))
    everything, as_json = given.pop("all_differences"), given.pop("as_json")
    used = [name for name, value in tolerances.items() if value is not None]
    for name in used:
        if kind not in APPLIES[name]:
            whose = " or ".join(f"--compare {each}" for each in APPLIES[name])
            raise BadInput("", _option(name), f"does not apply to --compare {kind}", f"give {whose} with it")
    if end is not None and end <= (start or 0):
        raise BadInput("", f"--from {start or 0}t --to {end}t", "the window is empty", "--to must be later")
    within_ms = tolerances["within_ms"]
    counts, per_sample = tolerances["within_counts"], tolerances["within_counts_per_sample"]
    rule = Rule(
        kind=kind,
        within_ticks=WITHIN_TICKS if within_ms is None else int(Fraction(within_ms) * _MS),
        within_counts=WITHIN_COUNTS if counts is None else counts,
        within_counts_per_sample=WITHIN_COUNTS_PER_SAMPLE if per_sample is None else per_sample,
        from_tick=start or 0,
        to_tick=end,
    )
    first = (
        _option(used[0]) if used else "--compare" if kind != "bits" else "--from" if start is not None else ""
    )
    return Asked(rule, everything, as_json, first or ("--all-differences" if everything else ""))


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _ticks(time: Time | None) -> int | None:
    return None if time is None else time.ticks(TICKS_PER_SECOND)
