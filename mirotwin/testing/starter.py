"""Files for new users: `mirotwin examples` and `mirotwin init` write the documentation's files, and a project."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated

import click

from miro_exact.bad_input import BadInput, did_you_mean, shortened
from miro_robot.firmware import image_path, source_folder
from mirotwin.shell.command import Argument, Option, Options, command_of, operand, shell_line
from mirotwin.shell.options import BOARD, FORCE, PATH
from mirotwin.shell.outputs import reason_of, some, write_files
from mirotwin.testing import origin
from mirotwin.testing.vsix import packed

_IN_WHEEL = Path(__file__).parent / "examples"
_IN_TREE = Path(__file__).parents[2] / "examples"
EXAMPLES = {
    "firmware": "mine.ihx; late.ihx stops 15 ms late, race.ihx goes deaf by chance.",
    "hil-steps": "Scenario files with steps: send, wait, expect, reset.",
    "campaign": "A campaign of 240 runs: radio, latency, two controllers.",
    "two_teams": "A scenario with six robots, to look at pictures.",
    "laws": "Two laws in a distribution of their own, to install.",
    "checks": "A check in a distribution of its own, to install.",
    "fuzz-slip": "An 8051 firmware that is no robot, its wire format, its check.",
    "boards": "8051 boards, firmware, tests: cars, line follower, Modbus, RS485.",
    "foxglove": "A layout for Foxglove.",
    "vscode": "The extension for VS Code, ready to install: debugs firmware.",
}
"""Name -> description in `mirotwin examples`."""
PROJECT, BOARDS = "hil", "boards"
"""The folder that `mirotwin init` writes, and the folder of the boards for --board."""
_DEBUG_FILES = {"mine": (".map", ".cdb", ".rst"), "late": (".map", ".cdb")}
"""The two images differ in one byte, a constant, so names and lines are the same; .rst holds the bytes, too."""


def folder() -> Path:
    """The folder of the examples. Raises BadInput in an installation without them."""
    for place in (_IN_WHEEL, _IN_TREE):
        if place.is_dir():
            return place
    reason = "the examples are not part of this installation"
    raise BadInput("", "mirotwin", reason, "install mirotwin from a wheel or a checkout")


def example_files(name: str) -> Iterator[tuple[str, Path]]:
    """(name to write, file) of an example. Raises BadInput for a name that is not one."""
    if name not in EXAMPLES:
        hint = did_you_mean(name, EXAMPLES) or f"there are {', '.join(EXAMPLES)}"
        raise BadInput("", "", f"no such example {shortened(repr(name))}", hint)
    if name == "firmware":
        yield from _images()
        return
    example = folder() / name
    if example.is_dir():
        yield from ((f"{name}/{path.relative_to(example).as_posix()}", path) for path in all_files(example))
    else:
        (path,) = folder().glob(f"{name}.*")
        yield path.name, path


EXTENSION, VSIX = "vscode", "mirotwin-debug.vsix"


def contents_of(name: str) -> dict[str, bytes]:
    """Path -> content of the files of an example. Raises BadInput as `example_files` does."""
    files = {example: path.read_bytes() for example, path in example_files(name)}
    if name != EXTENSION:
        return files
    return {VSIX: packed({example.removeprefix(f"{EXTENSION}/"): data for example, data in files.items()})}


def _images() -> Iterator[tuple[str, Path]]:
    own = image_path()
    yield "mine.ihx", own
    for name in ("late.ihx", "race.ihx"):
        yield name, folder() / "firmware" / name
    for name, suffixes in _DEBUG_FILES.items():
        yield from ((f"{name}{suffix}", own.with_suffix(suffix)) for suffix in suffixes)


FIRMWARE = "firmware"
REQUIREMENTS, README = "requirements.txt", "README.md"
OF_CI = (".git", "ci.sh", "Dockerfile", REQUIREMENTS)
"""Beginnings of names of the project's files that a board's project has, too."""
OF_FIRMWARE = "tests/test_firmware.py"
"""A test that only the sample firmware passes, because it names one of its functions."""


def project_files(firmware: bool = True) -> Iterator[tuple[str, Path]]:
    """(name in the project, file) of all, in the order of names; with the C sources if `firmware`."""
    of_project, sources = folder() / PROJECT, source_folder()
    if sources is None:
        reason = "the sample project is not part of this installation"
        raise BadInput("", "mirotwin init", reason, "install mirotwin from a wheel or a checkout")
    files = [(path.relative_to(of_project).as_posix(), path) for path in all_files(of_project)]
    if firmware:
        files += [(f"{FIRMWARE}/{path.relative_to(sources).as_posix()}", path) for path in all_files(sources)]
    yield from sorted(file for file in files if firmware or file[0] != OF_FIRMWARE)


def board_files(board: str) -> Iterator[tuple[str, Path]]:
    """(name in the project, file) of a project with a board of the examples, in the order of names.

    Raises BadInput for a board that is not there.
    """
    boards, of_project = folder() / BOARDS, folder() / PROJECT
    names = sorted(path.name for path in boards.iterdir() if path.is_dir())
    if board not in names:
        hint = did_you_mean(board, names) or f"there are {', '.join(names)}"
        raise BadInput("", "--board", f"no such board {shortened(repr(board))}", hint)
    files = [(path.relative_to(boards / board).as_posix(), path) for path in all_files(boards / board)]
    of_any = [(path.relative_to(of_project).as_posix(), path) for path in all_files(of_project)]
    files += [file for file in of_any if file[0].startswith(OF_CI)]
    yield from sorted([*files, (README, boards / README)])


_LEFT_BEHIND = {"build", "runs", "__pycache__", ".pytest_cache", ".venv", "GNUmakefile"}
"""Files and folders that tools create, and a checkout's firmware make file, which writes outside of its folder."""


