"""The results of a campaign: counts, coverage, crashes with the command that repeats each, and their files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import msgspec
from rich.table import Table

from miro_exact.bad_input import amount
from miro_robot.inspect.coverage import branch_share, line_share
from miro_robot.inspect.lcov import Tracefile
from mirotwin.firmware.coverage_files import table, write
from mirotwin.fuzz.campaign import Campaign
from mirotwin.fuzz.triage import UNCONFIRMED, Crash
from mirotwin.shell.debug_files import Places
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.junit import TestCase
from mirotwin.shell.plugin_files import NO_FILES, PluginFiles
from mirotwin.shell.results import Results
from mirotwin.shell.verdicts import Verdict
from mirotwin.verify.cases.replay_line import debug_line, foreign_path, replay_line

COVERAGE = "coverage.info"
SUMMARY = "summary.json"


class CampaignResults:
    """Results of a finished campaign. `unexamined`: number of inputs left; `complete`: no interrupt, no error.

    `in_files`: the checks of --expect that are in a file, by their name, as FILE.py:CLASS; `plugins`: parts of --part.
    """

    def __init__(
        self,
        campaign: Campaign,
        unexamined: int,
        complete: bool,
        in_files: Mapping[str, str],
        plugins: PluginFiles = NO_FILES,
    ) -> None:
        self.campaign = campaign
        self.unexamined = unexamined
        self.complete = complete
        self.in_files = in_files
        self.plugins = plugins
        self.triage = campaign.triage
        self.out = campaign.triage.folder.path
        self.progress = campaign.progress()
        self.coverage = self.triage.coverage(self.out / COVERAGE, self.triage.reached.total)
        self.never = never_reached(self.coverage.tracefile)

    @property
    def verdict(self) -> Verdict:
        """Failed: something was found, a function was not reached, or a check had no occasion."""
        return "failed" if self.triage.confirmed else self._unfinished

    @property
    def _unfinished(self) -> Verdict:
        """The verdict without regard to crashes."""
        missed = self.campaign.covering is not None and self.campaign.reached_by is None
        unjudged = "not judged" in self._open_checks().values()
        return "failed" if missed or unjudged else "passed"

    def overview(self) -> Iterator[str | Table]:
        """Lines, and a table of the coverage."""
        campaign, progress = self.campaign, self.progress
        edges = "" if progress.edges is None else f", {amount(progress.edges, 'edge')}"
        made = (
            f"{amount(progress.executions, 'execution')} in {clock(campaign.run_s)} ({campaign.rate:.0f}/s)"
        )
        new = f"{amount(campaign.inputs or 'no', 'input')} that found something new"
        yield f"{self.triage.target.image.path.name}: {made}{edges}, {new}"
        yield table(self.coverage.tracefile)
        if self.never:
            yield f"never reached: {', '.join(self.never)}"
        if campaign.expected:
            yield f"{', '.join(campaign.expected)}: judged {amount(campaign.judged or 'no', 'input')}"

    def notes(self) -> Iterator[str]:
        """Warnings: inputs not looked at, failures that did not repeat, functions and checks that were not reached."""
        campaign, triage = self.campaign, self.triage
        if self.unexamined:
            inputs = amount(self.unexamined, "input of the engine was", "inputs of the engine were")
            yield f"{inputs} not looked at; a longer --time does"
        if triage.unrepeated:
            yield f"{amount(triage.unrepeated, 'input')} that the engine saw failing did not fail again"
        if campaign.covering is not None and campaign.reached_by is None:
            inputs = amount(campaign.inputs or "no", "input")
            note = f"--covering {campaign.covering.name}: not reached by {inputs}"
            yield f"{note}; give it more --time, or a --corpus"
        for name, verdict in self._open_checks().items():
            yield f"expectation {verdict}: {name}: no input that was looked at lets it judge"

    def crashes(self) -> Iterator[str]:
        """Each crash, and the input that reached a function, with the lines that repeat it."""
        triage = self.triage
        yield amount(len(triage.confirmed) or "no", "crash", "crashes")
        for crash in triage.confirmed:
            yield from self._crash(crash)
        if triage.unconfirmed:
            note = "not confirmed: wrong on the target, right in a World"
            yield f"{len(triage.unconfirmed)} {note}; kept in {self.out / UNCONFIRMED}"
            for crash in triage.unconfirmed:
                yield from self._crash(crash)
        reached_by, covering = self.campaign.reached_by, self.campaign.covering
        if reached_by is not None and covering is not None:
            yield f"--covering {covering.name}: reached by {reached_by}"
            yield f"    {replay_line(reached_by, foreign_path(triage.target.image), plugins=self.plugins)}"

    def write(self) -> None:
        """The files of the campaign. Raises OutputError."""
        write(self.coverage.tracefile, self.coverage, self.out / COVERAGE, "--out")
        self.triage.folder.write("", SUMMARY, json_bytes(self._summary(), indent=2) + b"\n")

    @cached_property
    def for_programs(self) -> Results:
        """A case for the campaign, which fails without a crash too, and one for each crash."""
        cases = [TestCase("campaign", "fuzz", verdict=self._unfinished, lines=[*self.notes()])]
        cases += [self._case(crash) for crash in self.triage.found]
        verdict, summary = self.verdict, self._summary()
        return Results(command="fuzz", cases=cases, verdict=verdict, facts=self._facts(), summary=summary)

    def _facts(self) -> dict[str, str | int | float]:
        image = self.triage.target.image
        return {"firmware": image.path.name, "firmware_sha256": image.sha256}

    def _case(self, crash: Crash) -> TestCase:
        """The test case of a crash. A crash that a World did not confirm does not count.

        The place is the instruction that caused it.
        """
        replay, at_failure = self._commands(crash)
        facts: dict[str, str | int | float] = {"replay": replay, "debug": at_failure, "reproduce": replay}
        place = None if crash.pc is None else self._places.at(crash.pc)
        if place is not None:
            facts |= {"file": place.file, "line": place.line}
        facts |= {"cause": f"{crash.function} {crash.cause}".strip()} if crash.cause else {}
        lines = [crash.verdict]
        return TestCase(
            crash.name, "fuzz", verdict="failed", counts=crash.confirmed, lines=lines, facts=facts
        )

    @cached_property
    def _places(self) -> Places:
        return Places(self.triage.target.image)

    def _open_checks(self) -> dict[str, Verdict]:
        """The checks of --expect that judged no input."""
        verdicts = self.campaign.verdicts
        return {
            name: "not observable" if "not observable" in results else "not judged"
            for name, results in verdicts.items()
            if not results & {"passed", "failed"}
        }

    def _crash(self, crash: Crash) -> Iterator[str]:
        where = f" in {crash.function}" if crash.function else ""
        where += f", which {crash.cause}" if crash.cause else ""
        more = self.triage.more[crash.name]
        again = f"; {amount(more, 'more input')}" if more else ""
        before, after = crash.sizes
        yield f"  {crash.name}{where}: {crash.verdict} ({amount(after, 'byte')}, found with {before}{again})"
        for line in self._commands(crash):
            yield f"    {line}"

    def _commands(self, crash: Crash) -> tuple[str, str]:
        """The commands that replay its case and that open the debugger at it."""
        expected = (self.in_files[crash.check],) if crash.check in self.in_files else ()
        stream = self.out / crash.folder / f"{crash.name}.stream"
        image = foreign_path(self.triage.target.image)
        again = replay_line(stream, image, expected, self.plugins)
        return again, debug_line(stream, image, expected=expected, plugins=self.plugins)

    def _summary(self) -> dict[str, Any]:
        campaign, progress, tracefile = self.campaign, self.progress, self.coverage.tracefile
        lines, branches = line_share(tracefile), branch_share(tracefile)
        return {
            "firmware_sha256": self.triage.target.image.sha256,
            "complete": self.complete,
            "run_s": campaign.run_s,
            "executions": progress.executions,
            "edges": progress.edges,
            "inputs": campaign.inputs,
            "inputs_left": self.unexamined,
            "inputs_judged": campaign.judged,
            "unrepeated": self.triage.unrepeated,
            "lines": msgspec.to_builtins(lines),
            "branches": msgspec.to_builtins(branches),
            "functions_never_reached": self.never,
            "reached_by": None if campaign.reached_by is None else str(campaign.reached_by),
            "crashes": [
                {
                    **msgspec.to_builtins(crash),
                    "confirmed": crash.confirmed,
                    "more": self.triage.more[crash.name],
                }
                for crash in self.triage.found
            ],
        }


def never_reached(tracefile: Tracefile) -> list[str]:
    """Names of functions of which no instruction ran first."""
    return sorted(
        name for record in tracefile.values() for name, (_, count) in record.functions.items() if not count
    )


def clock(time_s: float) -> str:
    """A duration as minutes and seconds, `1:05`, or `2:00:00` with hours."""
    minutes, seconds = divmod(int(time_s), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"
