"""Reads a user's folder of inputs: recordings, stream files, captures, and inputs of earlier campaigns. In a folder
that a campaign or afl-fuzz wrote, the queue folders are read, too. Hidden files are ignored. Files of other kinds are
skipped and named in one line; a folder without any input is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from miro_exact.bad_input import BadInput, amount
from miro_exact.inputs import TEXT_BYTES
from miro_protocol import stream
from miro_protocol.actions import ScriptItem
from mirotwin.recording.capture.detect import detect
from mirotwin.recording.capture.forms import FORMS
from mirotwin.recording.capture.input import Input
from mirotwin.recording.capture.source import READ_ERRORS, open_capture

OPTION = "--corpus"
INPUT_BYTES = 8192
"""Longer files are no inputs."""
QUEUES = ("corpus", "queue", "*/queue", "engine/*/queue")
FOREIGN = (
    ".c", ".h", ".py", ".ihx", ".hex", ".map", ".cdb", ".m51", ".rst", ".toml", ".json", ".xml", ".yml", ".yaml",
    ".mcap", ".stream",  # damaged ones: what is whole was recognised by its content
    ".md", ".txt", ".log", ".png", ".jpg", ".pdf", ".csv", ".vcd", ".zip", ".gz", ".info", ".lst", ".world",
)  # fmt: skip
"""Suffixes of files that are no inputs, whatever bytes they hold."""
TIMED = ("pcapng", "pcap", "recording", "stream")
"""Formats that are read as transmissions; other text could also be a raw input."""
_NAMED = 3
MOST = 2000
"""Inputs that are taken from a folder."""


Convert = Callable[[Iterable[ScriptItem]], list[bytes]]
"""Converts transmissions and actions to inputs."""


def read_corpus(folder: Path, convert: Convert) -> tuple[list[bytes], list[str]]:
    """The inputs in a folder, no two the same, and notes for the user about files that are none.

    Raises BadInput where there are none.
    """
    if not folder.is_dir():
        reason = "is no folder" if folder.exists() else "there is no such folder"
        raise BadInput(folder, OPTION, reason, "name a folder of .stream, .mcap or input files")
    inputs: dict[bytes, None] = {}
    foreign: list[str] = []
    notes: list[str] = []
    files = list(_files(folder))
    for path in files:
        try:
            taken = _inputs_in(path, convert)
        except (*READ_ERRORS, OSError) as error:
            notes.append(f"{OPTION}: passed over: {error}")
            continue
        if taken:
            inputs.update(dict.fromkeys(taken))
        else:
            foreign.append(path.name)
    if not inputs:
        held = f"no input among {amount(len(files), 'file')}" if files else "holds no file"
        more = f" ({notes[0].removeprefix(f'{OPTION}: passed over: ')})" if notes else ""
        remedy = "put .stream or .mcap files, or inputs of an earlier campaign there, or leave --corpus out"
        raise BadInput(folder, OPTION, f"{held}{more}", remedy)
    if foreign:
        names = ", ".join(foreign[:_NAMED]) + (", .." if len(foreign) > _NAMED else "")
        files_text = amount(len(foreign), "file that is no input", "files that are no inputs")
        notes.append(f"{OPTION} {folder}: passed over {files_text}: {names}")
    if len(inputs) > MOST:
        notes.append(f"{OPTION} {folder}: {len(inputs)} inputs, of which the first {MOST} are taken")
    return list(inputs)[:MOST], notes


def _files(folder: Path) -> Iterator[Path]:
    places = [folder, *(place for queue in QUEUES for place in sorted(folder.glob(queue)))]
    for place in dict.fromkeys(places):
        if place.is_dir():
            yield from (path for path in sorted(place.iterdir()) if path.is_file() and path.name[0] != ".")


def _inputs_in(path: Path, convert: Convert) -> list[bytes]:
    """The content of a file as inputs; none for a file of another kind."""
    with Input(str(path)) as given:
        format = detect(given.peek()).form
        if format in TIMED:
            by_network: dict[int, list[ScriptItem]] = {}
            for item in _script(given, format):
                by_network.setdefault(item.network, []).append(item)
            return [data for sent in by_network.values() for data in convert(sent)]
    if path.suffix.lower() in FOREIGN or not 0 < path.stat().st_size <= INPUT_BYTES:
        return []
    return [path.read_bytes()]


def _script(given: Input, format: str) -> Iterator[ScriptItem]:
    if format == "stream":  # may hold what is done to robots, too
        return iter(stream.decode(given.read(TEXT_BYTES), given.label).script())
    return open_capture(given, lambda text: None, form=FORMS[format]).sent