def all_files(folder: Path) -> Iterator[Path]:
    """Regular files, without those that tools created."""
    for path in sorted(folder.rglob("*")):
        parts = path.relative_to(folder).parts
        left_behind = any(part in _LEFT_BEHIND or part.endswith(".egg-info") for part in parts)
        if path.is_file() and not left_behind:
            yield path


def write(target: Path, files: Mapping[str, bytes], remedy: str, force: bool = False) -> None:
    """Writes files by name into `target`, which is made. All of them are written, or none.

    Raises BadInput with `remedy`, before anything is written, if a file of that name has other content: not if
    `force`, unless it is no regular file. A file with the same content stays.
    """
    if target.exists() and not target.is_dir():
        raise BadInput(target, "", "is no folder", "name one that is new or empty")
    try:
        present = [name for name, content in files.items() if _is_in_the_way(target / name, content, force)]
    except OSError as error:
        raise BadInput(error.filename or target, "", reason_of(error), "choose another folder") from None
    if present:
        raise BadInput(target, "", f"holds {some(present)} already", remedy)
    write_files(target, files, "choose another folder")


def _is_in_the_way(path: Path, content: bytes, force: bool) -> bool:
    if not path.exists() and not path.is_symlink():
        return False
    if path.is_symlink() or not path.is_file():
        return True
    return not force and path.read_bytes() != content


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
        for example, about in EXAMPLES.items():
            click.echo(f"{example:{width}}  {about}")
        click.echo("write one here: mirotwin examples NAME")
        return
    remedy = "name another folder, or replace with --force"
    files = contents_of(name)
    write(folder, files, remedy, options.force)
    for example in files:
        click.echo(folder / example)
    if folder == Path():
        click.echo(f"files written into this folder: {len(files)}")


class InitOptions(Options, frozen=True, kw_only=True):
    COMMAND = "init"
    folder: Annotated[Path, Argument("FOLDER", PATH)]
    without_firmware: Annotated[
        bool, Option(help="No C sources: the tests run on the robot's own firmware, or on an image of yours.")
    ] = False
    board: Annotated[
        str | None,
        BOARD.saying("Not the robot, but a board of the examples, such as car.", apart="without_firmware"),
    ] = None
    source: Annotated[
        str,
        Option(
            "--from",
            metavar="SOURCE",
            help="Where the project's CI gets Mirotwin: git+https://HOST/PATH@COMMIT, a wheel, a checkout; by default"
            " where the installed one came from.",
        ),
    ] = ""


@command_of(InitOptions)
def init(options: InitOptions) -> None:
    """Writes a sample project into FOLDER, which is new or has no files of these names.

    It holds a working firmware in C with a Makefile, a scenario with expectations, a pytest test, and ci.sh, which runs
    them with `mirotwin conform` in any CI; a workflow for GitHub calls it. With --without-firmware the project tests a
    controller or a protocol and needs no C compiler. `make test IMAGE=mine.ihx` then tries an image of yours.

    With --board car the project is an 8051 board of parts: board file, firmware in C and its image, scenarios, a pytest
    test.

    requirements.txt says where CI gets Mirotwin: SOURCE, else the git commit, wheel or checkout that the installed one
    came from; one in the project, or beside it, by its relative path; a release from an index by its tag. If none is
    known, it contains a line about what to write there, and CI fails with this line.
    """
    folder, remedy = options.folder, "name a folder that is new or empty"
    sources = board_files(options.board) if options.board else project_files(not options.without_firmware)
    files = {name: path.read_bytes() for name, path in sources}
    line = origin.given(options.source, folder) if options.source else origin.installed(folder)
    if line is not None:
        text = files[REQUIREMENTS].decode()
        files[REQUIREMENTS] = origin.UNKNOWN.sub(lambda _: line, text).encode("utf-8", "surrogateescape")
    write(folder, files, remedy)
    for name in files:
        if not name.startswith("firmware/"):
            click.echo(folder / name)
    click.echo(f"Mirotwin comes from: {line or f'not known; write it into {folder / REQUIREMENTS}'}")
    if line is not None and "@ file:" in line:
        click.echo(
            "That is a path of this machine. For CI on another one begin with --from git+https://HOST/PATH@COMMIT"
        )
    if line is not None and line.startswith("../"):
        click.echo(
            "CI needs it there, too, beside the project. Or begin with --from git+https://HOST/PATH@COMMIT"
        )
    enter = shell_line("cd", operand(folder))
    if options.board:
        click.echo(f"next: {enter} && pytest   (make test builds the image first: needs SDCC and make)")
        return
    if options.without_firmware:
        click.echo(f"next: {enter} && make test   (needs make and pytest)")
        return
    click.echo(f"{folder}/firmware: {len([name for name in files if name.startswith('firmware/')])} files")
    click.echo(f"next: {enter} && make test   (needs SDCC, make and pytest)")
