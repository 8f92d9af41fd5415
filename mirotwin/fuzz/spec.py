"""The specification of a target: one JSON text, passed from process to process. This module imports no hot module: the
process that reads a specification chooses its engine by it.
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
    file, "" is the robot's own firmware. `input`: interpretation of an input's bytes ("bytes", "frames" or "session").
    `robots` and `slot` are for the MIRO. `protocol`: name of the wire format of frames, "" for the board's own;
    `expected`: checks as in --expect, which judge each execution besides the board's own checks; `baud`: rate of the
    CPU's UART, 0 for the maker's default; `after_ticks`: length of a run after its last character, None for the
    harness's default. `parameters`: all other parameters of a maker; `faults`: the MIRO's hardware may break. `engine`:
    "compiled" or "python", "" for the installed one. `maker`: "module:function", replaces the board's own maker.
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
        """JSON of one line, in ASCII: paths that are not UTF-8, which msgspec does not write, survive unchanged.

        It never contains `@@`, which afl-fuzz would replace by a file name.
        """
        return json.dumps(msgspec.to_builtins(self)).replace("@@", "@\\u0040")


def spec_of(text: str) -> TargetSpec:
    """The specification that `text` is the JSON of. Raises BadInput, which names the field."""
    try:
        return msgspec.convert(json.loads(text), TargetSpec)
    except (ValueError, msgspec.ValidationError) as error:
        remedy = f"give JSON with {', '.join(TargetSpec.__struct_fields__)}"
        raise BadInput("target", "", f"{error}", remedy) from None
