"""`mirotwin conform`: the rules of the protocol, tried on a firmware image."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated

import click
import msgspec

from miro_exact.bad_input import BadInput, amount
from miro_robot.image import Image
from miro_robot.inspect.findings import Finding
from mirotwin.conform import baseline
from mirotwin.conform.conform_results import RuleCases
from mirotwin.conform.explain import explain
from mirotwin.conform.rule import Rule
from mirotwin.conform.rules import ALL as EVERY_RULE
from mirotwin.conform.rules import LONG, RULES, find, spans
from mirotwin.conform.run import Outcome, case_names, failure_text, try_all, with_faults
from mirotwin.desk.guard import DeskOptions
from mirotwin.runs.sanitized import SanitizerOptions, judged, read_allowed, sanitized, stale_line
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.console import plain_table, show
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.options import (
    ALL,
    ARTIFACTS,
    JSON,
    JUNIT,
    NAME,
    PATH,
    QUIET,
    SEED,
    Engine,
    StackFrom,
)
from mirotwin.shell.outputs import check_file
from mirotwin.shell.program import complain, show_line
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.results import Results
from mirotwin.shell.verdicts import DONE, VERDICTS, exit_code, judge
from mirotwin.verify.cases.artifacts import (
    FIRMWARE,
    case_lines,
    image_files,
    leave_image,
    nothing_left,
    report_line,
)
from mirotwin.verify.cases.case import write_case

LINES = 5
"""Firmware faults that are listed."""
_OF_TRIALS = ("image", "everything", "junit", "artifacts", "baseline", "seed", "stack_from", "port")
"""Options that have no effect on a list of the rules."""


class ConformOptions(Options, frozen=True, kw_only=True):
    COMMAND = "conform"
    image: Annotated[str | None, Argument("[IMAGE.ihx]", NAME)] = None
    ids: Annotated[
        tuple[str, ...],
        Option("--rule", metavar="ID", help="A rule to try, such as P12; may be repeated.", apart="explain"),
    ] = ()
    long: Annotated[bool, Option(help="Also try the rules that take minutes of virtual time.")] = False
    listing: Annotated[bool, Option("--list", help="List the rules and try none.", apart="explain")] = False
    everything: Annotated[
        bool, ALL.saying("Also try rules of which a presupposition failed.", apart="explain")
    ] = False
    baseline: Annotated[
        Path | None,
        Option(
            metavar="FILE.toml",
            type=PATH,
            help="Rules that are known to fail: they are listed, and only others count.",
            apart="explain",
        ),
    ] = None
    write_baseline: Annotated[
        bool, Option(help="Write the rules that fail now into the file of --baseline.", needs="baseline")
    ] = False
    explain: Annotated[
        str | None,
        Option(metavar="ID", help="Show what happened in the trial of one rule, and try no other."),
    ] = None
    as_json: Annotated[
        bool, JSON.saying("Print one JSON document; with --list a line a rule.", apart="explain")
    ] = False
    junit: Annotated[Path | None, JUNIT.saying(JUNIT.help, apart="explain")] = None
    artifacts: Annotated[
        Path | None,
        ARTIFACTS.saying(
            "Leave each failure there as a case, P12.stream, for `mirotwin replay`; earlier ones are replaced.",
            apart="explain",
        ),
    ] = None
    seed: Annotated[int, SEED.saying("Seed of the noise between keyed frames.")] = 0
    stack_from: StackFrom = None
    engine: Engine = None
    sanitizer: SanitizerOptions = SanitizerOptions()
    desk: DeskOptions = DeskOptions()
    quiet: Annotated[bool, QUIET.saying("No progress bar, and of the table the rules that failed.")] = False

    def line_for(self, rule: str, sanitized: bool = False) -> str:
        """The command that tries this rule again; with the sanitizer it leaves the trial, for the debugger."""
        image, seed, stack_from = self.image, self.seed, self.stack_from
        again = ConformOptions(image=image, ids=(rule,), seed=seed, stack_from=stack_from)
        if sanitized:
            folder = self.artifacts or Path("failed")
            again = msgspec.structs.replace(again, sanitizer=self.sanitizer, artifacts=folder)
        return again.command_line()


def hidden_by(outcomes: Sequence[Outcome]) -> dict[str, list[str]]:
    """The rules that are not judged, by the one that failed instead: the one that hides most of them first."""
    hidden: dict[str, list[str]] = {}
    for outcome in outcomes:
        if outcome.cause:
            hidden.setdefault(outcome.cause, []).append(outcome.rule)
    return dict(sorted(hidden.items(), key=lambda item: -len(item[1])))


def causes_first(outcomes: Sequence[Outcome], causes: Sequence[str]) -> list[Outcome]:
    """Failed rules that hide others, then other failed ones, those not judged, those that passed, and the rest."""
    verdicts = ("failed", "not judged", "passed", "not observable")
    places = {id: place for place, id in enumerate(causes)}
    return sorted(
        outcomes, key=lambda outcome: (verdicts.index(outcome.verdict), places.get(outcome.rule, len(places)))
    )


def begin_with(cause: Outcome, hidden: Sequence[str]) -> str:
    """The sentence that says where to begin."""
    because = f"{find(cause.rule).broken}{_where(cause)}"
    first = cause.failures[0]
    hint = cause.hint or f"wanted {first.wanted}, found {first.found}"
    return f"{_rules(hidden)} not judged because {because}; begin with {cause.rule}: {hint}"


def _rules(ids: Sequence[str]) -> str:
    return amount(len(ids), "rule was", "rules were")


def _where(cause: Outcome) -> str:
    """The network size in which alone the rule fails, if it was tried in others too."""
    topologies = find(cause.rule).topologies
    failed = {topologies[failure.network].robots for failure in cause.failures if not failure.fault}
    if len(failed) == 1 and len({topology.robots for topology in topologies}) > 1:
        return f" where N = {failed.pop()}"
    return ""


@command_of(ConformOptions)
def conform(options: ConformOptions) -> int:
    """Tries each rule of docs/conformance.md on IMAGE.ihx (default: the robot's own firmware).

    A rule is what a host says, and what robots have to make of it, seen at pins, wires and LM629 alone: an image needs
    no symbols. Each trial is a world of its own that ends after a known time, whatever the firmware does.

    Rules presuppose others. One whose presupposition failed is not judged; the table begins with what to repair first.

    With --port the rules that answers can show are tried on a real robot. A rule that they cannot show is not
    observable, one that needs times which the PC cannot keep, or motion that is not allowed, is not judged; neither is
    passed.

    With --baseline a rule that is in FILE may fail. One that passes again is reported; --write-baseline takes it out.

    Exit code 1: a rule failed, or one of --rule was not judged; 3: the firmware did what it must not (bus, stack, ..)
    in one of the trials; 5: no rule was judged. With --sanitize 3 and 1, too, for what `fw sanitize` finds in them.
    """
    if options.listing and (given := options.given(*_OF_TRIALS)):
        raise click.UsageError(f"{given[0]} does not go with --list.")
    every = EVERY_RULE if options.long or options.listing else RULES
    rules = list(dict.fromkeys(map(find, options.ids))) or list(every)
    junit, artifacts, quiet = options.junit, options.artifacts, options.quiet
    if options.image is not None and options.image.endswith(".toml"):
        reason = "is no image, and conform knows the rules of the robot's protocol alone"
        raise BadInput(options.image, "", reason, "see docs/howto/own-protocol.md for rules of a board's")
    if options.listing:
        _list(rules, options.as_json)
        return DONE
    if junit is not None:
        check_file(junit, "--junit", options.image)
    known: dict[str, str] = {}
    if options.baseline is not None:
        check_file(options.baseline, "--baseline", options.image)
        known = baseline.read(options.baseline, options.write_baseline)
    at_port = options.desk.port
    if at_port:
        if given := options.given("image", "explain", "artifacts", "stack_from", "seed", "sanitize"):
            raise BadInput("", given[0], "is not for a robot at a port", "leave it out")
        from mirotwin.conform.by_answers import try_at_port  # loads pyserial

        properties: dict[str, str | int | float] = {"port": at_port}
        tried = try_at_port(rules, options.desk, complain, options.everything)
    else:
        firmware = load_firmware(options.image, named=False, stack_from=options.stack_from)
        if options.explain is not None:
            return _explain(find(options.explain), firmware, options.seed)
        if artifacts is not None:
            _make_room(artifacts, rules)
        name, sha256 = firmware.path.name, firmware.sha256
        properties = {"firmware": name, "firmware_sha256": sha256, "seed": options.seed}
        tried = try_all(
            rules,
            firmware,
            options.seed,
            artifacts is not None,
            not options.sanitizer.sanitize,
            options.everything,
        )
    outcomes: list[Outcome] = []
    lost: BadInput | None = None
    unwritten = ""
    allowed = read_allowed(options.sanitizer.allow)
    seen: dict[tuple[str, ...], tuple[Finding, Outcome]] = {}
    with (
        ProgressBar("trying rules", len(rules), quiet) as bar,
        sanitized(options.sanitizer.sanitize) as watching,
    ):
        try:
            for outcome in tried:
                outcomes.append(outcome)
                bar.to(len(outcomes))
                for each in watching.take():
                    if each.cause not in seen or (each.did and not seen[each.cause][0].did):
                        seen[each.cause] = each, outcome
                if artifacts is not None and not unwritten:
                    unwritten = _keep(outcome.cases, artifacts, firmware)
        except BadInput as error:  # a robot that was lost: outcomes before that are reported
            lost = error
    if lost is not None and not outcomes:
        raise lost
    findings, stale = judged([each for each, _ in seen.values()], allowed, options.sanitizer.kinds)
    trials = [seen[each.cause][1] for each in findings]
    if artifacts is not None:
        sent = [(case_names(find(each.rule))[2], each.sent) for each in trials]
        unwritten = unwritten or _keep(sent, artifacts, firmware)
    outcomes = with_faults(outcomes, rules)
    cured = [each.rule for each in outcomes if each.rule in known and each.verdict == "passed"]
    if options.baseline is not None and options.write_baseline and lost is None:
        known = baseline.write(options.baseline, known, outcomes)
    image = None if at_port else firmware
    rule_cases = RuleCases(
        outcomes, bool(options.ids), known, image, options.seed, artifacts, options.line_for
    )
    found_cases = [
        rule_cases.found(finding, trial.rule, options.line_for(trial.rule, sanitized=True))
        for finding, trial in zip(findings, trials, strict=True)
    ]
    verdict = judge((rule_cases.verdict, *(each.verdict for each in found_cases)))
    reported = options.as_json or junit is not None  # then a failure runs once more, for its place
    cases = (*rule_cases.cases(), *found_cases) if reported else ()
    results = Results(command="conform", cases=cases, verdict=verdict, facts=properties)
    if options.as_json:
        results.print_json()
    else:
        _print_table(outcomes, rules, options, known)
    if cured and not options.write_baseline:
        them = "it" if len(cured) == 1 else "them"
        remedy = f"take {them} out of {options.baseline}, or give --write-baseline"
        complain(f"{', '.join(cured)}: known to fail, but passed; {remedy}")
    if unwritten:
        complain(unwritten)
    _report_faults(outcomes)
    complain(*watching.unseen, *(stale_line(options.sanitizer.allow, each) for each in stale))
    complain(*(line for case in found_cases for line in case.lines))
    results.write_junit(junit)  # reported first: the file may fail
    if lost is not None:
        raise lost
    return VERDICTS[verdict].code


def _keep(cases: Iterable[tuple[str, str]], artifacts: Path, firmware: Image) -> str:
    """Leaves the cases of a rule; "" or why it cannot, for when all verdicts are reported."""
    try:
        for name, text in cases:
            write_case(artifacts / name, text)
            leave_image(artifacts, firmware)
    except (OSError, BadInput) as error:
        return nothing_left(artifacts, error)
    return ""


def _explain(rule: Rule, firmware: Image, seed: int) -> int:
    """The timeline of a rule's trial; the exit code."""
    lines, failed, faults = explain(rule, firmware, seed)
    for line in lines:
        show_line(line)
    return exit_code("fault" if faults else "failed" if failed else "passed")


def _make_room(folder: Path, rules: Sequence[Rule]) -> None:
    """Makes the folder, and takes away what these rules left there before. What others left stays."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        names = [name for rule in rules for name in case_names(rule)]
        for name in (*names, *image_files(folder)):
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise BadInput(
            folder, "", error.strerror or str(error), "choose another folder with --artifacts"
        ) from None


def _list(rules: Sequence[Rule], as_json: bool) -> None:
    if as_json:
        for rule in rules:
            line = {"rule": rule.id, "name": rule.name, "text": rule.text, "source": rule.source}
            click.echo(json_bytes(line | {"presupposes": rule.presupposes}))
        return
    table = plain_table("rule", "name", "what a robot has to do")
    for rule in rules:
        table.add_row(rule.id, rule.name, rule.text)
    show(table)


def _print_table(
    outcomes: Sequence[Outcome], rules: Sequence[Rule], options: ConformOptions, known: Mapping[str, str]
) -> None:
    quiet, everything = options.quiet, options.everything
    hidden, begin = hidden_by(outcomes), ""
    if hidden:
        first_cause = next(iter(hidden))
        (cause,) = (outcome for outcome in outcomes if outcome.rule == first_cause)
        show(begin := begin_with(cause, hidden[first_cause]))
    table = plain_table("rule", "name", "verdict", "first failure")
    for outcome in causes_first(outcomes, list(hidden)):
        is_known = outcome.rule in known and bool(outcome.failures)
        if (quiet and (is_known or not outcome.failures)) or (outcome.cause and not everything):
            continue
        first = failure_text(outcome.failures[0]) if outcome.failures else outcome.why
        if outcome.hint and outcome.hint not in begin:
            first = f"{outcome.hint}; {first}"
        because = f"presupposes {outcome.cause}, which failed" if outcome.cause else first
        if is_known:
            because = f"known: {known[outcome.rule]}; {because}"
        table.add_row(outcome.rule, find(outcome.rule).name, outcome.verdict, because)
    if table.rows:
        show(table)
    if not everything:
        for id, ids in hidden.items():
            show(f"{_rules(ids)} not judged because {id} failed: {spans(ids)}")
    if quiet:
        return
    left_out = [rule.id for rule in LONG if rule not in rules] if len(rules) == len(RULES) else []
    show(_counts(outcomes, known) + (f"; --long tries {', '.join(left_out)} too" if left_out else ""))
    if options.artifacts is not None:
        _print_replays(outcomes, options.artifacts)


def _counts(outcomes: Sequence[Outcome], known: Collection[str]) -> str:
    verdicts = [outcome.verdict for outcome in outcomes]
    tried = amount(len(outcomes), "rule")
    text = f"{tried}: {verdicts.count('passed')} passed, {verdicts.count('failed')} failed"
    expected = [outcome for outcome in outcomes if outcome.rule in known and outcome.failures]
    text += f" ({len(expected)} of them known)" * bool(expected)
    others = [
        f", {verdicts.count(word)} {word}" for word in ("not judged", "not observable") if word in verdicts
    ]
    return text + "".join(others)


def _print_replays(outcomes: Sequence[Outcome], artifacts: Path) -> None:
    """The line that gives each failure again, and the one that makes a page of the first."""
    names = [name for outcome in outcomes for name, _ in outcome.cases if (artifacts / name).exists()]
    own = not (artifacts / FIRMWARE).exists()
    for name in names:
        for line in case_lines(f"{artifacts}", own, name):
            show_line(line)
    if names:
        show_line(report_line(f"{artifacts / names[0]}"))


def _report_faults(outcomes: Sequence[Outcome]) -> None:
    """Says which faults came."""
    faults = [(outcome.rule, *fault) for outcome in outcomes for fault in outcome.faults][:LINES]
    for rule, network, slot, fault in faults:
        complain(f"trial of {rule}: net{network}/robot{slot}: {fault}")
    more = sum(outcome.fault_count for outcome in outcomes) - len(faults)
    if more:
        complain(f"{amount(more, 'more firmware fault')} in these trials")
