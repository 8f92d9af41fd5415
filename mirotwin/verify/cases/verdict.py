"""What became of a case: whether the check that failed fails again, in words and as an exit code."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from mirotwin.shell.program import DIVERGENCE, DONE, EXPECTATION_FAILED, FIRMWARE_FAULT
from mirotwin.verify.checks.interface import Failure


class CaseVerdict(msgspec.Struct, frozen=True):
    """`code`: the exit code; `lines`: for people; `failure`: the check that failed, as recorded or otherwise."""

    code: int
    lines: tuple[str, ...]
    failure: Failure | None = None


def verdict_of(recorded: str, failures: Sequence[Failure], changed: bool, judged: bool = True) -> CaseVerdict:
    """From the line that was recorded ("" for none). `changed`: other firmware or settings ran than those of the case;
    `judged`: its check had an occasion.
    """
    name = recorded.partition(":")[0]
    if failures:
        same = [one for one in failures if str(one) == recorded]
        first = (same or failures)[0]
        lines = [f"fails as recorded: {first}" if same else f"still fails, but not as recorded: {first}"]
        if not recorded:
            lines = [f"fails: {first}"]
        elif not same:
            lines.append(f"recorded: {recorded}")
        return CaseVerdict(FIRMWARE_FAULT if first.fault else EXPECTATION_FAILED, tuple(lines), first)
    if not recorded:
        return CaseVerdict(DONE, ("passes",))
    if not judged:
        said = f"expectation not judged: the run had no occasion for it; recorded: {recorded}"
        return CaseVerdict(EXPECTATION_FAILED, (said,))
    if changed:
        return CaseVerdict(DONE, (f"cured: {name} passes; recorded: {recorded}",))
    return CaseVerdict(DIVERGENCE, (f"not reproduced: {name} passes; recorded: {recorded}",))
