"""What a failed test leaves behind: the lines of its report, and a folder of its own with them as files."""

from __future__ import annotations

import hashlib
import json
import re
import shlex
from collections.abc import Sequence
from pathlib import Path

from mirotwin.testing.rig import Rig
from mirotwin.testing.waiting import WaitFailed, at
from mirotwin.verify.cases.artifacts import leave
from mirotwin.verify.cases.case import case_of_checks, case_text
from mirotwin.verify.cases.rerun import case_of_expect
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
    image, world = rig.wanted.image, rig.world
    text = [
        f"scenario {rig.wanted.scenario.name}, seed {rig.wanted.seed}, {at(rig.tick)}",
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
    leave(folder, text + "\n", case, sent, rig.wanted.image, others)
