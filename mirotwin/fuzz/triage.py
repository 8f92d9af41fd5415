"""Triage of failed inputs: each is minimised, distinguished from the others, confirmed in a World, and written as
files.

Two crashes are the same where check and cause are. The cause of a fault is the instruction that went wrong first
(`cause.py`). If no instruction caused it (a missing answer, for example), the cause is the check's message without its
numbers. Further inputs of a known crash are only counted, and only the first few without a fault are examined: an easy
mistake fails thousands of inputs.
"""

from __future__ import annotations

import hashlib
import re
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from miro_robot.image.debug_info import Sources
from miro_robot.inspect.coverage import Counts
from mirotwin.firmware.coverage_files import Report, collect, write
from mirotwin.fuzz.cause import Cause
from mirotwin.fuzz.files import CampaignFolder
from mirotwin.fuzz.input_coverage import InputCoverage
from mirotwin.fuzz.oracle import Expected, Oracle
from mirotwin.fuzz.target import TargetFailure
from mirotwin.runs.run import Run
from mirotwin.verify.checks.interface import Failure

MINIMISE_S = 10.0
TRIES = 50_000
TRIES_IN_A_WORLD = 400
SAME_TRIED = 6
"""Number of inputs of one check and PC in a row that are examined although they give no new crash."""
CONFIRMED, UNCONFIRMED = "crashes", "unconfirmed"
_NUMBER = re.compile(r"0x[0-9a-fA-F]+|[0-9]+(\.[0-9]+)?")
_DIGITS = 6


class CrashKey(msgspec.Struct, frozen=True):
    """The key by which crashes differ. `reason`: of a check without an instruction, its message without numbers."""

    check: str
    cause: Cause | None
    reason: str

    @property
    def name(self) -> str:
        if self.cause is not None:
            return f"{self.check}-{self.cause.pc:04x}"
        return f"{self.check}-{hashlib.sha256(self.reason.encode()).hexdigest()[:_DIGITS]}"


class Crash(msgspec.Struct, frozen=True, kw_only=True):
    """A failure with its input. `verdict`: of the World, or of the target if it is not confirmed. `pc`: address of the
    instruction that caused it, in `function`, with the mistake in `cause`; None: no instruction caused it. `folder`:
    `crashes` or `unconfirmed`. `sizes`: bytes of the original and of the minimised input.
    """

    name: str
    check: str
    pc: int | None
    cause: str
    function: str
    verdict: str
    folder: str
    sizes: tuple[int, int]
    fault: bool = False

    @property
    def confirmed(self) -> bool:
        return self.folder == CONFIRMED


