"""`mirotwin init`: a project to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

from miro_exact.bad_input import BadInput
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.options import PATH
from mirotwin.testing.starter.project import begin


class InitOptions(Options, frozen=True, kw_only=True):
    COMMAND = "init"
    folder: Annotated[Path, Argument("FOLDER", PATH)]
    without_firmware: Annotated[
        bool,
        Option(help="No C sources: the tests run on the robot's own firmware, or on an image of yours."),
    ] = False


@command_of(InitOptions)
def init(options: InitOptions) -> None:
    """Writes a sample project into FOLDER, which is new or has no files of these names.

    It holds a working firmware in C with a Makefile, a scenario with expectations, a pytest test, and a workflow that
    runs them with `mirotwin conform` at each push. With --without-firmware the project tests a controller or
    a protocol and needs no C compiler. `make test IMAGE=mine.ihx` then tries an image of yours.
    """
    folder = options.folder
    try:
        names = begin(folder, not options.without_firmware)
    except OSError as error:
        what = error.strerror or type(error).__name__
        raise BadInput(error.filename or folder, "", what, "choose another folder") from None
    for name in names:
        if not name.startswith("firmware/"):
            click.echo(folder / name)
    if options.without_firmware:
        click.echo(f"next: cd {folder} && make test   (needs make and pytest)")
        return
    click.echo(f"{folder}/firmware: {len([name for name in names if name.startswith('firmware/')])} files")
    click.echo(f"next: cd {folder} && make test   (needs SDCC, make and pytest)")
