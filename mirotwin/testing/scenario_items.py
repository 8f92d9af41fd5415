"""Scenario files as tests of pytest: each `*.scenario.toml` that it collects is one test."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mirotwin.shell.firmware_image import load_firmware
from mirotwin.testing.port_fixtures import desk_of
from mirotwin.testing.port_test import run_port_test
from mirotwin.testing.pytest_plugin import number_option, path_option
from mirotwin.testing.test_command import TestOptions
from mirotwin.verify.steps.running import Outcome, run_test, stem_of


class ScenarioFailed(Exception):
    """What is wrong, in lines: no traceback of ours helps."""


class ScenarioFile(pytest.File):
    """A `*.scenario.toml`: one test, or with `--mirotwin-repeat N` one for each of N seeds."""

    def collect(self) -> Iterator[pytest.Item]:
        name, first = stem_of(str(self.path)), number_option(self.config, "seed", 0)
        repeat = number_option(self.config, "repeat", 1)
        for seed in range(first, first + repeat):
            item = ScenarioItem.from_parent(self, name=f"{name}[seed{seed}]" if repeat > 1 else name)
            item.seed = seed
            yield item


class ScenarioItem(pytest.Item):
    """Its run with one seed."""

    seed = 0

    def runtest(self) -> None:
        firmware = path_option(self.config, "firmware")
        seed = self.seed
        file, desk = relative(self.path), desk_of(self.config)
        again = TestOptions(
            paths=(file,), seed=seed, firmware=None if firmware is None else str(firmware), desk=desk
        ).command_line()
        try:
            image = load_firmware(firmware)
        except ValueError as error:
            raise ScenarioFailed(f"{error}") from None
        artifacts = path_option(self.config, "artifacts")
        if desk.port:
            outcome = run_port_test(file, image, desk, (), artifacts)
        else:
            outcome = run_test(file, image, seed, artifacts=artifacts, again=again)
        self._note(outcome, again)
        if outcome.verdict == "not observable":
            pytest.skip("; ".join(outcome.notes))
        if outcome.verdict != "passed":
            left = [f"left in {relative(Path(outcome.left))}"] if outcome.left else []
            raise ScenarioFailed("\n".join((*outcome.lines, *outcome.notes, f"again: {again}", *left)))

    def _note(self, outcome: Outcome, again: str) -> None:
        facts = {
            "mirotwin_seed": outcome.seed,
            "mirotwin_digest": outcome.digest,
            "mirotwin_firmware_sha256": outcome.firmware_sha256,
            "mirotwin_reproduce": again,
        }
        self.user_properties += list(facts.items())
        if outcome.notes:
            self.add_report_section("call", "mirotwin", "\n".join(outcome.notes))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        if isinstance(excinfo.value, ScenarioFailed):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        return self.path, None, self.name


def relative(path: Path) -> str:
    """The path as one types it here."""
    try:
        return os.path.relpath(path)
    except ValueError:  # on another drive
        return str(path)
