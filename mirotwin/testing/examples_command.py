"""`mirotwin examples`: the files that the pages use."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

from miro_exact.bad_input import BadInput
from mirotwin.shell.command import Argument, Options, command_of
from mirotwin.shell.options import FORCE, PATH
from mirotwin.testing.starter.examples import EXAMPLES, files
from mirotwin.testing.starter.writing import write


class ExamplesOptions(Options, frozen=True, kw_only=True):
    COMMAND = "examples"
    name: Annotated[str | None, Argument("[NAME]")] = None
    folder: Annotated[Path, Argument("[FOLDER]", PATH)] = Path()
    force: Annotated[bool, FORCE.saying("Replace files of these names.")] = False


@command_of(ExamplesOptions)
def examples(options: ExamplesOptions) -> None:
    """Lists the examples, or writes the one called NAME into FOLDER (here, if none is named).

    The pages of the documentation use these files. One that is there already with other content is replaced only
    with --force. `firmware` writes its files into FOLDER itself. Its late.ihx is late only when the host falls silent:
    `replay` of a run of fig6 shows no difference, hil-steps/failsafe.scenario.toml does.

    A whole project, with sources, tests and CI, is begun by `mirotwin init`.
    """
    name, folder = options.name, options.folder
    if name is None:
        width = max(map(len, EXAMPLES))
        for one, about in EXAMPLES.items():
            click.echo(f"{one:{width}}  {about}")
        click.echo("write one here: mirotwin examples NAME")
        return
    try:
        names = write(folder, files(name), "name another folder, or replace with --force", options.force)
    except OSError as error:
        what = error.strerror or type(error).__name__
        raise BadInput(error.filename or folder, "", what, "choose another folder") from None
    for one in names:
        click.echo(folder / one)
    if folder == Path():
        click.echo(f"files written into this folder: {len(names)}")
