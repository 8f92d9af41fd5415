"""Which lines of the firmware a test session ran: `pytest --firmware-coverage=firmware.info`."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from miro_exact.bad_input import BadInput
from miro_robot.firmware import source_folder
from miro_robot.image.debug_info import Sources
from miro_robot.inspect.counters import Counters
from miro_robot.inspect.coverage import Counts, counts_of, line_share, merged
from miro_robot.inspect.watcher import Inspector, attach
from miro_robot.mcs51.cpu import Cpu, on_load
from mirotwin.firmware import coverage_files as firmware_coverage
from mirotwin.firmware.coverage_files import Report, table, write
from mirotwin.shell.debug_files import checked_sources
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.outputs import check_file

OUTPUT = "firmware_coverage"
"""Under this name a pytest-xdist worker hands over its counts."""
TABLE_COLUMNS = 160


class FirmwareCoverage:
    """Firmware coverage of one session. The controller of pytest-xdist adds up its workers' counts."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.out = Path(config.getoption("--firmware-coverage"))
        self.wanted: float = config.getoption("--firmware-coverage-fail-under") or 0.0
        self.from_workers: list[Counts] = []
        self.counters = Counters()
        self.problem = ""
        try:
            self.image = load_firmware(config.getoption("--firmware-image"))
            check_file(self.out, "--firmware-coverage", self.image.path)
            checked_sources(config.getoption("--firmware-sources"), "--firmware-sources")
        except ValueError as error:
            raise pytest.UsageError(str(error)) from None
        on_load.set(self.watch)

    def watch(self, cpu: Cpu) -> None:
        """Counts the instructions of `cpu` from now on, if it runs the session's image."""
        inspector = cpu.inspector
        watched = isinstance(inspector, Inspector) and self.counters in inspector.watchers
        if not watched and cpu.code == self.image.code:
            attach(cpu, self.counters)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if hasattr(session.config, "workeroutput"):  # a worker of pytest-xdist: JSON has no numbers as keys
            counts = counts_of(self.counters)
            session.config.workeroutput[OUTPUT] = [[address, *both] for address, both in counts.items()]
            return
        try:
            write(self._report.tracefile, self._report, self.out, "--firmware-coverage")
        except (OSError, BadInput) as error:
            self.problem = f"cannot be written: {error}"
        if session.exitstatus == pytest.ExitCode.OK and (self.problem or self._too_few()):
            failed, usage = pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.USAGE_ERROR
            session.exitstatus = usage if self.problem else failed

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        handed: Iterable[tuple[int, int, int]] = getattr(node, "workeroutput", {}).get(OUTPUT, ())
        self.from_workers.append({address: (executed, jumped) for address, executed, jumped in handed})

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        if hasattr(self.config, "workeroutput"):  # the controller's file has the counts of all
            return
        report = self._report
        outcome = self.problem or f"written to {self.out}"
        terminalreporter.section(f"coverage of {self.image.path.name}, {outcome}")
        console = Console(highlight=False, markup=False, width=TABLE_COLUMNS)
        with console.capture() as capture:
            console.print(table(report.tracefile))
            console.print(f"instructions: {report.instructions}")
        for line in capture.get().splitlines():
            terminalreporter.write_line(line.rstrip())
        if self._too_few():
            terminalreporter.write_line(
                f"fewer lines ran than the {self.wanted} % of --firmware-coverage-fail-under", red=True
            )

    @cached_property
    def _report(self) -> Report:
        """Of the whole session: for when its last test has run."""
        given = map(Path, self.config.getoption("--firmware-sources"))
        folders = filter(None, (*given, self.image.path.parent, source_folder()))
        counts = merged([counts_of(self.counters), *self.from_workers])
        return firmware_coverage.collect(self.image, counts, Sources(folders), self.out)

    def _too_few(self) -> bool:
        share = line_share(self._report.tracefile)
        return bool(share.total) and 100.0 * share.hit / share.total < self.wanted
