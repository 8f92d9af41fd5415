"""`--part`, the option by which commands are given parts of boards that are in a file."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from miro_exact import installed
from miro_exact.bad_input import BadInput
from miro_sim.scenario.board_file import check_struct
from miro_sim.scenario.parts import PARTS
from mirotwin.shell.command import Option

PART = Option(
    "--part",
    metavar="FILE.py:CLASS",
    help="A part of your own that a board names, the class of its keys in a file; may be repeated.",
)
Parts = Annotated[tuple[str, ...], PART]
_IN_FILE = re.compile(r"(.+?\.py):(\w+)", re.DOTALL)


def bring_parts(given: Sequence[str], option: str = PART.names[0]) -> None:
    """Runs the files of `option`; boards can name their parts until it is read again. Raises BadInput."""
    for name in PARTS.in_files:
        installed.in_files.pop((PARTS.word, name), None)
    PARTS.in_files.clear()
    for text in given:
        match = _IN_FILE.fullmatch(text)
        if match is None:
            raise BadInput("", option, f"{text!r} is not FILE.py:CLASS", "write it as sonar.py:Sonar")
        path, name = match[1], match[2]
        struct = PARTS.of_file(path, name, option)
        with BadInput.at(path, f"{option} {name}"):
            check_struct(struct)
        tag = str(struct.__struct_config__.tag)
        if tag in PARTS.in_files:
            raise BadInput(path, f"{option} {name}", f"there are two parts {tag!r}", "name one once")
        PARTS.in_files[tag] = struct
        sources = hashlib.sha256(Path(path).read_bytes()).hexdigest()[: installed.DIGITS]
        installed.in_files[PARTS.word, tag] = f"{Path(path).name}:{name}, sources {sources}"
