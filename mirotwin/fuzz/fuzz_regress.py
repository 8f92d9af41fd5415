"""`mirotwin fuzz --regress DIR`: saved cases, run once more.

A case passes where its check passes: that is what is wanted of firmware in which a mistake was mended. A check that had
no occasion to judge passes if it says "never" (safety), and fails if it says "within a time" (liveness): firmware that
does nothing at all has mended nothing. Streams that expect nothing are judged by the checks that are always on.
"""

from __future__ import annotations

from pathlib import Path

import click
from click.core import ParameterSource

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.image import Image
from miro_sim.radio.downlink import TransmissionError
from mirotwin.fuzz.fuzz_bare import check_given, problem_of_bare_case
from mirotwin.rerun.job import Job, load_stream
from mirotwin.shell.options import plain_parameters
from mirotwin.shell.program import BAD_INPUT, DONE, EXPECTATION_FAILED, complain, show_line
from mirotwin.shell.progress import ProgressBar
from mirotwin.verify.cases.case import is_bare_case
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.checks.registry import ALWAYS_ON
from mirotwin.verify.checks.watching import Checks

OPTION = "--regress"
SUFFIX = ".stream"
TOGETHER = ("image", "cases", "engine", "quiet", "bare", "checks")
"""Parameters of the command that go with it."""


def regress(folder: Path, image: Image, engine: str | None, quiet: bool, checks: tuple[str, ...] = ()) -> int:
    """Runs all cases of a folder on `image`; returns the exit code: 1 where one fails, 2 where one cannot be run.

    `checks`: those of --expect, for cases of a bare processor that name one.
    """
    cases = cases_in(folder)
    failed, unread = 0, 0
    unused = set(checks)
    with ProgressBar("running cases", len(cases), quiet) as bar:
        lines: list[str] = []
        for done, path in enumerate(cases, 1):
            try:
                if is_bare_case(path):
                    given = check_given(path, checks)
                    unused.discard(given or "")
                    problem = problem_of_bare_case(path, image, given)
                else:
                    problem = _problem(load_stream(str(path), engine), image, path)
            except (BadInput, click.ClickException) as error:
                unread += 1
                complain(
                    f"error: {error.format_message() if isinstance(error, click.ClickException) else error}"
                )
            else:
                failed += bool(problem)
                verdict = f"FAILED  {path}: {problem}" if problem else f"passed  {path}"
                lines.append(verdict)
            bar.to(done)
    for line in lines:
        if not quiet or line.startswith("FAILED"):
            show_line(line)
    count = f"{len(cases)} {'case' if len(cases) == 1 else 'cases'}"
    unable = f", {unread} not run" if unread else ""
    show_line(f"{count}: {len(cases) - failed - unread} passed, {failed} failed{unable}")
    if unused:
        remedy = "leave it out, or name the one that the cases have in [expect]"
        raise BadInput(folder, OPTION, f"no case is judged by --expect {sorted(unused)[0]}", remedy)
    return BAD_INPUT if unread else EXPECTATION_FAILED if failed else DONE


def cases_in(folder: Path) -> list[Path]:
    """The stream files of a folder and of those in it. Raises BadInput where there are none."""
    if not folder.is_dir():
        what = "is no folder" if folder.exists() else "there is no such folder"
        raise BadInput(folder, OPTION, what, "name the folder with the saved cases")
    found = sorted(path for path in folder.rglob(f"*{SUFFIX}") if path.is_file())
    if not found:
        remedy = f"put the cases of `mirotwin fuzz` there, whose names end in {SUFFIX}"
        raise BadInput(folder, OPTION, "holds no case", remedy)
    return found


def _problem(job: Job, image: Image, path: Path) -> str:
    """Why a case fails, or the empty string."""
    with plain_parameters(str(path), "run"):
        world = job.world(image)
        checks = Checks(world, expectations_of(job.scenario, str(path)))
        try:
            world.run_to(job.case.end_tick or world.periods * CONTROL_PERIOD_TICKS)
        except TransmissionError as error:
            raise BadInput(path, "", f"cannot be run beyond tick {world.tick}: {error}") from None
        checks.finish()
    if checks.failures:
        return str(checks.failures[0])
    for one in checks.verdicts():
        if one.verdict == "not judged" and one.kind == "liveness" and one.name not in ALWAYS_ON:
            return f"{one.name}: not judged: the run had no occasion for it"
    return ""


def refuse_others() -> None:
    """Raises UsageError for options of the command line that only a campaign has."""
    context = click.get_current_context()
    for param in context.command.params:
        typed = context.get_parameter_source(f"{param.name}") is ParameterSource.COMMANDLINE
        if typed and param.name not in TOGETHER:
            raise click.UsageError(f"{param.opts[0]} does not go with {OPTION}.")
