"""Between pytest's items and rigs: makes a test's rig, judges it, and reports its result. A failed test leaves a folder
with the lines of its report, its case and its page.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import pytest
from msgspec.structs import replace

from miro_exact.bad_input import BadInput
from miro_sim.world.waits import WaitExpired
from mirotwin.runs.result import Result
from mirotwin.shell.command import shell_line
from mirotwin.testing.rig import Rig
from mirotwin.testing.rig_options import rig_options
from mirotwin.testing.waiting import WaitFailed
from mirotwin.verify.cases.artifacts import case_lines, clear, leave, nothing_left, report_line
from mirotwin.verify.cases.replay_line import foreign_path
from mirotwin.verify.checks.interface import at

OWN = ("miro_", "mirotwin")
"""What our modules' names begin with."""
RIG = pytest.StashKey[Rig]()


def rig_for(item: pytest.Item, firmware: Path | None, seed: int) -> Rig:
    """The rig of a test; what its marker asks for and cannot have is an error of one line."""
    try:
        rig = Rig(rig_options(item.iter_markers("mirotwin"), item.path.parent, firmware, seed))
    except ValueError as error:
        raise pytest.fail.Exception(f"{item.nodeid}: {error}", pytrace=False) from None
    item.stash[RIG] = rig
    return rig


def judge(item: pytest.Item) -> None:
    """Fails the test by the checks that failed, and by those that it names and that had no occasion."""
    try:
        result = item.stash[RIG].judge()
    except BadInput as error:  # a check of the user's own that breaks
        pytest.fail(f"{error}", pytrace=False)
    for line in result.notes:
        item.add_report_section("call", "mirotwin", line)
    if result.lines:
        pytest.fail("\n".join(result.lines), pytrace=False)


def at_the_tests_line(item: pytest.Item, error: ValueError | TimeoutError) -> BaseException:
    """The error as the test sees it: without the frames of the world below the test's own line; a wait in words."""
    last = trace = error.__traceback__
    while trace is not None:
        if not trace.tb_frame.f_globals.get("__name__", "").startswith(OWN):
            last = trace
        trace = trace.tb_next
    if last is not None:
        last.tb_next = None
    world = item.stash[RIG].world
    shown = WaitFailed.of(error, world) if isinstance(error, WaitExpired) else error
    return shown.with_traceback(error.__traceback__)


def tell(
    item: pytest.Item,
    report: pytest.TestReport,
    caught: pytest.ExceptionInfo[BaseException] | None,
    firmware: Path | None,
    artifacts: Path | None,
    pages: bool,
) -> None:
    """Puts into a test's report what names its run, and where it failed the story; leaves its folder."""
    rig = item.stash[RIG]
    seed = rig.world.seed
    nodeid = item.nodeid.replace(f"-seed{seed}]", "]").replace(f"[seed{seed}]", "")
    file, _, name = nodeid.partition("::")
    file = os.path.relpath(Path(item.config.rootpath, file), item.config.invocation_params.dir)
    again = test_line(f"{file}::{name}", seed, _relative(item.config, firmware) if firmware else None)
    if report.failed:
        with suppress(BadInput):
            rig.judge()
    result = replace(rig.run.result(), again=again)
    facts = {"scenario": rig.world.scenario.name, **result.facts()}
    properties = [(f"mirotwin_{key}", value) for key, value in facts.items()]
    report.user_properties += properties
    item.user_properties += properties  # JUnit takes them with the report of the teardown
    folder = folder_of(artifacts, item.nodeid) if artifacts is not None else None
    text = ""
    if report.failed:
        failed_at = _failed_at(item, report, caught, result)
        text = story(rig, result, failed_at, [again])
    if folder is not None:
        try:
            clear(folder, SUMMARY)
            if report.failed:
                case = case_of(rig, None if caught is None else caught.value)
                text = _leave(rig, result, failed_at, case, folder, _relative(item.config, folder), facts)
        except (OSError, BadInput) as error:  # the failure is shown, whatever becomes of its files
            text = f"{text}\n{nothing_left(folder, error)}"
            with suppress(OSError, BadInput):
                clear(folder, SUMMARY)
            pages = False
    if text:
        report.sections.append(("mirotwin", text.lstrip("\n")))
    if pages and report.failed and folder is not None and not rig.written:
        from mirotwin.report.report_command import leave_page  # loads readers of recordings

        try:
            leave_page(folder, item.nodeid)
        except (OSError, ValueError) as error:  # also where Bokeh is missing
            report.sections.append(("mirotwin", f"no page: {error}"))


