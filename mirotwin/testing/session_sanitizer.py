"""What firmware did without noticing in the runs of a test session: `pytest --mirotwin-sanitize`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest

from mirotwin.runs.run import on_world
from mirotwin.runs.sanitized import Sanitized, line_of

OUTPUT = "sanitizer"
"""Under this name a pytest-xdist worker hands over its findings."""


class SanitizedSession:
    """Of one session. `found`: what a finding is -> (its line, the first test that showed it)."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.found: dict[str, tuple[str, str]] = {}
        self.watching = Sanitized()
        on_world.set(self.watching.watch)

    @pytest.hookimpl(trylast=True)
    def pytest_runtest_teardown(self, item: pytest.Item) -> None:
        self._add((one.key, line_of(one)[1], item.nodeid) for one in self.watching.take())

    def _add(self, found: Iterable[tuple[str, str, str]]) -> None:
        for key, line, test in found:
            if key not in self.found or (line.startswith("did") and not self.found[key][0].startswith("did")):
                self.found[key] = line, test

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if hasattr(session.config, "workeroutput"):  # a worker of pytest-xdist
            session.config.workeroutput[OUTPUT] = [[key, *both] for key, both in self.found.items()]
        elif self.found and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_unconfigure(self) -> None:
        on_world.set(None)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        self._add(getattr(node, "workeroutput", {}).get(OUTPUT, ()))

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        if hasattr(self.config, "workeroutput"):
            return
        terminalreporter.section("sanitizer")
        for line in self.watching.unseen:
            terminalreporter.write_line(line)
        for line, test in sorted(self.found.values()):
            terminalreporter.write_line(line, red=True)
            terminalreporter.write_line(f"    first in {test}")
        if not self.found:
            terminalreporter.write_line("nothing found")
