"""What is debugged: SUBJECT and the options that say how it runs, opened as a timeline with its symbols."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from miro_robot.firmware import source_folder
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.firmware.coverage_files import with_debug_files
from mirotwin.firmware.sources_option import SourceFolders
from mirotwin.firmware.subject import SubjectOptions, open_run
from mirotwin.rerun.inspected_run import BareRun, RobotRun
from mirotwin.shell.firmware_image import load_firmware


class DebugSubject(SubjectOptions, frozen=True, kw_only=True):
    """What is debugged, and where its C files are."""

    sources: SourceFolders = ()


class Session(NamedTuple):
    """`said`: what there is to know of a case before anything is asked."""

    timeline: Timeline
    symbols: Symbols
    said: list[str]


def open_subject(options: DebugSubject) -> Session:
    """Raises BadInput."""
    run = open_run(options)
    assert isinstance(run, RobotRun | BareRun)
    image = with_debug_files(run.image)
    folder = source_folder()
    own = [folder] if folder is not None and load_firmware(named=False).sha256 == run.image.sha256 else []
    return Session(Timeline(run), Symbols(image, [*map(Path, options.sources), *own]), [])
