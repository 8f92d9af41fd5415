"""Between pytest's items and rigs: makes a test's rig, judges it, and reports its result. A failed test leaves a folder
with the lines of its report, its case and its page.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from msgspec.structs import replace

from miro_exact.bad_input import BadInput
from miro_sim.world.machine import NotObservable
from miro_sim.world.waits import WaitExpired
from miro_sim.world.world import World
from mirotwin.runs.result import Result
from mirotwin.shell.command import shell_line
from mirotwin.shell.debug_files import Place
from mirotwin.shell.outputs import RECORDING
from mirotwin.testing.rig import Rig
from mirotwin.testing.rig_options import rig_options
from mirotwin.testing.session_options import FILES_OF, desk_of, path_option
from mirotwin.testing.waiting import WaitFailed
from mirotwin.verify.cases.artifacts import clear, leave, nothing_left, report_line

if TYPE_CHECKING:
    from mirotwin.testing.port_rig import PortRig

    AnyRig = Rig | PortRig

OWN = ("miro_", "mirotwin")
"""Prefixes of our modules' names."""
RIG = pytest.StashKey["AnyRig"]()
REPORTED = (ValueError, TimeoutError, NotObservable, AttributeError)
"""Errors of a test that are shown otherwise than they were raised."""
OF_A_TWIN = {*dir(World), *World.STATE, *World.NOT_STATE}


def rig_for(item: pytest.Item, seed: int) -> AnyRig:
    """The rig of a test; a request of its marker that cannot be fulfilled is an error of one line."""
    desk = desk_of(item.config)
    try:
        firmware = path_option(item.config, "firmware")
        options = rig_options(item.iter_markers("mirotwin"), item.path.parent, firmware, seed)
        if desk.port:
            from mirotwin.testing.port_rig import PortRig  # loads pyserial

            rig: AnyRig = PortRig(options, desk, item.name)
        else:
            rig = Rig(options)
    except NotObservable as error:
        pytest.skip(f"{error}")
    except ValueError as error:
        line = f"{error}" if desk.port else f"{item.nodeid}: {error}"
        raise pytest.fail.Exception(line, pytrace=False) from None
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


def as_the_test_sees_it(item: pytest.Item, error: BaseException) -> BaseException:
    """The error without our frames below the test's own line, and a failed wait in words.

    A test that needs something a port cannot show is skipped.
    """
    machine = item.stash[RIG].machine
    if isinstance(error, AttributeError):
        if error.obj is not machine or error.name not in OF_A_TWIN or isinstance(machine, World):
            return error
        error = NotObservable(f"world.{error.name}: not observable on a port: only a twin has it")
    if isinstance(error, NotObservable):
        return pytest.skip.Exception(f"{error}")
    last = trace = error.__traceback__
    while trace is not None:
        if not trace.tb_frame.f_globals.get("__name__", "").startswith(OWN):
            last = trace
        trace = trace.tb_next
    if last is not None:
        last.tb_next = None
    shown = WaitFailed.of(error, machine) if isinstance(error, WaitExpired) else error
    return shown.with_traceback(error.__traceback__)


