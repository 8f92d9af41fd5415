"""A case as a test: it passes where the check that failed passes, as it should on firmware that was mended.

A check that had no occasion to judge passes if it says "never" (safety), and fails if it says "within a time"
(liveness): firmware that does nothing at all has mended nothing. A stream that expects nothing is judged by the checks
that are always on.
"""

from __future__ import annotations

from collections.abc import Sequence

from miro_exact.bad_input import BadInput
from mirotwin.rerun.job import load_stream, rerun_job
from mirotwin.verify.cases.case import is_bare_case
from mirotwin.verify.checks.expect import ALWAYS_ON
from mirotwin.verify.steps.running import Outcome


class CaseTests:
    """Runs cases on `firmware` (None: the robot's own). `checks`: those of --check; `unused`: those without a case."""

    def __init__(self, firmware: str | None, checks: Sequence[str]) -> None:
        self.firmware = firmware
        self.checks = checks
        self.unused = set(checks)

    def run(self, path: str) -> Outcome:
        """Runs one; a case that cannot be run is an outcome, too."""
        try:
            return self._run_bare(path) if is_bare_case(path) else self._run(path)
        except BadInput as error:
            return Outcome(path, "error", (f"{error}",))

    def check_of(self, path: str) -> str | None:
        """The one of --check that a case names."""
        if not self.checks or not is_bare_case(path):
            return None
        from mirotwin.verify.bare.case import check_of_case  # loads the bare processor

        name = check_of_case(path)
        return next((text for text in self.checks if text.rpartition(":")[2] == name), None)

    def _run(self, path: str) -> Outcome:
        job = load_stream(path, self.firmware)
        again = rerun_job(job, job.case.end_tick or None)
        failure = again.failure
        lines: tuple[str, ...] = () if failure is None else (f"expectation failed: {failure}",)
        for one in again.checks.verdicts():
            if one.verdict == "not judged" and one.kind == "liveness" and one.name not in ALWAYS_ON:
                lines = lines or (f"expectation not judged: {one.name}: the run had no occasion for it",)
        return Outcome(
            path=path,
            verdict="fault" if failure is not None and failure.fault else "failed" if lines else "passed",
            lines=lines,
            tick=again.tick,
            seed=job.seed,
            digest=again.world.digest,
            firmware_sha256=job.runs_on.sha256 or "",
        )

    def _run_bare(self, path: str) -> Outcome:
        from mirotwin.verify.bare.case import load_case_firmware, rerun_bare_case

        image, check = load_case_firmware(path, self.firmware), self.check_of(path)
        self.unused.discard(check or "")
        failure = rerun_bare_case(path, image, check)[1].failure
        return Outcome(
            path=path,
            verdict="passed" if failure is None else "fault" if failure.fault else "failed",
            lines=() if failure is None else (f"expectation failed: {failure}",),
            firmware_sha256=image.sha256 or "",
        )
