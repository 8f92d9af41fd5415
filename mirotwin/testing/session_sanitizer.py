"""The sanitizer's findings in the runs of a test session: `pytest --mirotwin-sanitize`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest

from miro_exact.bad_input import BadInput
from miro_robot.inspect.findings import KINDS
from mirotwin.runs.run import on_world
from mirotwin.runs.sanitized import Sanitized, judged, line_of, read_allowed, stale_line

OUTPUT = "sanitizer"
"""Under this name a pytest-xdist worker hands over its findings."""


class SanitizedSession:
    """Of one session. `found`: what a finding is -> (its line, the first test that showed it). `used`: lines of
    --mirotwin-sanitize-allow that fit a finding. Raises UsageError.
    """

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.kinds: list[str] = config.getoption("--mirotwin-sanitize-kind")
        if unknown := [kind for kind in self.kinds if kind not in KINDS]:
            raise pytest.UsageError(
                f"--mirotwin-sanitize-kind: {unknown[0]!r} is no kind; use {', '.join(KINDS)}"
            )
        self.path = config.getoption("--mirotwin-sanitize-allow")
        try:
            path = None if self.path is None else f"{config.invocation_params.dir / self.path}"
            self.allowed = read_allowed(path)
        except (BadInput, OSError) as error:
            raise pytest.UsageError(f"--mirotwin-sanitize-allow: {error}") from None
        self.used: set[int] = set()
        self.found: dict[str, tuple[str, str]] = {}
        self.watching = Sanitized()
        on_world.set(self.watching.watch)

    @pytest.hookimpl(trylast=True)
    def pytest_runtest_teardown(self, item: pytest.Item) -> None:
        findings, stale = judged(self.watching.take(), self.allowed, self.kinds)
        self.used |= {entry.number for entry in self.allowed if entry not in stale}
        self._add((finding.key, line_of(finding)[1], item.nodeid) for finding in findings)

    def _add(self, findings: Iterable[tuple[str, str, str]]) -> None:
        for key, line, test in findings:
            if key not in self.found or (line.startswith("did") and not self.found[key][0].startswith("did")):
                self.found[key] = line, test

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if hasattr(session.config, "workeroutput"):  # a worker of pytest-xdist
            session.config.workeroutput[OUTPUT] = (
                [[key, *both] for key, both in self.found.items()],
                [*self.used],
            )
        elif self.found and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_unconfigure(self) -> None:
        on_world.set(None)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        findings, used = getattr(node, "workeroutput", {}).get(OUTPUT, ((), ()))
        self._add(findings)
        self.used.update(used)

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        if hasattr(self.config, "workeroutput"):
            return
        terminalreporter.section("sanitizer")
        stale = [stale_line(self.path, entry) for entry in self.allowed if entry.number not in self.used]
        for line in (*self.watching.unseen, *stale):
            terminalreporter.write_line(line)
        for line, test in sorted(self.found.values()):
            terminalreporter.write_line(line, red=True)
            terminalreporter.write_line(f"    first in {test}")
        if not self.found:
            terminalreporter.write_line("nothing found")