@dataclass(eq=False)
class Triage:
    """All failures so far. `more`: by name, inputs that were minimised to the same crash or not examined.

    `unrepeated`: inputs that the engine reported as failed and that do not fail again.
    """

    reached: InputCoverage
    oracle: Oracle
    folder: CampaignFolder
    sources: Sources
    minimise_s: float = MINIMISE_S
    tell: Callable[[], None] = lambda: None

    def __post_init__(self) -> None:
        self.target = self.oracle.target
        self.found: list[Crash] = []
        self.more: Counter[str] = Counter()
        self.unrepeated = 0
        self._by_name: dict[str, Crash] = {}
        self._in_vain: Counter[tuple[str, int | None]] = Counter()
        self._last: dict[tuple[str, int | None], Crash] = {}

    @property
    def confirmed(self) -> list[Crash]:
        return [crash for crash in self.found if crash.confirmed]

    @property
    def unconfirmed(self) -> list[Crash]:
        return [crash for crash in self.found if not crash.confirmed]

    def take(self, data: bytes) -> Crash | None:
        """An input that failed on a target; the crash that it is, if it is a new one."""
        failure = self._failure(data)
        if failure is None:
            self.unrepeated += 1
            return None
        group = failure.check, failure.pc or None

        def fails(shorter: bytes) -> bool:
            remaining = self._failure(shorter)
            return remaining is not None and (remaining.check, remaining.pc or None) == group

        def judged(shorter: bytes) -> tuple[Run, str]:
            again = self._failure(shorter) or failure
            return self.oracle.confirm(shorter, again), again.what

        return self._take(data, group, TRIES, fails, judged)

    def take_judged(self, data: bytes, failure: Failure, expected: Expected) -> Crash | None:
        """Takes an input whose World failed one of the checks in `expected`; returns the crash if it is new."""

        def judged(shorter: bytes) -> tuple[Run, str]:
            return self.oracle.judged(shorter, expected), ""

        def fails(shorter: bytes) -> bool:
            remaining = judged(shorter)[0].failure
            return remaining is not None and remaining.check == failure.check

        return self._take(data, (failure.check, None), TRIES_IN_A_WORLD, fails, judged)

    def _take(
        self,
        data: bytes,
        group: tuple[str, int | None],
        tries: int,
        fails: Callable[[bytes], bool],
        judged: Callable[[bytes], tuple[Run, str]],
    ) -> Crash | None:
        """`fails(data)`: True if an input still belongs to the group; `judged(data)`: the run and the target's
        message.
        """
        if self._in_vain[group] >= SAME_TRIED:
            self._count(self._last[group], group)
            return None
        key = self._key(group, data, *((None, "") if group[1] is not None else judged(data)))
        known = self._by_name.get(key.name)
        if known is not None and known.confirmed:
            self._count(known, group)
            return None
        small = minimise(data, fails, tries, self.minimise_s, self.tell)
        verdict, reason = judged(small)
        if verdict.failure is None and small != data:
            whole, message = judged(data)
            if whole.failure is not None:  # smaller, it is only the target's
                small, verdict, reason = data, whole, message
        key = self._key(group, small, verdict, reason)
        known = self._by_name.get(key.name)
        if known is None and group[1] is None:  # unconfirmed ones differ by the target's message
            known = self._by_name.pop(self._key(group, small, None, reason).name, None)
        if known is not None:
            self._count(known, group)
            if known.confirmed or verdict.failure is None:
                return None
            self.found.remove(known)  # another input shows now that it is real
            self.folder.remove(known.folder, known.name)
            self.more[key.name] = self.more.pop(known.name)
        crash = self._keep(key, small, reason, verdict, (len(data), len(small)))
        self._last[group] = crash
        self._in_vain[group] = 0
        return crash

    def _count(self, known: Crash, group: tuple[str, int | None]) -> None:
        self.more[known.name] += 1
        self._in_vain[group] += 1
        self._last[group] = known

    def _key(self, group: tuple[str, int | None], data: bytes, verdict: Run | None, reason: str) -> CrashKey:
        """The key of the crash that an input shows. A fault needs no verdict for that."""
        check, pc = group
        if pc is not None:
            return CrashKey(check, self.reached.cause(data, pc), "")
        failure = None if verdict is None else verdict.failure
        return CrashKey(check, None, _NUMBER.sub("#", reason if failure is None else failure.found))

    def _failure(self, data: bytes) -> TargetFailure | None:
        return self.target.failure if self.target.run(data) else None

    def _keep(self, key: CrashKey, data: bytes, reason: str, verdict: Run, sizes: tuple[int, int]) -> Crash:
        failure, cause = verdict.failure, key.cause
        crash = Crash(
            name=key.name,
            check=key.check,
            pc=None if cause is None else cause.pc,
            cause="" if cause is None else cause.what,
            function="" if cause is None else self.reached.function(cause.pc),
            verdict=f"{key.check}: {reason}" if failure is None else str(failure),
            folder=UNCONFIRMED if failure is None else CONFIRMED,
            sizes=sizes,
            fault=failure is not None and failure.fault,
        )
        again = self.oracle.judged(data, {}).stream() if failure is None else verdict.case()
        self.leave(crash.folder, crash.name, data, again, self.reached.run(data))
        self.found.append(crash)
        self._by_name[crash.name] = crash
        return crash

    def leave(self, folder: str, name: str, data: bytes, stream: str, counts: Counts) -> Path:
        """The files of an input; returns the stream's path."""
        self.folder.write(folder, f"{name}.input", data)
        self.folder.write(folder, f"{name}.txt", self.target.describe(data).rstrip("\n") + "\n")
        self.write_coverage(self.folder.folder(folder) / f"{name}.info", counts)
        return self.folder.write(folder, f"{name}.stream", stream)

    def write_coverage(self, path: Path, counts: Counts) -> None:
        """Writes an lcov tracefile of these counts."""
        report = self.coverage(path, counts)
        write(report.tracefile, report, path, "--out")

    def coverage(self, path: Path, counts: Counts) -> Report:
        """These counts as lines, for a file at `path`."""
        return collect(self.target.image, counts, self.sources, path)


Question = Callable[[bytes], bool]
"""True if an input still does it."""


def minimise(
    data: bytes, still: Question, tries: int, time_s: float, tell: Callable[[], None] = lambda: None
) -> bytes:
    """The simplest input for which `still` is true, found within `tries` tries and `time_s` seconds of wall time;
    `data` itself if `still(data)` is false.

    A shorter input is simpler; of two equally long ones, the one with more zeros. `tell` is called before each try, for
    a progress line.

    Delta debugging (Zeller, Hildebrandt: Simplifying and isolating failure-inducing input, IEEE TSE 28(2), 2002), in
    the variant that removes one chunk after the other, from half of the input down to single bytes, then replaces
    chunks by zeros in the same way. The order of tries depends on the input only; if the time ends first, a slower
    machine returns a longer input.
    """
    end_s = time.monotonic() + time_s

    def attempt(shorter: bytes) -> bool:
        nonlocal tries
        if tries <= 0 or time.monotonic() >= end_s:
            return False
        tries -= 1
        tell()
        return still(shorter)

    before = None if attempt(data) else data
    while data != before:
        before = data
        data = _simpler(data, attempt, lambda chunk: b"")
        data = _simpler(data, attempt, lambda chunk: bytes(len(chunk)))
    return data


def _simpler(data: bytes, attempt: Question, instead: Callable[[bytes], bytes]) -> bytes:
    """Replaces chunks from the end backwards, so that bytes after the crash are removed first."""
    size = max(1, len(data) // 2)
    while size:
        end = len(data)
        while end > 0:
            begin = max(0, end - size)
            simpler = data[:begin] + instead(data[begin:end]) + data[end:]
            if simpler != data and attempt(simpler):
                data = simpler
            end = begin
        size //= 2
    return data
