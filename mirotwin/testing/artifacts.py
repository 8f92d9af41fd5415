"""What a failed test leaves: the lines of its report, and a folder of its own with them, its case and its page."""

from __future__ import annotations

import hashlib
import json
import re
import shlex
from collections.abc import Sequence
from pathlib import Path

import msgspec
import tomli_w

from miro_sim.world.world import World
from mirotwin.report.page.bokeh_page import has_bokeh
from mirotwin.report.page.document import MOST_BYTES
from mirotwin.report.page.reproduction import reproduce
from mirotwin.report.page.run_page import Material, PageHeader, run_page
from mirotwin.shell.debug_files import source_folders
from mirotwin.testing.rig import Rig
from mirotwin.testing.waiting import WaitFailed, at
from mirotwin.verify.cases.artifacts import leave
from mirotwin.verify.cases.case import case_of_checks, case_text, tables_of
from mirotwin.verify.cases.rerun import case_of_expect
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.checks.interface import Failure

SUMMARY = "summary.json"
_NAME_CHARACTERS = 80


def test_line(nodeid: str, seed: int, firmware: str | None) -> str:
    """The command that runs the test again, with the same seed and firmware."""
    words = ["pytest", nodeid, "--mirotwin-seed", str(seed)]
    if firmware is not None:
        words += ["--mirotwin-firmware", firmware]
    return shlex.join(words)


test_line.__test__ = False  # type: ignore[attr-defined]


def story(rig: Rig, failures: Sequence[Failure], lines: Sequence[str]) -> str:
    """The section of a report: what ran, which checks failed, the last events, and `lines` to reproduce it."""
    image, world = rig.options.image, rig.world
    text = [
        f"scenario {rig.options.scenario.name}, seed {rig.options.seed}, {at(rig.tick)}",
        f"firmware {image.path.name}, {image.sha256[:12]}",
        f"digest {world.digest}",
        *(f"check failed: {one}" for one in failures),
        "last events:",
        *(f"  {line}" for line in rig.last_events() or ["nothing"]),
        "to reproduce:",
        *(f"  {line}" for line in lines),
    ]
    return "\n".join(text)


def folder_of(artifacts: Path, nodeid: str) -> Path:
    """The test's own folder: no other test has it, whatever characters the names have."""
    name = re.sub(r"[^\w.=+-]+", "-", nodeid).strip("-")[-_NAME_CHARACTERS:]
    return artifacts / f"{name}-{hashlib.sha256(nodeid.encode()).hexdigest()[:8]}"


def case_of(rig: Rig, failures: Sequence[Failure], caught: BaseException | None) -> str | None:
    """The case of a failed test; None where no check can judge what failed, or its test wrote into a robot's memory."""
    if rig.written:
        return None
    if isinstance(caught, WaitFailed) and caught.expect is not None:
        case = case_of_expect(rig.world, rig.trace, caught.expect)
        if case is not None:
            return case
    return case_of_checks(rig.world, rig.trace, rig.checks) if failures else None


def leave_test(folder: Path, rig: Rig, failures: Sequence[Failure], text: str, case: str | None) -> None:
    """Writes the folder."""
    sent = None if rig.written else case_text(rig.world, rig.trace, {}, "")
    summary = {**rig.facts(), "tick": rig.tick, "checks_failed": [str(one) for one in failures]}
    others = {SUMMARY: json.dumps(summary, indent=2) + "\n"}
    leave(folder, text + "\n", case, sent, rig.options.image, others)


def page_of(
    rig: Rig, name: str, caught: BaseException | None, text: str, again: Sequence[str]
) -> bytes | None:
    """The page of the run, made again from its input. `text`: the story of the failure, `again`: commands.

    None where Bokeh is not installed, where the test wrote into a robot's memory, and where the run cannot be made
    again: a report of a failure does not fail.
    """
    if rig.written or not has_bokeh():
        return None
    try:
        page = run_page(_material(rig, name, caught, text, again))
    except ValueError:  # what its own parts raise, too
        return None
    return page if len(page) <= MOST_BYTES else None


def _material(rig: Rig, name: str, caught: BaseException | None, text: str, again: Sequence[str]) -> Material:
    options = rig.options
    scenario = options.scenario
    expected = dict(options.expected)
    if isinstance(caught, WaitFailed) and caught.expect is not None:
        waited = msgspec.structs.replace(scenario, expect=dict(caught.expect))
        for place, checks in expectations_of(waited, scenario.name).items():
            known = [check.name for check in expected.get(place, ())]
            expected[place] = [*expected.get(place, ()), *(one for one in checks if one.name not in known)]
    world = World(scenario, options.seed, options.image, rig.trace.script())
    done = reproduce(world, rig.tick, expected)
    return Material(
        about=PageHeader(
            kind="failed test",
            file=name,
            name=name,
            seed=options.seed,
            firmware=options.image.path.name,
            firmware_sha256=options.image.sha256 or "",
            report=text,
            again=again,
            verdict="failed",
        ),
        scenario=scenario,
        scenario_text=tomli_w.dumps(tables_of(scenario)),
        periods=done.periods,
        again=done,
        sources=source_folders(options.image),
    )
