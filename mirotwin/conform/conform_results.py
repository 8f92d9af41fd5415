"""The results of rules for programs: each rule is a case in JUnit and JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from miro_robot.image import Image
from miro_robot.inspect.findings import Finding
from mirotwin.conform.rule import Rule
from mirotwin.conform.rules import chapter_of, find
from mirotwin.conform.run import Outcome, case_names, failure_text
from mirotwin.conform.trial import trial_of
from mirotwin.runs.failure_place import place_at
from mirotwin.runs.result import failure_facts
from mirotwin.runs.sanitized import line_of, place_of
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.debug_files import Places
from mirotwin.shell.junit import TestCase
from mirotwin.shell.verdicts import Verdict, judge
from mirotwin.verify.cases.artifacts import FIRMWARE, case_lines
from mirotwin.verify.cases.replay_line import DebugLineOptions


def counts(outcome: Outcome, named: bool, known: Mapping[str, str]) -> bool:
    """True if its verdict counts for the exit code.

    Neither the failure of a `known` rule does, nor a rule behind another that failed. "Not judged" counts only for a
    rule that the user `named`.
    """
    if outcome.cause or (outcome.rule in known and outcome.failures):
        return False
    return named or outcome.verdict != "not judged"


class RuleCases:
    """The cases of rules that were tried on `image` (None: on a robot at a port), with `seed`.

    `artifacts`: where failures left their cases, if anywhere; `again`: the command that tries a rule again. A firmware
    fault has the place of its instruction, another failure that at which the debugger stands. Without times: the same
    image gives the same bytes.
    """

    def __init__(
        self,
        outcomes: Sequence[Outcome],
        named: bool,
        known: Mapping[str, str],
        image: Image | None,
        seed: int,
        artifacts: Path | None,
        again: Callable[[str], str],
    ) -> None:
        self._outcomes = outcomes
        self._named = named
        self._known = known
        self._image = image
        self._seed = seed
        self._artifacts = artifacts
        self._again = again

    @property
    def verdict(self) -> Verdict:
        """The verdict over all rules. A firmware fault counts unless the rule against it is known to fail."""
        known = {kind for id in self._known for kind in find(id).faults}
        faults = [
            fault for outcome in self._outcomes for _, _, fault in outcome.faults if fault.kind not in known
        ]
        verdicts: list[Verdict] = ["fault"] * bool(faults)
        for outcome in self._outcomes:
            does_not: Verdict = "passed" if outcome.rule in self._known else "not observable"
            verdicts.append(outcome.verdict if counts(outcome, self._named, self._known) else does_not)
        return judge(verdicts)

    def found(self, finding: Finding, rule: str, reproduce: str) -> TestCase:
        """A finding of the sanitizer in the trial of a rule. `reproduce`: the command that leaves the trial."""
        assert self._image is not None
        facts: dict[str, str | int | float] = {"rule": rule, "network": finding.network}
        if finding.slot >= 0:
            facts["slot"] = finding.slot
        facts |= {"reproduce": reproduce}
        facts |= failure_facts(finding.tick, place=Places(self._image).at(finding.pc))
        line, folder = reproduce, self._artifacts
        if folder is not None and (stream := folder / case_names(find(rule))[2]).exists():
            image = folder / FIRMWARE
            firmware = f"{image}" if image.exists() else None
            facts["debug"] = line = DebugLineOptions(
                file=f"{stream}", firmware=firmware, **place_of(finding)
            ).command_line()
        verdict, text = line_of(finding)
        lines = (text, f"    {line}")
        return TestCase(finding.key, "conform.sanitizer", verdict=verdict, lines=lines, facts=facts)

    def cases(self) -> list[TestCase]:
        return [self._case(outcome, find(outcome.rule)) for outcome in self._outcomes]

    def _case(self, outcome: Outcome, rule: Rule) -> TestCase:
        facts: dict[str, str | int | float] = {"rule": rule.id}
        lines: tuple[str, ...] = ()
        if outcome.failures:
            lines = (*map(failure_text, outcome.failures), rule.text, f"({rule.source})")
            facts |= self._failed(outcome, rule)
        elif outcome.cause or outcome.why:
            why = outcome.why or f"{outcome.cause} failed, {find(outcome.cause).broken}"
            lines = (f"{outcome.verdict}: {why}",)
            facts |= {"cause": outcome.cause} if outcome.cause else {}
        if outcome.failures and rule.id in self._known:
            lines = (f"known to fail: {self._known[rule.id]}", *lines)
            facts["known"] = self._known[rule.id]
        if outcome.fault_count:
            facts["faults"] = outcome.fault_count
        return TestCase(
            f"{rule.id} {rule.name}",
            f"conform.{chapter_of(rule).title}",
            verdict=outcome.verdict,
            counts=counts(outcome, self._named, self._known),
            lines=lines,
            facts=facts,
        )

    def _failed(self, outcome: Outcome, rule: Rule) -> dict[str, str | int | float]:
        first = outcome.failures[0]
        facts: dict[str, str | int | float] = {
            "failures": len(outcome.failures),
            "network": first.network,
            "slot": first.slot,
            "wanted": first.wanted,
            "found": first.found,
            **({"hint": outcome.hint} if outcome.hint else {}),
        }
        if self._image is None:
            return facts
        if first.fault:  # in whichever trial it came
            trial_id, fault = next(
                (other.rule, fault)
                for other in self._outcomes
                for _, _, fault in other.faults
                if f"{fault}" == first.found
            )
            place = Places(self._image).at(fault.pc)
            commands = self._commands(case_names(find(trial_id))[1])
        else:
            trial = trial_of(rule)
            spec = RunSpec(scenario=trial.scenario, image=self._image, seed=self._seed, script=trial.script)
            place = place_at(spec, first.tick, (first.network, first.slot))
            commands = self._commands(case_names(rule)[0])
        return (
            facts
            | {"reproduce": self._again(rule.id)}
            | failure_facts(first.tick, place=place, commands=commands)
        )

    def _commands(self, case: str) -> Sequence[str]:
        """The commands for a case, if there is one."""
        folder = self._artifacts
        if folder is None or not (folder / case).exists():
            return ()
        return case_lines(f"{folder}", not (folder / FIRMWARE).exists(), case)
