"""`mirotwin test`: scenario files and cases as tests, for people and machines without pytest."""

from __future__ import annotations

import shlex
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from miro_exact.bad_input import BadInput, amount
from mirotwin.runs.result import Result
from mirotwin.runs.sanitized import Allowed, read_allowed, stale_line
from mirotwin.runs.test_file import KINDS, collect, stem_of
from mirotwin.shell.command import command_of
from mirotwin.shell.junit import TestCase
from mirotwin.shell.outputs import check_file
from mirotwin.shell.program import complain, show_line, show_traceback, tell_notes
from mirotwin.shell.results import Results
from mirotwin.shell.verdicts import VERDICTS, judge
from mirotwin.testing.test_files import run_file, run_sanitized
from mirotwin.testing.test_options import TestOptions
from mirotwin.verify.cases.artifacts import report_line
from mirotwin.verify.cases.case import SUFFIX as CASE_SUFFIX
from mirotwin.verify.checks.interface import in_ms
from mirotwin.verify.expectations import as_settings, in_files


@command_of(TestOptions)
def test(options: TestOptions) -> int:
    """Runs each *.scenario.toml that is named or lies below DIR: its steps, what it expects, and the checks that are
    always on. One line each with the verdict, and one for each failure.

    Cases (*.stream), of a failure that was mended, run with their own seed and settings, and pass where their check
    passes. One of a bare processor needs --firmware.

    With --port the steps go to a real robot: those that a PC can do and see. The others, and what is expected of a
    robot's inside, are not observable on a port: that is told and counted, and never passes. --artifacts leaves the
    recording. A case is refused.

    Exit code 1: a step or a check failed, or a check that is named had no occasion; 3: the firmware did what it must
    not; 2: a file cannot be run, or there is none. Where several apply: 2, then 3, then 1. 5: nothing was judged,
    because a port, or an image without symbols, shows none of it.

    With --sanitize what the firmware does without noticing fails a file, too: 3 for what happened, 1 for what may.
    """
    word, junit, desk = options.word, options.junit, options.desk
    options.plugins.bring()
    files = collect(options.paths)
    chosen = [file for file in files if word.lower() in file.lower()]
    if not chosen:
        problem = (
            f"{amount(len(files), 'file')}, none with {word!r} in its path" if files else f"no {KINDS} there"
        )
        raise BadInput(
            " ".join(options.paths),
            "",
            problem,
            "nothing was tested; a test is a scenario or a case in such a file",
        )
    if desk.port and (given := options.given("seed", "sanitize")):
        raise BadInput("", given[0], "is not for a robot at a port", "leave it out")
    case = next((file for file in chosen if file.endswith(CASE_SUFFIX)), None)
    if desk.port and case is not None:
        problem = "a case is judged by what is inside the twin, which no port shows"
        raise BadInput(case, "--port", problem, "leave it out, or send it with `mirotwin replay`")
    if junit is not None:
        check_file(junit, "--junit", *chosen)
    if options.pages:
        from mirotwin.report.page.bokeh_page import require_bokeh
        from mirotwin.report.report_command import leave_page  # loads the pages' library

        require_bokeh()
    allowed, applied = read_allowed(options.sanitizer.allow), set[Allowed]()
    left_out: dict[str, None] = {}
    results: list[Result] = []
    cases: list[TestCase] = []
    as_settings(options.expected)  # cases may name the checks of files, which are known from now on
    for file in chosen:
        began_s = time.perf_counter()
        if options.sanitizer.sanitize:
            result, used, unseen = run_sanitized(options, file, allowed)
            applied.update(used)
            tell_notes(note for note in unseen if note not in left_out)
            left_out |= dict.fromkeys(unseen)
        else:
            result = run_file(options, file)
        if result.error is not None:
            show_traceback(result.error)
        cases.append(_test_case(result, time.perf_counter() - began_s))
        results.append(result)
        tell_notes(note for note in result.left_out if note not in left_out)
        left_out |= dict.fromkeys(result.left_out)
        if not options.as_json:
            _show(result, options)
        if options.pages and result.folder and result.has_page:
            try:
                leave_page(Path(result.folder))
            except (OSError, BadInput) as error:
                (complain if options.as_json else show_line)(f"    no page: {error}")
    reported = Results(command="test", cases=cases, verdict=judge(result.verdict for result in results))
    if options.as_json:
        reported.print_json()
    else:
        show_line(_summary(results))
    complain(*(stale_line(options.sanitizer.allow, entry) for entry in allowed if entry not in applied))
    reported.write_junit(junit)  # the verdicts are printed first, whatever becomes of their file
    if all(file.endswith(CASE_SUFFIX) for file in chosen):
        _refuse_unused(in_files(options.expected).values(), results)
    return VERDICTS[reported.verdict].code


def _refuse_unused(files: Iterable[str], results: Sequence[Result]) -> None:
    """Raises BadInput for a check in a file that none of the cases names."""
    used = {word for result in results for word in shlex.split(result.again)}
    for text in sorted(set(files) - used):
        problem = f"no case is judged by {text}"
        raise BadInput(
            "", "--expect", problem, "leave it out, or name the one that the cases have in [expect]"
        )


def _show(result: Result, options: TestOptions) -> None:
    passed = result.verdict == "passed"
    if options.quiet and passed:
        return
    steps = f"{result.done} of {amount(result.steps, 'step')}, " if result.steps else ""
    digest = f", digest {result.digest[:12]}" if result.digest else ""  # of a robot at a port there is none
    how = f" ({steps}{in_ms(result.tick, result.clock)}{digest})" if steps or digest else ""
    show_line(f"{VERDICTS[result.verdict].line}  {result.path}{how}")
    for line in (*result.lines, *result.notes):
        show_line(f"    {line}")
    if result.folder:
        show_line(f"    left in {result.folder}")
        for line in result.commands:
            show_line(f"    {line}")
        if result.has_page:
            show_line(f"    {report_line(result.folder)}")
    if not passed and result.verdict != "error":
        if result.done < result.steps and not result.folder and (line := options.debug_line_for(result.path)):
            show_line(f"    {line}")
        show_line(f"    {result.again}")


def _summary(results: Sequence[Result]) -> str:
    """The summary line of all results."""
    counted = Counter(result.verdict for result in results)
    reported = [verdict for verdict in VERDICTS if counted[verdict]]
    text = ", ".join(f"{counted[verdict]} {VERDICTS[verdict].counted}" for verdict in reported)
    if unseen := sum(result.unseen for result in results):
        text += f"; {amount(unseen, 'step or expectation is', 'steps and expectations are')} not observable on a port"
    return text


def _test_case(result: Result, time_s: float) -> TestCase:
    classname = str(Path(result.path).parent).strip("./").replace("/", ".") or "scenario"
    return result.as_case(stem_of(result.path), classname, time_s)
