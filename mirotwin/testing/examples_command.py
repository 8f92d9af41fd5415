"""`mirotwin examples`: the files that the pages use."""

from __future__ import annotations

from pathlib import Path

import click

from miro_exact.bad_input import BadInput
from mirotwin.shell.options import Place
from mirotwin.testing.starter.examples import EXAMPLES, files
from mirotwin.testing.starter.writing import write


@click.command(short_help="Lists the examples, or writes one into a folder.")
@click.argument("name", required=False)
@click.argument("folder", type=Place(path_type=Path), default=".")
@click.option("--force", is_flag=True, help="Replace files of these names.")
def examples(name: str | None, folder: Path, force: bool) -> None:
    """Lists the examples, or writes the one called NAME into FOLDER (here, if none is named).

    The pages of the documentation use these files. One that is there already with other content is replaced only
    with --force. `firmware` writes its files into FOLDER itself. Its late.ihx is late only when the host falls silent:
    `replay` of a run of fig6 shows no difference, hil-steps/failsafe.scenario.toml does.

    A whole project, with sources, tests and CI, is begun by `mirotwin init`.
    """
    if name is None:
        width = max(map(len, EXAMPLES))
        for one, about in EXAMPLES.items():
            click.echo(f"{one:{width}}  {about}")
        click.echo("write one here: mirotwin examples NAME")
        return
    try:
        names = write(folder, files(name), "name another folder, or replace with --force", force)
    except OSError as error:
        what = error.strerror or type(error).__name__
        raise BadInput(error.filename or folder, "", what, "choose another folder") from None
    for one in names:
        click.echo(folder / one)
    if folder == Path():
        click.echo(f"files written into this folder: {len(names)}")
