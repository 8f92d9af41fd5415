"""Options of `replay` and `diff`: how two runs are compared."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Annotated, Any

import click

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import TICKS_PER_SECOND
from miro_sim.periods import Period
from mirotwin.desk.compare import ANSWERS
from mirotwin.recording.compare import (
    KINDS,
    WITHIN_COUNTS,
    WITHIN_COUNTS_PER_SAMPLE,
    WITHIN_TICKS,
    CompareRule,
    Kind,
)
from mirotwin.shell.command import Option, Options
from mirotwin.shell.options import FROM, JSON, TO, FiniteNumber, Whole
from mirotwin.shell.times import Time, window

_TICKS_PER_MS = TICKS_PER_SECOND // 1000
_APPLIES = {
    "within_ms": ("bytes", "commands", "answers"),
    "within_counts": ("wheels", "answers"),
    "within_counts_per_sample": ("wheels",),
}
"""A tolerance, and the comparisons that have it."""


def refuse_given(file: str, reason: str, given: Sequence[str]) -> None:
    """Raises BadInput for the first given option, because it does not apply here (`reason`)."""
    if given:
        raise BadInput(file, given[0], reason, "leave it out")


class CompareOptions(Options, frozen=True, kw_only=True):
    """Options of a comparison and of its output."""

    kind: Annotated[
        Kind,
        Option(
            "--compare",
            type=click.Choice(KINDS),
            help="bits: all that robots did. bytes: the characters the PC received. commands: those of each LM629."
            " wheels: positions and desired velocities. answers: what robots at a port answer, the only one there. All"
            " but the first have tolerances.",
        ),
    ] = "bits"
    within_ms: Annotated[
        float | None,
        Option(
            type=FiniteNumber(0, 1000),
            metavar="MS",
            help=f"bytes, commands, answers: how far apart in time. Default {WITHIN_TICKS / _TICKS_PER_MS:g},"
            f" of answers {ANSWERS.within_ticks / _TICKS_PER_MS:g}.",
        ),
    ] = None
    within_counts: Annotated[
        int | None,
        Option(
            type=Whole(0, 1 << 30),
            metavar="COUNTS",
            help=f"wheels, answers: how far apart in position. Default {WITHIN_COUNTS}.",
        ),
    ] = None
    within_counts_per_sample: Annotated[
        float | None,
        Option(
            type=FiniteNumber(0, 1 << 14),
            metavar="COUNTS",
            help=f"wheels: how far apart in desired velocity. Default {WITHIN_COUNTS_PER_SAMPLE:g}.",
        ),
    ] = None
    from_time: Annotated[Time | None, FROM.saying("Compare from there on, such as 1.5s, 20ms or 48000t.")] = (
        None
    )
    to_time: Annotated[Time | None, TO.saying("Stop there. Default: the end of the recording.")] = None
    as_json: Annotated[bool, JSON] = False

    def refuse(self) -> None:
        """Raises BadInput for options that do not go together."""
        for name, kinds in _APPLIES.items():
            for option in self.given(name):
                if self.kind not in kinds:
                    whose = " or ".join(f"--compare {each}" for each in kinds)
                    reason = f"does not apply to --compare {self.kind}"
                    raise BadInput("", option, reason, f"give {whose} with it")
        window(self.from_time, self.to_time)

    def rule(self, clock: int = TICKS_PER_SECOND) -> CompareRule:
        """The rule of comparison from these options, for worlds with `clock` ticks per second."""
        ms, counts, per_sample = self.within_ms, self.within_counts, self.within_counts_per_sample
        from_tick, to_tick = window(self.from_time, self.to_time, clock)
        usual_ticks = ANSWERS.within_ticks if self.kind == "answers" else WITHIN_TICKS
        within_s = Fraction(usual_ticks, TICKS_PER_SECOND) if ms is None else Fraction(ms) / 1000
        return CompareRule(
            kind=self.kind,
            clock=clock,
            within_ticks=int(within_s * clock),
            within_counts=WITHIN_COUNTS if counts is None else counts,
            within_counts_per_sample=WITHIN_COUNTS_PER_SAMPLE if per_sample is None else per_sample,
            from_tick=from_tick,
            to_tick=to_tick,
        )

    def refuse_of_robots(self, file: str) -> None:
        """Raises BadInput for a comparison that needs robots, where `file` is for a board alone."""
        if self.kind not in ("bits", "bytes"):
            reason = f"is for robots, and {file} is for a board alone"
            raise BadInput("", f"--compare {self.kind}", reason, "compare bits or bytes")

    def of_answers(self, file: str) -> CompareRule:
        """The comparison of robots at a port. Raises BadInput for one that cannot be made there."""
        kind = self.given("kind") if self.kind != "answers" else []
        window = self.given("from_time", "to_time")
        for option in (*window, *kind):
            remedy = "leave it out" if option in window else "use --compare answers"
            raise BadInput(file, option, "is not for what was recorded at a port", remedy)
        return self.rule() if self.kind == "answers" else ANSWERS


def check_reaches(rule: CompareRule, file: str, recorded: Sequence[Period]) -> None:
    """Raises BadInput for a window that begins after the end of the recording, or ends at or before its begin."""
    first, last = recorded[0], recorded[-1]
    end_tick = last.tick + rule.period_ticks
    if rule.from_tick >= end_tick:
        reason = f"the recording ends at tick {end_tick}"
        raise BadInput(file, f"--from {rule.from_tick}t", reason, "look earlier")
    if rule.to_tick is not None and rule.to_tick <= first.tick:
        reason = f"the run begins at tick {first.tick}"
        raise BadInput(file, f"--to {rule.to_tick}t", reason, "look later")


def extent(rule: CompareRule, periods: Sequence[Period]) -> str:
    """The compared part and the rule as text: `all 6 control periods (commands, within 0.5 ms)`."""
    whole = f"all {amount(rule.compared(periods), 'control period')}"
    if rule.kind in _APPLIES["within_ms"]:
        return f"{whole} ({rule.kind}, within {1000 * rule.within_ticks / rule.clock:.4g} ms)"
    if rule.kind == "wheels":
        per_sample = f"{rule.within_counts_per_sample:g} counts per sample"
        return f"{whole} (wheels, within {rule.within_counts} counts and {per_sample})"
    return whole


def rule_as_json(rule: CompareRule) -> dict[str, Any]:
    """With its own tolerances only."""
    tolerances = {
        "within_ms": 1000 * rule.within_ticks / rule.clock,
        "within_counts": rule.within_counts,
        "within_counts_per_sample": rule.within_counts_per_sample,
    }
    own = {name: value for name, value in tolerances.items() if rule.kind in _APPLIES[name]}
    return {"compare": rule.kind, **own, "from_tick": rule.from_tick, "to_tick": rule.to_tick}
