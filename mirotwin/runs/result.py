"""The result of a run: its verdict, and lines with the reasons, the same for every command."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import msgspec

from miro_exact.bad_input import amount
from miro_exact.clock import NEVER_TICK, TICKS_PER_SECOND
from miro_sim.world.device import Device
from miro_sim.world.robot import Robot
from mirotwin.shell.debug_files import Place
from mirotwin.shell.junit import TestCase
from mirotwin.shell.verdicts import VERDICTS, Verdict
from mirotwin.verify.checks.expect import ALWAYS_ON
from mirotwin.verify.checks.interface import Expectation, Failure
from mirotwin.verify.checks.monitors import Checks

LINES = 5
"""Failures of one check that are listed."""
Line = tuple[Verdict, str]
"""A line of text, and the verdict that it supports."""


class Result(msgspec.Struct, frozen=True, kw_only=True):
    """The result of a run. `verdict_lines`: a line for each part that failed or could not be judged.

    `failures`: of checks, in the order of time. `expectations`: of all checks. `done` of `steps`; `unseen`: number of
    steps and expectations that a port does not show. `tick`: end of the run; `clock`: ticks per second. `folder`: with
    its case, "" if none; `left_out`: keys that settings left out, a line each. `again`: the command that repeats the
    verdict; `error`: why there was no run. `has_page`: `mirotwin report` can make a page of it. `step_tick`: of a
    failed step, -1 if none. `place`: the C line of the first failure. `commands`: replay the failure and debug it.
    """

    path: str = ""
    verdict: Verdict
    verdict_lines: Sequence[Line] = ()
    failures: Sequence[Failure] = ()
    expectations: Sequence[Expectation] = ()
    done: int = 0
    steps: int = 0
    unseen: int = 0
    tick: int = 0
    clock: int = TICKS_PER_SECOND
    seed: int = 0
    digest: str = ""
    firmware_sha256: str = ""
    folder: str = ""
    left_out: Sequence[str] = ()
    again: str = ""
    error: Exception | None = None
    has_page: bool = True
    step_tick: int = -1
    place: Place | None = None
    commands: Sequence[str] = ()

    @property
    def code(self) -> int:
        """The exit code."""
        return VERDICTS[self.verdict].code

    @property
    def failed_tick(self) -> int:
        """Tick of the first failure; -1 if no failure has a time."""
        ticks = [self.step_tick] * (self.step_tick >= 0) + [failure.tick for failure in self.failures]
        return ticks[0] if ticks else -1

    def facts(self) -> dict[str, str | int | float]:
        """Facts about the run, and time and place of its failure."""
        facts: dict[str, str | int | float] = {
            "seed": self.seed,
            "digest": self.digest,
            "firmware_sha256": self.firmware_sha256,
            "reproduce": self.again,
        }
        return facts | failure_facts(self.failed_tick, self.clock, self.place, self.commands)

    def as_case(self, name: str, classname: str, time_s: float | None = None) -> TestCase:
        """For reports."""
        lines = (*self.lines, *self.notes)
        return TestCase(name, classname, time_s, self.verdict, lines=lines, facts=self.facts())

    @property
    def texts(self) -> tuple[str, ...]:
        """All lines."""
        return tuple(text for _, text in self.verdict_lines)

    @property
    def lines(self) -> tuple[str, ...]:
        """Lines about failures, firmware faults first."""
        wrong = [line for line in self.verdict_lines if VERDICTS[line[0]].junit in ("failure", "error")]
        return tuple(text for _, text in sorted(wrong, key=lambda line: line[0] != "fault"))

    @property
    def notes(self) -> tuple[str, ...]:
        """Further remarks."""
        wrong = self.lines
        return tuple(text for text in self.texts if text not in wrong)


def failure_facts(
    tick: int, clock: int = TICKS_PER_SECOND, place: Place | None = None, commands: Sequence[str] = ()
) -> dict[str, str | int | float]:
    """Time and place of a failure, and the two commands of `case_lines`, as far as they are known."""
    facts: dict[str, str | int | float] = {}
    if tick >= 0:
        facts |= {"tick": tick, "at_ms": round(1000 * tick / clock, 3)}
    if place is not None:
        facts |= {"file": place.file, "line": place.line}
    return facts | dict(zip(("replay", "debug"), commands, strict=False))


def expectation_lines(checks: Checks) -> Iterator[Line]:
    """Which checks failed, had no occasion, or cannot be observed. Firmware faults have lines of their own."""
    for verdict in checks.verdicts():
        if verdict.reason and verdict.name in checks.named:
            yield verdict.verdict, f"expectation {verdict.verdict}: {verdict.name}: {verdict.reason}"
        failures = [
            failure for failure in checks.failures if failure.check == verdict.name and not failure.fault
        ]
        for failure in failures[:LINES]:
            yield "failed", f"expectation failed: {failure}"
        if failures and verdict.failures > LINES:
            yield "failed", f"expectation failed: {verdict.name}: {verdict.failures - LINES} more times"


def fault_lines(devices: Sequence[Device], to_tick: int = NEVER_TICK) -> Iterator[Line]:
    """Firmware faults up to `to_tick`, a line for each robot or for a single board."""
    for device in devices:
        faults = [fault for fault in device.board.faults if fault.tick <= to_tick]
        if faults:
            # the board keeps the first ones only
            count = device.board.fault_count if len(faults) == len(device.board.faults) else len(faults)
            more = f" (and {count - 1} more)" if count > 1 else ""
            place = f"net{device.network}/robot{device.slot}: " if isinstance(device, Robot) else ""
            yield "fault", f"firmware fault: {place}{faults[0]}{more}"


def expectations_text(expectations: Sequence[Expectation]) -> str:
    """The number of checks that passed, and the names of the others, for people.

    An always-on check that never applied is not counted.
    """
    counted = [each for each in expectations if each.verdict != "not judged" or each.name not in ALWAYS_ON]
    others = [f"{each.name} {each.verdict}" for each in counted if each.verdict != "passed"]
    return ", ".join([f"{len(counted) - len(others)} of {amount(len(counted), 'check')} passed", *others])


def result_of_case(
    recorded: str,
    failures: Sequence[Failure],
    changed: bool,
    verdict: Verdict = "passed",
    why: Sequence[str] = (),
) -> Result:
    """From the line that was recorded ("" for none). `changed`: other firmware or settings ran than those of the case;
    `verdict`: that of the checks it names, where none failed, and `why` they were not judged.

    `failures` of the result: the check that failed, as recorded or otherwise, and the first firmware fault.
    """
    name = recorded.partition(":")[0]
    if failures:
        same = [failure for failure in failures if str(failure) == recorded]
        first = (same or failures)[0]
        lines = [f"fails as recorded: {first}" if same else f"still fails, but not as recorded: {first}"]
        if not recorded:
            lines = [f"fails: {first}"]
        elif not same:
            lines.append(f"recorded: {recorded}")
        fault = next((failure for failure in failures if failure.fault), None)
        if fault not in (None, first):
            lines.append(f"and a firmware fault: {fault}")
        reported = [first] if fault in (None, first) else [first, fault]
        return _case("failed" if fault is None else "fault", lines, reported)
    if verdict != "passed":
        return _case(verdict, [*why, *([f"recorded: {recorded}"] if recorded else [])])
    if not recorded:
        return _case("passed", ["passes", *why])
    if changed:
        return _case("passed", [f"cured: {name} passes; recorded: {recorded}", *why])
    return _case("differs", [f"not reproduced: {name} passes; recorded: {recorded}", *why])


def _case(verdict: Verdict, lines: Sequence[str], failures: Sequence[Failure] = ()) -> Result:
    return Result(verdict=verdict, verdict_lines=[(verdict, line) for line in lines], failures=failures)
