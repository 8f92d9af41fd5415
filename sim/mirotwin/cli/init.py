"""`mirotwin init`: a project to begin with."""

from __future__ import annotations

from pathlib import Path

import click

from miro_exact.bad_input import BadInput
from mirotwin.cli.options import Place
from mirotwin.starter.project import begin


@click.command(short_help="Begins a project: firmware, tests, scenarios, a workflow for CI.")
@click.argument("folder", type=Place(path_type=Path))
def init(folder: Path) -> None:
    """Writes a sample project into FOLDER, which is new or has no files of these names.

    It holds a working firmware in C with a Makefile, a scenario with expectations, a pytest test, and a workflow that
    runs them with `mirotwin conform` at each push.
    """
    try:
        names = begin(folder)
    except OSError as error:
        what = error.strerror or type(error).__name__
        raise BadInput(error.filename or folder, "", what, "choose another folder") from None
    for name in names:
        if not name.startswith("firmware/"):
            click.echo(folder / name)
    click.echo(f"{folder}/firmware: {len([name for name in names if name.startswith('firmware/')])} files")
    click.echo(f"next: cd {folder} && make test   (needs SDCC, make and pytest)")
