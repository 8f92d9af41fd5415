"""The options of `mirotwin test`, and the command that gives the verdict on one file again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from miro_robot.inspect.findings import Finding
from mirotwin.desk.guard import DeskOptions
from mirotwin.runs.sanitized import SanitizerOptions, place_of
from mirotwin.shell.command import Argument, Option, Options
from mirotwin.shell.options import (
    ARTIFACTS,
    JSON,
    JUNIT,
    NAME,
    QUIET,
    SET,
    Engine,
    Firmware,
    Seed,
)
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.verify.cases.replay_line import DebugLineOptions
from mirotwin.verify.expectations import Expected


class TestOptions(Options, frozen=True, kw_only=True):
    COMMAND = "test"
    __test__ = False  # for pytest: no test, whatever its name
    paths: Annotated[tuple[str, ...], Argument("DIR|FILE..", NAME, several=True)]
    word: Annotated[str, Option("-k", metavar="TEXT", help="Only files with TEXT in their path.")] = ""
    seed: Seed = 0
    settings: Annotated[
        tuple[str, ...], SET.saying("A key to set in each scenario, as for `run`; may be repeated.")
    ] = ()
    expected: Expected = ()
    firmware: Firmware = None
    plugins: PluginFiles = PluginFiles()
    engine: Engine = None
    as_json: Annotated[bool, JSON.saying("Print one JSON document instead of lines.")] = False
    junit: Annotated[Path | None, JUNIT.saying("Write the verdicts as JUnit XML, too.")] = None
    artifacts: Annotated[
        Path | None,
        ARTIFACTS.saying(
            "Folder for what files leave: worlds that `save` steps keep; of one that fails its case, for `replay`."
        ),
    ] = None
    pages: Annotated[
        bool, Option(help="Make the page of each failure, as `report` does.", needs="artifacts")
    ] = False
    sanitizer: SanitizerOptions = SanitizerOptions()
    desk: DeskOptions = DeskOptions()
    quiet: Annotated[bool, QUIET.saying("No line for a file that passed.")] = False

    def debug_line_for(self, file: str, finding: Finding | None = None) -> str:
        """The command that opens the debugger at the failed step of this scenario, or at a finding; "" if there is
        none.
        """
        if self.desk.port or self.expected or (finding is None and not file.endswith(".toml")):
            return ""
        run: dict[str, Any] = {"seed": self.seed or None, "settings": self.settings}
        if not file.endswith(".toml"):
            run = {}  # a case has its own
        if finding is not None:
            run |= place_of(finding)
        return DebugLineOptions(file=file, firmware=self.firmware, plugins=self.plugins, **run).command_line()

    def line_for(self, file: str, saves: bool = False) -> str:
        """The command that gives the verdict on this scenario again; one that saves worlds needs a folder for them."""
        again = TestOptions(
            paths=(file,),
            seed=self.seed,
            settings=self.settings,
            expected=self.expected,
            firmware=self.firmware,
            plugins=self.plugins,
            artifacts=self.artifacts if saves else None,
            sanitizer=self.sanitizer,
            desk=self.desk,
        )
        return again.command_line()