def _leave(
    rig: Rig,
    result: Result,
    failed_at: Sequence[str],
    case: str | None,
    folder: Path,
    where: str,
    facts: Mapping[str, str],
) -> str:
    """Writes the folder of a failed test; the story, with the commands that read it. Raises OSError."""
    more = [] if case is None else case_lines(where, foreign_path(rig.world.image) is None)
    text = story(rig, result, failed_at, [result.again, *more])
    if not rig.written:
        text += f"\n{report_line(where)}"
    sent = None if rig.written else rig.run.stream()
    summary = {**facts, "tick": rig.tick, "failed": result.lines}
    others = {SUMMARY: json.dumps(summary, indent=2) + "\n"}
    leave(folder, text + "\n", case, sent, rig.world.image, others)
    return text


def let_go(item: pytest.Item) -> None:
    """The test is over: pytest keeps its items to the end of the session, worlds need not live as long."""
    if RIG in item.stash:
        del item.stash[RIG]


def _relative(config: pytest.Config, path: Path) -> str:
    """The path as one types it where pytest was called."""
    here = Path(config.invocation_params.dir)
    return f"{path.relative_to(here) if path.is_relative_to(here) else path}"


SUMMARY = "summary.json"
_NAME_CHARACTERS = 80


def test_line(nodeid: str, seed: int, firmware: str | None) -> str:
    """The command that runs the test again, with the same seed and firmware."""
    words = ["pytest", nodeid, "--mirotwin-seed", str(seed)]
    if firmware is not None:
        words += ["--mirotwin-firmware", firmware]
    return shell_line(*words)


test_line.__test__ = False  # type: ignore[attr-defined]


def _failed_at(
    item: pytest.Item,
    report: pytest.TestReport,
    caught: pytest.ExceptionInfo[BaseException] | None,
    result: Result,
) -> list[str]:
    """The assertion that failed and its place; of what `judge` says, what is in no line of the result."""
    error = None if caught is None else caught.value
    if isinstance(error, pytest.fail.Exception) and not error.pytrace:
        return [line for line in f"{error}".splitlines() if line not in result.lines]
    crash = getattr(report.longrepr, "reprcrash", None)
    if crash is None:
        return [f"failed: {report.longreprtext}"]
    place = os.path.relpath(crash.path, item.config.invocation_params.dir)
    return [f"failed: {place}:{crash.lineno}: {crash.message}"]


def story(rig: Rig, result: Result, failed_at: Sequence[str], lines: Sequence[str]) -> str:
    """The section of a report: what ran, what failed where, the last events, and `lines` to reproduce it."""
    image, world = rig.world.image, rig.world
    text = [
        f"scenario {world.scenario.name}, seed {world.seed}, {at(rig.tick)}",
        f"firmware {image.path.name}, {image.sha256[:12]}",
        f"digest {world.digest}",
        *failed_at,
        *result.lines,
        "last events:",
        *(f"  {line}" for line in rig.last_events() or ["nothing"]),
        "to reproduce:",
        *(f"  {line}" for line in lines),
    ]
    return "\n".join(text)


def folder_of(artifacts: Path, nodeid: str) -> Path:
    """The test's own folder: no other test has it, whatever characters the names have."""
    name = re.sub(r"[^\w.=+-]+", "-", nodeid).strip("-")[-_NAME_CHARACTERS:]
    return artifacts / f"{name}-{hashlib.sha256(os.fsencode(nodeid)).hexdigest()[:8]}"


def case_of(rig: Rig, caught: BaseException | None) -> str | None:
    """The case of a failed test; None where no check can judge what failed, or its test wrote into a robot's memory."""
    if rig.written:
        return None
    if isinstance(caught, WaitFailed) and caught.expect is not None:
        case = rig.run.case_of_expect(caught.expect)
        if case is not None:
            return case
    return rig.run.case() if rig.run.failures else None
