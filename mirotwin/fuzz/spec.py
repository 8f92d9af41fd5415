"""What a process needs to know to make a target: one JSON text, handed from process to process.

Nothing here imports a hot module: the process that reads a specification chooses its engine by it.
"""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from miro_exact.bad_input import BadInput

MAP_SIZE = 8192
"""Bytes of the edge map. AFL++ is 1.5 times as fast with it as with its own 64 KiB; firmware has some hundred edges."""

Whole = Annotated[int, Meta(ge=0)]


class TargetSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A target, as data.

    `board`: "miro" is the robot's, "bare" a CPU with a UART, "wired" one with parts. `image`: path of an Intel HEX
    file, "" is the robot's own firmware. `input`: how the bytes of an input are read ("bytes", "frames" or "session").
    `robots` and `slot` are the MIRO's. `protocol`: name of the wire format of frames, "" for the board's own;
    `expected`: checks as --expect takes them, which judge each execution beside the board's own; `baud`: rate of the
    CPU's UART, 0 for what its maker takes; `after_ticks`: how long a run goes on after its last character, None for the
    harness's own. `parameters`: all else that a maker takes;
    `faults`: the MIRO's hardware breaks, too. `engine`: "compiled" or "python", "" for the one that is
    installed.
    `maker`: "module:function" in the place of the board's own maker.
    """

    board: Literal["miro", "bare", "wired"] = "miro"
    image: str = ""
    input: str = "session"
    robots: Whole = 3
    slot: Whole = 0
    protocol: str = ""
    expected: tuple[str, ...] = ()
    baud: Whole = 0
    after_ticks: Whole | None = None
    parameters: dict[str, Any] = {}
    faults: bool = False
    engine: Literal["", "compiled", "python"] = ""
    maker: str = ""

    def text(self) -> str:
        """JSON of one line, in ASCII: paths come back whole that are not UTF-8, which msgspec does not write.

        `@@` never stands in it: afl-fuzz would put the name of a file there.
        """
        return json.dumps(msgspec.to_builtins(self)).replace("@@", "@\\u0040")


def spec_of(text: str) -> TargetSpec:
    """The specification that `text` is the JSON of. Raises BadInput, which names the field."""
    try:
        return msgspec.convert(json.loads(text), TargetSpec)
    except (ValueError, msgspec.ValidationError) as error:
        remedy = f"give JSON with {', '.join(TargetSpec.__struct_fields__)}"
        raise BadInput("target", "", f"{error}", remedy) from None
