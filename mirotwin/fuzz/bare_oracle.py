"""Finds on a bare processor, tried once more from power-on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from miro_protocol.actions import ScriptItem
from mirotwin.fuzz.bare import BareTarget
from mirotwin.fuzz.oracle import Judgement
from mirotwin.fuzz.target import Finding, Target
from mirotwin.verify.bare.case import NEVER_SLEEPS, NO_FAULT, case_text, failure_of
from mirotwin.verify.bare.exchange import NamedCheck
from mirotwin.verify.bare.run import AHEAD_TICKS, BareRun


class BareCourt:
    """Has the last word on inputs of a `BareTarget`: plays them from power-on. `check` judges where it is asked to."""

    def __init__(self, check: NamedCheck | None = None) -> None:
        self.check = check

    def confirm(self, target: Target, data: bytes, finding: Finding) -> Judgement:
        """Whether the finding comes again. Raises BadInput where the check fails itself."""
        assert isinstance(target, BareTarget)
        heard = target.script(data)
        check = self.check if finding.check not in (NO_FAULT, NEVER_SLEEPS) else None
        behind = AHEAD_TICKS if finding.check == NO_FAULT else 0  # the instruction itself
        return _judged(target, heard, finding.check, check, finding.tick + behind)

    def judged(self, target: Target, data: bytes, expected: Mapping[str, Any]) -> Judgement:
        """What the check of this court says of an input, and whether there is a fault."""
        assert isinstance(target, BareTarget)
        target.run(data)
        heard, end_tick = target.script(data), target.end_tick()
        name = NO_FAULT if self.check is None else self.check.name
        return _judged(target, heard, name, self.check, end_tick)

    def stream(self, target: Target, data: bytes) -> str:
        assert isinstance(target, BareTarget)
        target.run(data)
        return case_text(target.image, target.line, target.script(data), target.end_tick())


def _judged(
    target: BareTarget, heard: Sequence[ScriptItem], name: str, check: NamedCheck | None, tick: int
) -> Judgement:
    failure = failure_of(BareRun(target.image, target.line, heard, tick), name, check)
    if failure is None:
        return Judgement(None)
    return Judgement(failure, case_text(target.image, target.line, heard, max(tick, failure.tick), failure))
