"""`mirotwin fw header`: the numbers of the wire as a C header."""

from __future__ import annotations

from pathlib import Path

import click

from miro_protocol.c_header import render
from mirotwin.shell.options import Place
from mirotwin.shell.outputs import check_new, whole_file


@click.command(short_help="Writes protocol.h: the numbers of the wire for C.")
@click.option(
    "-o",
    "--out",
    type=Place(path_type=Path),
    metavar="FILE",
    help="Write to this file instead of stdout.",
)
@click.option("--force", is_flag=True, help="Replace the file at --out.")
def header(out: Path | None, force: bool) -> None:
    """Writes a C header for firmware: frame sizes, offsets, flags, CRC, whitening, times in machine cycles.

    It holds #define lines only. One C file of a program says #define PROTOCOL_TABLES before it includes the header;
    that file gets the tables of whitening and CRC.
    """
    if out is None:
        click.echo(render(), nl=False)
        return
    check_new(out, "--out", force)
    with whole_file(out, "--out") as staging:
        staging.write_bytes(render().encode())
