"""The options of `mirotwin test`, and the command that gives the verdict on one file again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from mirotwin.desk.guard import DeskOptions
from mirotwin.shell.command import Argument, Option, Options
from mirotwin.shell.options import (
    ALLOW,
    ARTIFACTS,
    JSON,
    JUNIT,
    NAME,
    QUIET,
    SANITIZE,
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
    sanitize: Annotated[bool, SANITIZE] = False
    allow: Annotated[str | None, ALLOW.saying(ALLOW.help, needs="sanitize")] = None
    desk: DeskOptions = DeskOptions()
    quiet: Annotated[bool, QUIET.saying("No line for a file that passed.")] = False

    def debug_line_for(self, file: str, at: str = "") -> str:
        """The command that stands at the failed step of this scenario, or at a tick; "" where it cannot."""
        if self.desk.port or self.expected or not file.endswith(".toml"):
            return ""
        return DebugLineOptions(
            file=file,
            firmware=self.firmware,
            plugins=self.plugins,
            seed=self.seed or None,
            settings=self.settings,
            at=at,
        ).command_line()

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
            sanitize=self.sanitize,
            allow=self.allow,
            desk=self.desk,
        )
        return again.command_line()
