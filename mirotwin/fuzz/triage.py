"""What becomes of an input that failed: minimised, told apart from the others, confirmed in a World, left as files.

Two crashes are the same where check, PC and path are. The PC is that of the instruction that did it, a fault; where no
instruction did it (nothing came in time, say) there is none. The path is that of the minimised input (`reached`).

Of inputs with the same check and PC only the first few are minimised, unless a new path comes of them: an easy mistake
fails thousands of inputs, which are counted.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from miro_robot.image.debug_info import Sources
from miro_robot.inspect.coverage import Counts
from miro_robot.inspect.lcov import Tracefile
from mirotwin.firmware.coverage_files import collect, write
from mirotwin.fuzz.files import CampaignFolder
from mirotwin.fuzz.input_coverage import InputCoverage
from mirotwin.fuzz.minimise import Budget, minimise
from mirotwin.fuzz.oracle import Expected, Oracle, OracleVerdict
from mirotwin.fuzz.target import TargetFailure
from mirotwin.verify.checks.interface import Failure

MINIMISE_S = 10.0
TRIES = 50_000
TRIES_IN_A_WORLD = 400
SAME_TRIED = 6
"""Inputs of one check and PC in a row that are minimised although nothing new comes of them."""
CONFIRMED, UNCONFIRMED = "crashes", "unconfirmed"


class Crash(msgspec.Struct, frozen=True, kw_only=True):
    """A mistake that an input shows. `verdict`: of the World, or of the target where that is not confirmed.

    `pc` None: no instruction did it. `folder`: `crashes` or `unconfirmed`. `sizes`: bytes of the input as it was found
    and as it is left.
    """

    name: str
    check: str
    pc: int | None
    path: str
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
    """All that was found so far. `more`: by name, inputs that came down to the same crash or were not looked at.

    `unrepeated`: inputs that the engine said had failed and that do not fail again.
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
        self._by_key: dict[tuple[str, int | None, str], Crash] = {}
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
        group = _group(failure)
        if self._in_vain[group] >= SAME_TRIED:
            self.more[self._last[group].name] += 1
            return None
        small = minimise(data, lambda one: self._fails(one, group), Budget(TRIES, self.minimise_s, self.tell))
        counts = self.reached.run(small)
        key = (*group, self.reached.path(counts))
        known = self._by_key.get(key)
        if known is not None and known.confirmed:
            self._count(key)
            return None
        again = self._failure(small) or failure
        verdict = self.oracle.confirm(small, again)
        if verdict.failure is None and small != data:
            whole = self.oracle.confirm(data, failure)
            if whole.failure is not None:  # smaller, it is only the target's
                small, verdict, again = data, whole, failure
                counts = self.reached.run(small)
        if known is not None:
            if verdict.failure is None:
                self._count(key)
                return None
            self._take_back(known)
        sizes = (len(data), len(small))
        return self._keep(key, small, again.pc, again.what, verdict, counts, sizes)

    def take_judged(self, data: bytes, failure: Failure, expected: Expected) -> Crash | None:
        """An input in whose World one of the checks in `expected` failed; the crash, if it is a new one."""
        group = (failure.check, None)
        if self._in_vain[group] >= SAME_TRIED:
            self.more[self._last[group].name] += 1
            return None

        def fails(one: bytes) -> bool:
            found = self.oracle.judged(one, expected).failure
            return found is not None and found.check == failure.check

        small = minimise(data, fails, Budget(TRIES_IN_A_WORLD, self.minimise_s, self.tell))
        counts = self.reached.run(small)
        key = (*group, self.reached.path(counts))
        if key in self._by_key:
            self._count(key)
            return None
        verdict = self.oracle.judged(small, expected)
        return self._keep(key, small, 0, "", verdict, counts, (len(data), len(small)))

    def _failure(self, data: bytes) -> TargetFailure | None:
        return self.target.failure if self.target.run(data) else None

    def _fails(self, data: bytes, group: tuple[str, int | None]) -> bool:
        failure = self._failure(data)
        return failure is not None and _group(failure) == group

    def _take_back(self, crash: Crash) -> None:
        """A crash that was not confirmed, of which another input shows now that it is real."""
        self.found.remove(crash)
        self.more[crash.name] += 1
        self.folder.remove(crash.folder, crash.name)

    def _count(self, key: tuple[str, int | None, str]) -> None:
        crash = self._by_key[key]
        self.more[crash.name] += 1
        self._in_vain[key[:2]] += 1

    def _keep(
        self,
        key: tuple[str, int | None, str],
        data: bytes,
        pc: int,
        what: str,
        verdict: OracleVerdict,
        counts: Counts,
        sizes: tuple[int, int],
    ) -> Crash:
        check, place_pc, path = key
        name = "-".join([check, *([] if place_pc is None else [f"{place_pc:04x}"]), path])
        failure = verdict.failure
        crash = Crash(
            name=name,
            check=check,
            pc=place_pc,
            path=path,
            function="" if place_pc is None else self.reached.function(pc),
            verdict=f"{check}: {what}" if failure is None else str(failure),
            folder=UNCONFIRMED if failure is None else CONFIRMED,
            sizes=sizes,
            fault=failure is not None and failure.fault,
        )
        again = self.oracle.judged(data, {}).stream() if failure is None else verdict.case()
        self.leave(crash.folder, name, data, again, counts)
        self.found.append(crash)
        self._by_key[key] = crash
        self._last[key[:2]] = crash
        self._in_vain[key[:2]] = 0
        return crash

    def leave(self, folder: str, name: str, data: bytes, stream: str, counts: Counts) -> Path:
        """The files of an input; returns the stream's path."""
        self.folder.write(folder, f"{name}.input", data)
        self.folder.write(folder, f"{name}.txt", self.target.describe(data).rstrip("\n") + "\n")
        self.write_coverage(self.folder.folder(folder) / f"{name}.info", counts)
        return self.folder.write(folder, f"{name}.stream", stream)

    def write_coverage(self, path: Path, counts: Counts) -> Tracefile:
        """Writes an lcov tracefile of these counts."""
        report = collect(self.target.image, counts, self.sources, path)
        write(report.tracefile, report, path, "--out")
        return report.tracefile


def _group(failure: TargetFailure) -> tuple[str, int | None]:
    """Check and PC of what a target found."""
    return failure.check, failure.pc or None
