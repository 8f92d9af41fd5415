"""Plug-ins in your own files, FILE.py:CLASS on the command line: laws, estimators, references, parts of boards."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec

from miro_exact import installed
from miro_exact.bad_input import BadInput
from miro_exact.plugins import Registry
from miro_host.registries import ESTIMATORS, LAWS, REFERENCES
from miro_sim.scenario.board_file import check_struct
from miro_sim.scenario.parts import PARTS
from miro_sim.scenario.plugins import plugins_used
from mirotwin.shell.command import Option, Options

FORM = "FILE.py:CLASS"
PART = Option(
    "--part",
    metavar=FORM,
    help="A part of your own that a board names, the class of its keys in a file; may be repeated.",
)
Parts = Annotated[tuple[str, ...], PART]
_IN_FILE = re.compile(r"(.+?\.py):(\w+)", re.DOTALL)


class PluginFiles(Options, frozen=True, kw_only=True):
    """Plug-ins in files, which scenarios and boards name by their tags."""

    laws: Annotated[
        tuple[str, ...],
        Option(
            "--law",
            metavar=FORM,
            help="A control law of your own, the class of its parameters in a file; it steers all robots, unless the"
            " scenario names it for some; may be repeated, and then the scenario has to.",
        ),
    ] = ()
    estimators: Annotated[
        tuple[str, ...], Option("--estimator", metavar=FORM, help="An estimator of your own, as --law.")
    ] = ()
    references: Annotated[
        tuple[str, ...], Option("--reference", metavar=FORM, help="A reference of your own, as --law.")
    ] = ()
    parts: Parts = ()

    def bring(self, prefix: str = "--") -> None:
        """Runs the files; scenarios and boards can name their plug-ins until the next call.

        Raises BadInput. `prefix`: of the options' names in messages.
        """
        for registry in (LAWS, ESTIMATORS, REFERENCES, PARTS):
            _bring(registry, getattr(self, f"{registry.word}s"), f"{prefix}{registry.word}")

    def settings(self, others: Sequence[str] = ()) -> tuple[str, ...]:
        """The settings by which one that was brought alone is that of all robots, unless one of `others` names it."""
        return tuple(self._settings(others))

    def _settings(self, others: Sequence[str]) -> Iterator[str]:
        for registry in (LAWS, ESTIMATORS, REFERENCES):
            names = list(registry.in_files)
            if len(names) == 1 and not any(re.search(rf"\b{re.escape(names[0])}\b", text) for text in others):
                yield f"{registry.word}={names[0]}"


NO_FILES = PluginFiles()


def unused_in(scenario: msgspec.Struct) -> list[str]:
    """A line for each plug-in of a file that the scenario does not name."""
    used = plugins_used(scenario, "{} {}".format)
    return [
        f"--{kind}: the scenario has no {kind} {name!r}, which the file brings; name it there, or by --set"
        for kind, name in installed.in_files
        if f"{kind} {name}" not in used
    ]


def _bring(registry: Registry[Any], given: Sequence[str], option: str) -> None:
    for name in registry.in_files:
        installed.in_files.pop((registry.word, name), None)
    registry.in_files.clear()
    for text in given:
        match = _IN_FILE.fullmatch(text)
        if match is None:
            raise BadInput(
                "", option, f"{text!r} is not {FORM}", f"write it as my_{registry.word}.py:Parameters"
            )
        path, name = match[1], match[2]
        struct: Any = registry.of_file(path, name, option)
        if registry is PARTS:
            with BadInput.at(path, f"{option} {name}"):
                check_struct(struct)
        tag = str(struct.__struct_config__.tag)
        if tag in registry.in_files:
            problem = f"there are two {registry.word}s {tag!r}"
            raise BadInput(path, f"{option} {name}", problem, "name one once")
        registry.in_files[tag] = struct
        sources = hashlib.sha256(Path(path).read_bytes()).hexdigest()[: installed.DIGITS]
        installed.in_files[registry.word, tag] = f"{Path(path).name}:{name}, sources {sources}"
