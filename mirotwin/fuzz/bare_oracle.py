"""Crashes on a bare processor, tried once more from power-on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from miro_protocol.actions import ScriptItem
from mirotwin.fuzz.bare import BareTarget
from mirotwin.fuzz.oracle import OracleVerdict
from mirotwin.fuzz.target import Target, TargetFailure
from mirotwin.verify.bare.case import NEVER_SLEEPS, NO_FAULT, case_text, failure_of
from mirotwin.verify.bare.exchange import NamedCheck
from mirotwin.verify.bare.run import AHEAD_TICKS, BareRun


class BareProcessorOracle:
    """Has the last word on inputs of a `BareTarget`: plays them from power-on. `check` judges where it is asked to."""

    def __init__(self, check: NamedCheck | None = None) -> None:
        self.check = check

    def confirm(self, target: Target, data: bytes, failure: TargetFailure) -> OracleVerdict:
        """Whether the failure comes again. Raises BadInput where the check fails itself."""
        assert isinstance(target, BareTarget)
        heard = target.script(data)
        check = self.check if failure.check not in (NO_FAULT, NEVER_SLEEPS) else None
        behind = AHEAD_TICKS if failure.check == NO_FAULT else 0  # the instruction itself
        return _judged(target, heard, failure.check, check, failure.tick + behind)

    def judged(self, target: Target, data: bytes, expected: Mapping[str, Any]) -> OracleVerdict:
        """What the check of this oracle says of an input, and whether there is a fault."""
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
) -> OracleVerdict:
    failure = failure_of(BareRun(target.image, target.line, heard, tick), name, check)
    if failure is None:
        return OracleVerdict(None)
    return OracleVerdict(
        failure, case_text(target.image, target.line, heard, max(tick, failure.tick), failure)
    )
