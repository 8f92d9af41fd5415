"""Between pytest's items and rigs: making a test's rig, judging it, and telling what came of it."""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType
from typing import Any

import pytest

from miro_exact.bad_input import BadInput
from miro_sim.world.waits import WaitExpired
from mirotwin.testing.artifacts import SUMMARY, case_of, folder_of, leave_test, page_of, story, test_line
from mirotwin.testing.rig import Rig
from mirotwin.testing.waiting import WaitFailed
from mirotwin.verify.cases.artifacts import PAGE, case_lines, clear, report_line
from mirotwin.verify.cases.replay_line import foreign_path
from mirotwin.verify.rig_options import marker_options, rig_options

OWN = ("miro_", "mirotwin")
"""What our modules' names begin with."""
RIG = pytest.StashKey[Rig]()


def rig_for(item: pytest.Item, firmware: Path | None, seed: int) -> Rig:
    """The rig of a test; what its marker asks for and cannot have is an error of one line."""
    rig: Rig | None = None
    said = ""
    try:
        mark = marker_options([(mark.args, mark.kwargs) for mark in item.iter_markers("mirotwin")])
        rig = Rig(rig_options(mark, item.path.parent, firmware, seed))
    except ValueError as error:
        said = f"{item.nodeid}: {error}"
    if rig is None:
        pytest.fail(said, pytrace=False)
    item.stash[RIG] = rig
    return rig


def judge(item: pytest.Item) -> None:
    """Fails the test by the checks that failed."""
    try:
        said = "\n".join(f"check failed: {one}" for one in item.stash[RIG].judge())
    except BadInput as error:  # a check of the user's own that breaks
        said = str(error)
    if said:
        pytest.fail(said, pytrace=False)


def at_the_tests_line(item: pytest.Item, error: ValueError | TimeoutError) -> BaseException:
    """The error as the test sees it: without the frames of the world below the test's own line; a wait in words."""
    frames = []
    trace = error.__traceback__
    while trace is not None:
        frames.append(trace)
        trace = trace.tb_next
    while len(frames) > 1 and frames[-1].tb_frame.f_globals.get("__name__", "").startswith(OWN):
        frames.pop()
    kept = None
    for frame in reversed(frames):
        kept = TracebackType(kept, frame.tb_frame, frame.tb_lasti, frame.tb_lineno)
    shown: BaseException = error
    if isinstance(error, WaitExpired):
        shown = WaitFailed.of(error, item.stash[RIG].world)
    return shown.with_traceback(kept)


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
    failed = report.failed
    nodeid = (
        str(item.nodeid).replace(f"-seed{rig.options.seed}]", "]").replace(f"[seed{rig.options.seed}]", "")
    )
    file, _, name = nodeid.partition("::")
    file = os.path.relpath(Path(item.config.rootpath, file), item.config.invocation_params.dir)
    again = test_line(f"{file}::{name}", rig.options.seed, _relative(item.config, firmware))
    failures = _judged(rig) if failed else ()
    facts: dict[str, Any] = {**rig.facts(), "mirotwin_reproduce": again}
    report.user_properties += list(facts.items())
    item.user_properties += list(facts.items())  # JUnit takes them with the report of the teardown
    folder = folder_of(artifacts, item.nodeid) if artifacts is not None else None
    if folder is not None:
        clear(folder, SUMMARY)
    if not failed:
        return
    lines = [again]
    error = caught.value if caught is not None else None
    case = case_of(rig, failures, error)
    where = ""
    if folder is not None:
        where = str(_relative(item.config, folder))
        own = foreign_path(rig.options.image) is None
        lines += [] if case is None else case_lines(where, own)
    text = story(rig, failures, lines)
    if folder is not None and not rig.written:
        text += f"\n{report_line(where)}"
    report.sections.append(("mirotwin", text))
    if folder is not None:
        leave_test(folder, rig, failures, text, case)
        page = page_of(rig, item.nodeid, error, text, lines) if pages else None
        if page is not None:
            (folder / PAGE).write_bytes(page)


def let_go(item: pytest.Item) -> None:
    """The test is over: pytest keeps its items to the end of the session, worlds need not live as long."""
    if RIG in item.stash:
        del item.stash[RIG]


def _judged(rig: Rig) -> Any:
    try:
        return rig.judge()
    except BadInput:
        return ()


def _relative(config: pytest.Config, firmware: Path | None) -> str | None:
    """The path as one types it where pytest was called."""
    if firmware is None:
        return None
    here = Path(config.invocation_params.dir)
    return str(firmware.relative_to(here) if firmware.is_relative_to(here) else firmware)