def tell(
    item: pytest.Item, report: pytest.TestReport, caught: pytest.ExceptionInfo[BaseException] | None
) -> None:
    """Adds the run's facts and, for a failure, the story to a test's report; writes its folder."""
    rig, seed = item.stash[RIG], item.stash[RIG].spec.seed
    if report.failed:
        with suppress(BadInput):
            rig.judge()
    result = replace(rig.result(), again=test_line(item, seed))
    if report.failed:
        error = None if caught is None else caught.value
        result = rig.located(error, result)
        if result.place is None and (crash := getattr(report.longrepr, "reprcrash", None)) is not None:
            result = replace(result, place=Place(_relative(item.config, Path(crash.path)), crash.lineno))
    facts = {"scenario": rig.spec.scenario.name, **result.facts()}
    artifacts = path_option(item.config, "artifacts")
    folder = None if artifacts is None else folder_of(artifacts, item.nodeid)
    if not report.failed:
        with suppress(OSError, BadInput):
            if folder is not None:
                clear(folder, SUMMARY, RECORDING)
        _note(item, report, facts)
        return
    failed_at = _failed_at(item, report, caught, result)
    text = story(rig, result, failed_at, [result.again])
    files: dict[str, bytes] = {}
    if folder is not None:
        where = _relative(item.config, folder)
        summary = {**facts, "tick": rig.tick, "failed": result.lines}
        try:
            clear(folder, SUMMARY, RECORDING)
            files, lines = rig.left(None if caught is None else caught.value, where)
            facts |= dict(zip(("replay", "debug"), lines, strict=False))
            more = story(rig, result, failed_at, [result.again, *lines])
            more += f"\n{report_line(where)}" * bool(files and result.has_page)
            leave(folder, f"{more}\n", {SUMMARY: json.dumps(summary, indent=2).encode() + b"\n", **files})
            text = more
        except (OSError, BadInput) as error:  # the failure is shown, whatever becomes of its files
            text, files = f"{text}\n{nothing_left(folder, error)}", {}
            with suppress(OSError, BadInput):
                clear(folder, SUMMARY, RECORDING)
    report.sections.append(("mirotwin", text))
    _note(item, report, facts)
    if files and folder is not None and item.config.getoption("--mirotwin-pages"):
        from mirotwin.report.report_command import leave_page  # loads readers of recordings

        try:
            leave_page(folder, item.nodeid)
        except (OSError, ValueError) as error:  # also where Bokeh is missing
            report.sections.append(("mirotwin", f"no page: {error}"))


def _note(item: pytest.Item, report: pytest.TestReport, facts: dict[str, str | int | float]) -> None:
    """Puts the facts into the properties, which JUnit takes with the report of the teardown."""
    properties: list[tuple[str, object]] = [(f"mirotwin_{key}", value) for key, value in facts.items()]
    report.user_properties += properties
    item.user_properties += properties


def let_go(item: pytest.Item) -> None:
    """Releases the test's world: pytest holds its items to the end of the session, but worlds may be freed earlier."""
    if RIG in item.stash:
        del item.stash[RIG]


def _relative(config: pytest.Config, path: Path) -> str:
    """The path as one types it where pytest was called."""
    here = Path(config.invocation_params.dir)
    return f"{path.relative_to(here) if path.is_relative_to(here) else path}"


SUMMARY = "summary.json"
_NAME_CHARACTERS = 80


def test_line(item: pytest.Item, seed: int) -> str:
    """The command that runs the test again, with the same seed and firmware, or at the same port."""
    nodeid = item.nodeid.replace(f"-seed{seed}]", "]").replace(f"[seed{seed}]", "")
    file, _, name = nodeid.partition("::")
    file = os.path.relpath(Path(item.config.rootpath, file), item.config.invocation_params.dir)
    words = ["pytest", f"{file}::{name}", "--mirotwin-seed", str(seed)]
    if (firmware := path_option(item.config, "firmware")) is not None:
        words += ["--mirotwin-firmware", _relative(item.config, firmware)]
    for kind in FILES_OF:
        for text in item.config.getoption(f"--mirotwin-{kind}"):
            words += [f"--mirotwin-{kind}", text]
    for option in ("--mirotwin-port", "--mirotwin-allow-motion", "--mirotwin-max-speed"):
        if value := item.config.getoption(option):
            words += [option] if value is True else [option, f"{value}"]
    return shell_line(*words)


test_line.__test__ = False  # type: ignore[attr-defined]


def _failed_at(
    item: pytest.Item,
    report: pytest.TestReport,
    caught: pytest.ExceptionInfo[BaseException] | None,
    result: Result,
) -> list[str]:
    """The failed assertion with its place; of a failure found by `judge`, the parts that no line of the result
    contains.
    """
    error = None if caught is None else caught.value
    if isinstance(error, pytest.fail.Exception) and not error.pytrace:
        return [line for line in f"{error}".splitlines() if line not in result.lines]
    crash = getattr(report.longrepr, "reprcrash", None)
    if crash is None:
        return [f"failed: {report.longreprtext}"]
    place = os.path.relpath(crash.path, item.config.invocation_params.dir)
    return [f"failed: {place}:{crash.lineno}: {crash.message}"]


def story(rig: AnyRig, result: Result, failed_at: Sequence[str], lines: Sequence[str]) -> str:
    """The section of a report: the run, the failure with its place, the last events, and `lines` to reproduce it."""
    text = [
        *rig.head(),
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
