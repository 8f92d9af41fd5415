"""`mirotwin fw header`: the numbers of the wire as a C header."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

from miro_protocol.c_header import render
from mirotwin.shell.command import Options, command_of
from mirotwin.shell.options import FORCE, OUT
from mirotwin.shell.outputs import check_new, whole_file


class HeaderOptions(Options, frozen=True, kw_only=True):
    COMMAND = "fw header"
    out: Annotated[Path | None, OUT.saying("Write to this file instead of stdout.", metavar="FILE")] = None
    force: Annotated[bool, FORCE] = False


@command_of(HeaderOptions)
def header(options: HeaderOptions) -> None:
    """Writes a C header for firmware: frame sizes, offsets, flags, CRC, whitening, times in machine cycles.

    It holds #define lines only. One C file of a program says #define PROTOCOL_TABLES before it includes the header;
    that file gets the tables of whitening and CRC.
    """
    out = options.out
    if out is None:
        click.echo(render(), nl=False)
        return
    check_new(out, "--out", options.force)
    with whole_file(out, "--out") as staging:
        staging.write_bytes(render().encode())
