"""`mirotwin summary`: JUnit files as a short page in Markdown, and as annotations of GitHub."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated

from miro_exact.bad_input import BadInput, amount
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.junit import ReadCase, read_junit
from mirotwin.shell.options import OUT, PATH
from mirotwin.shell.outputs import check_file, whole_file
from mirotwin.shell.program import show_line
from mirotwin.shell.verdicts import DONE

MOST = 20
"""Failures that are listed. GitHub shows ten annotations of a step, and a page of 1 MB."""
_LONGEST = 300
"""Characters of a message."""
_MARKDOWN = re.compile(r"[\\`*_\[\]<>|#~$&]")


class SummaryOptions(Options, frozen=True, kw_only=True):
    COMMAND = "summary"
    paths: Annotated[tuple[Path, ...], Argument("FILE.xml|DIR..", PATH, several=True)]
    out: Annotated[Path | None, OUT.saying("File to write, such as summary.md. Default: the screen.")] = None
    annotations: Annotated[
        bool, Option(help="Print a line for each failure, as GitHub shows it at the line in question.")
    ] = False


@command_of(SummaryOptions)
def summary(options: SummaryOptions) -> int:
    """Makes a page in Markdown from JUnit files, or from those in DIR, written by `test`, `conform`, `fuzz`, `run` and
    pytest.

    It has a line for each file, and for each failure the message, time, place, and the commands that replay it.

    Nothing is judged: the exit code is 0 even after failures. Exit code 2: there is no JUnit file, or no test in one,
    so nothing was tested.
    """
    files = [file for path in options.paths for file in _files(path)]
    reports = {file: cases for file in files if (cases := read_junit(file))}
    lines = [*page(reports)]
    if options.out is None:
        for line in lines:
            show_line(line)
    else:
        check_file(options.out, "--out", *files)
        with whole_file(options.out, "--out") as part:
            part.write_text("\n".join((*lines, "")), encoding="utf-8")
    for case in failed(reports)[:MOST] if options.annotations else ():
        show_line(annotation(case))
    if not reports:
        remedy = "write JUnit with --junit, in pytest --junitxml"
        raise BadInput(
            " ".join(map(str, options.paths)), "", "no test is in it, so nothing was tested", remedy
        )
    return DONE


def _files(path: Path) -> list[Path]:
    return sorted(path.glob("*.xml")) if path.is_dir() else [path]


Reports = Mapping[Path, Sequence[ReadCase]]
"""The tests of each file."""


def failed(reports: Reports) -> list[ReadCase]:
    """Failures and errors, in the order of the files."""
    return [case for cases in reports.values() for case in cases if case.kind in ("failure", "error")]


def page(reports: Reports) -> Iterator[str]:
    """Its lines."""
    wrong, count = failed(reports), sum(map(len, reports.values()))
    if not reports:
        yield "## No test ran"
        return
    yield (
        f"## {len(wrong)} of {amount(count, 'test')} failed"
        if wrong
        else f"## {amount(count, 'test')} passed or skipped"
    )
    yield from _table(("report", "passed", "failed", "skipped"), map(_counts, reports.items()))
    if not wrong:
        return
    listed = wrong[:MOST]
    rows = ((case.name, case.facts.get("at_ms", ""), case.place, case.message) for case in listed)
    yield from _table(("failed", "at ms", "where", "what"), rows)
    if len(wrong) > MOST:
        yield from ("", f"{len(wrong) - MOST} more are in the reports.")
    yield from ("", "Again, and with the debugger at the failure:", "")
    for case in listed:
        names = ("replay", "debug") if "replay" in case.facts else ("reproduce",)
        yield from (f"    {case.facts[name]}  # {case.name}" for name in names if case.facts.get(name))


def _counts(report: tuple[Path, Sequence[ReadCase]]) -> tuple[str, ...]:
    kinds = [case.kind for case in report[1]]
    wrong = kinds.count("failure") + kinds.count("error")
    return report[0].name, f"{kinds.count('passed')}", f"{wrong}", f"{kinds.count('skipped')}"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield ""
    yield f"| {' | '.join(head)} |"
    yield "|---" * len(head) + "|"
    for row in rows:
        yield f"| {' | '.join(map(_plain, row))} |"


def _plain(text: str) -> str:
    """The text with escaped Markdown and HTML."""
    text = text if len(text) <= _LONGEST else f"{text[:_LONGEST]} .."
    return _MARKDOWN.sub(r"\\\g<0>", text)


def annotation(case: ReadCase) -> str:
    """The line that GitHub shows at a line of a file of the project; where it lies elsewhere, the text names it."""
    place, message = case.place, case.message
    file = case.facts.get("file", "")
    here = bool(file) and not Path(file).is_absolute() and Path(file).is_file()
    if place and not here:
        message = f"{place}: {message}"
    if here and (
        top := os.environ.get("GITHUB_WORKSPACE")
    ):  # a project may lie below the top of its repository
        file = os.path.relpath(file, top).replace(os.sep, "/")
    properties = {"file": file, "line": case.facts.get("line", "")} if here else {}
    named = [
        f"{key}={_escaped(value, ':,')}"
        for key, value in (properties | {"title": case.name}).items()
        if value
    ]
    return f"::error {','.join(named)}::{_escaped(message)}"


def _escaped(text: str, more: str = "") -> str:
    """Escapes a message as GitHub's toolkit does; `more`: further characters, in a property `:` and `,`."""
    return "".join(
        f"%{ord(character):02X}" if character in f"%\r\n{more}" else character for character in text
    )
