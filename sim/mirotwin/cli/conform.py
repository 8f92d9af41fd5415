"""`mirotwin conform`: the rules of the protocol, tried on a firmware image."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

import click
import msgspec
from rich.table import Table

from miro_exact.bad_input import BadInput
from miro_exact.seed import MAX_SEED
from mirotwin.cases.case import write_case
from mirotwin.cli.console import show
from mirotwin.cli.options import Place, Whole, choose_engine, engine_option, load_image
from mirotwin.cli.program import DONE, EXPECTATION_FAILED, FIRMWARE_FAULT, complain, show_line
from mirotwin.cli.progress import ProgressBar
from mirotwin.conform.junit import junit as as_junit
from mirotwin.conform.rule import Rule
from mirotwin.conform.run import Outcome, case_names, failure_text, try_all, with_faults
from mirotwin.conform.table import RULES, find
from mirotwin.files.outputs import check_file, check_not_input, whole_file

LINES = 5
"""Firmware faults that are listed."""


@click.command(short_help="Tries the protocol's rules on a firmware image.")
@click.argument("image", metavar="[IMAGE.ihx]", type=Place(), required=False)
@click.option(
    "--rule", "ids", metavar="ID", multiple=True, help="A rule to try, such as P12; may be repeated."
)
@click.option("--list", "listing", is_flag=True, help="List the rules and try none.")
@click.option("--json", "as_json", is_flag=True, help="One line of JSON a rule instead of the table.")
@click.option(
    "--junit", type=Place(path_type=Path), metavar="FILE.xml", help="Write JUnit XML, replacing the file."
)
@click.option(
    "--artifacts",
    type=Place(path_type=Path),
    metavar="DIR",
    help="Leave each failure there as a case, P12.stream, for `mirotwin replay`; earlier ones are replaced.",
)
@click.option(
    "--seed",
    type=Whole(0, MAX_SEED),
    default=0,
    show_default=True,
    help="Seed of the noise between keyed frames.",
)
@engine_option
@click.option("-q", "--quiet", is_flag=True, help="No progress bar, and of the table the rules that failed.")
def conform(
    image: str | None,
    ids: tuple[str, ...],
    listing: bool,
    as_json: bool,
    junit: Path | None,
    artifacts: Path | None,
    seed: int,
    engine: str | None,
    quiet: bool,
) -> int:
    """Tries each rule of docs/conformance.md on IMAGE.ihx (default: the robot's own firmware).

    A rule is what a host says, and what robots have to make of it, seen at pins, wires and LM629 alone: an image needs
    no symbols. Each trial is a world of its own that ends after a known time, whatever the firmware does.

    Exit code 1: a rule failed; 3: the firmware did what it must not (bus, stack, ..) in one of the trials.
    """
    choose_engine(engine)
    rules = list(dict.fromkeys(map(find, ids))) or list(RULES)
    if listing:
        _list(rules, as_json)
        return DONE
    if junit is not None:
        check_file(junit, "--junit")
        check_not_input(junit, "--junit", image)
    firmware = load_image(image, named=False)
    if artifacts is not None:
        _make_room(artifacts, rules)
    outcomes: list[Outcome] = []
    with ProgressBar("trying rules", len(rules), quiet) as bar:
        for outcome in try_all(rules, firmware, seed, keep=artifacts is not None):
            outcomes.append(outcome)
            bar.to(len(outcomes))
            if artifacts is not None:
                for name, text in outcome.cases:
                    write_case(artifacts / name, text)
    outcomes = with_faults(outcomes, rules)
    if junit is not None:
        properties = {"firmware": firmware.path.name, "firmware_sha256": firmware.sha256, "seed": f"{seed}"}
        with whole_file(junit, "--junit") as part:
            part.write_bytes(as_junit(outcomes, rules, properties))
    if as_json:
        _print_json(outcomes)
    else:
        _print_table(outcomes, rules, quiet)
        if artifacts is not None and not quiet:
            _print_replays(outcomes, artifacts, image)
    return _report_faults(outcomes) or (
        DONE if all(outcome.passed for outcome in outcomes) else EXPECTATION_FAILED
    )


def _make_room(folder: Path, rules: Sequence[Rule]) -> None:
    """Makes the folder, and takes away what these rules left there before. What others left stays."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for rule in rules:
            for name in case_names(rule):
                (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise BadInput(
            folder, "", error.strerror or str(error), "choose another folder with --artifacts"
        ) from None


def _list(rules: Sequence[Rule], as_json: bool) -> None:
    if as_json:
        for rule in rules:
            line = {"rule": rule.id, "name": rule.name, "text": rule.text, "source": rule.source}
            click.echo(msgspec.json.encode(line))
        return
    table = Table(box=None, pad_edge=False)
    for head in ("rule", "name", "what a robot has to do"):
        table.add_column(head, overflow="fold")
    for rule in rules:
        table.add_row(rule.id, rule.name, rule.text)
    show(table)


def _print_json(outcomes: Sequence[Outcome]) -> None:
    for outcome in outcomes:
        first = outcome.failures[0] if outcome.failures else None
        line = {
            "rule": outcome.rule,
            "verdict": "passed" if outcome.passed else "failed",
            "failures": len(outcome.failures),
            "first": None if first is None else msgspec.to_builtins(first),
            "faults": outcome.fault_count,
        }
        click.echo(msgspec.json.encode(line))


def _print_table(outcomes: Sequence[Outcome], rules: Sequence[Rule], quiet: bool) -> None:
    names = {rule.id: rule.name for rule in rules}
    table = Table(box=None, pad_edge=False)
    for head in ("rule", "name", "verdict", "first failure"):
        table.add_column(head, overflow="fold")
    for outcome in outcomes:
        if outcome.passed and quiet:
            continue
        first = failure_text(outcome.failures[0]) if outcome.failures else ""
        table.add_row(outcome.rule, names[outcome.rule], "passed" if outcome.passed else "failed", first)
    if table.rows:
        show(table)
    failed = len([outcome for outcome in outcomes if not outcome.passed])
    if not quiet:
        rules_tried = "1 rule" if len(outcomes) == 1 else f"{len(outcomes)} rules"
        show(f"{rules_tried}: {len(outcomes) - failed} passed, {failed} failed")


def _print_replays(outcomes: Sequence[Outcome], artifacts: Path, image: str | None) -> None:
    """The line that gives each failure again."""
    firmware = "" if image is None else f" --firmware {shlex.quote(image)}"
    for outcome in outcomes:
        for name, _ in outcome.cases:
            show_line(f"mirotwin replay {shlex.quote(str(artifacts / name))}{firmware}")


def _report_faults(outcomes: Sequence[Outcome]) -> int:
    """Says which faults came; returns the exit code."""
    told = 0
    count = 0
    for outcome in outcomes:
        count += outcome.fault_count
        for network, slot, fault in outcome.faults:
            if told < LINES:
                told += 1
                complain(f"trial of {outcome.rule}: net{network}/robot{slot}: {fault}")
    if count > told:
        complain(f"{count - told} more firmware faults in these trials")
    return FIRMWARE_FAULT if count else DONE
