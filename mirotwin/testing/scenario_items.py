"""Scenario files as tests of pytest: each `*.scenario.toml` that it collects is one test."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mirotwin.runs.result import Result
from mirotwin.runs.test_file import stem_of
from mirotwin.testing.session_options import desk_of, number_option, path_option
from mirotwin.testing.test_files import run_file
from mirotwin.testing.test_options import TestOptions


class ScenarioFailed(Exception):
    """A failed scenario file, with the report in lines: our traceback would not help."""


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
        file, firmware = relative(self.path), path_option(self.config, "firmware")
        options = TestOptions(
            paths=(file,),
            seed=self.seed,
            firmware=None if firmware is None else str(firmware),
            artifacts=path_option(self.config, "artifacts"),
            desk=desk_of(self.config),
        )
        try:
            result = run_file(options, file)
        except ValueError as error:
            raise ScenarioFailed(f"{error}") from None
        self._note(result)
        if result.verdict == "not observable":
            pytest.skip("; ".join(result.notes))
        if result.verdict != "passed":
            artifacts = [f"left in {relative(Path(result.folder))}"] if result.folder else []
            raise ScenarioFailed(
                "\n".join((*result.lines, *result.notes, f"again: {result.again}", *artifacts))
            )

    def _note(self, result: Result) -> None:
        self.user_properties += [(f"mirotwin_{name}", value) for name, value in result.facts().items()]
        if result.notes:
            self.add_report_section("call", "mirotwin", "\n".join(result.notes))

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
