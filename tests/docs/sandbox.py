"""The folder that a document's blocks run in: what a reader has who comes to that page."""

import os
import shutil
import stat
import sys
from pathlib import Path

from miro_robot.firmware import image_path, source_folder
from mirotwin.testing import starter
from tests import children
from tests.exact.distribution import install
from tests.mutants import build
from tests.mutants.planted import PLANTED

ROOT = Path(__file__).parents[2]
PACKAGES = ("exact", "protocol", "robot_fw", "host", "sim")
DEBUG_FILES = (".ihx", ".map", ".cdb", ".rst")
LATE = "stops 15 ms late"


FIRST_USE = (
    "README.md",
    "docs/start.md",
    *(f"docs/howto/{path.name}" for path in sorted((ROOT / "docs/howto").glob("*.md"))),
)
"""What a newcomer follows from the first line, in an empty folder; in this order, in one folder, too."""


def documents():
    """Every document of the tree, by its path."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "*.md"]
    done = children.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return sorted(name for name in done.stdout.split("\0") if name and (ROOT / name).is_file())


def prepare(folder, document):
    """Fills `folder` for a document, unless it is one for newcomers; returns the folders of programs and of what is
    installed.
    """
    if document not in FIRST_USE:
        for name in ("build/mine.ihx", "build/miro.ihx", "fixed.ihx"):
            copy_image(image_path(), folder / name)
        copy_examples(folder)
        (folder / "protocol").symlink_to(ROOT / "protocol")
        (folder / "robot_fw").symlink_to(ROOT / "robot_fw")
    hidden = folder.parent / "installed"
    put_parts(hidden)
    FUNCTIONS.get(document, lambda folder: None)(folder)
    return programs(folder.parent / "programs", hidden), hidden


def copy_image(image, target):
    target.parent.mkdir(parents=True, exist_ok=True)
    for suffix in DEBUG_FILES:
        if image.with_suffix(suffix).exists():
            shutil.copy(image.with_suffix(suffix), target.with_suffix(suffix))


def copy_examples(folder):
    for name in starter.EXAMPLES:
        starter.write(folder, starter.contents_of(name), "", force=True)


def put_parts(hidden):
    """The distributions of `examples/`, as pip leaves them, and the law that host/README.md writes."""

    def text(path):
        return (ROOT / "examples" / path).read_text("utf-8")

    laws = {"samson": "samson_law:Parameters", "pursuit": "pursuit_law:Parameters"}
    sources = {name: text(f"laws/{name}.py") for name in ("samson_law", "pursuit_law")}
    install(hidden, "example-laws", "1.0", laws, **sources)
    check = {"turns_at_most_rad_s": "turning_check:TurnsAtMost"}
    install(hidden, "example-checks", "1.0", check, "checks", turning_check=text("checks/turning_check.py"))
    slip = text("fuzz-slip/slip_protocol.py")
    install(hidden, "example-slip", "1.0", {"slip": "slip_protocol:Slip"}, "protocols", slip_protocol=slip)
    lamps = {"lamps_as_told": "dimmer_check:LampsAsTold"}
    install(hidden, "example-dimmer", "1.0", lamps, "checks", dimmer_check=text("fuzz-slip/dimmer_check.py"))
    law = (ROOT / "host/README.md").read_text("utf-8").split("```python\n")[2].partition("\n\npilot = ")[0]
    install(hidden, "mine", "1.0", {"smooth": "my_module:Parameters"}, my_module=law)


def programs(folder, hidden):
    """`mirotwin`, `python` and `pytest` for commands that bash runs, with the packages of this tree; `pip` installs
    nothing, but wants the folder that it is told.
    """
    folder.mkdir()
    path = os.pathsep.join([*(str(ROOT / name) for name in PACKAGES), str(ROOT), str(hidden)])
    run = "-c 'from mirotwin.entry import main; main()'"
    for name, what in (("mirotwin", run), ("python", ""), ("pytest", "-m pytest")):
        script = f'#!/bin/sh\nPYTHONPATH="{path}" exec "{sys.executable}" {what} "$@"\n'
        (folder / name).write_text(script)
        (folder / name).chmod(stat.S_IRWXU)
    (folder / "pip").write_text('#!/bin/sh\ncase "$2" in ./*) test -f "$2/pyproject.toml";; esac\n')
    (folder / "pip").chmod(stat.S_IRWXU)
    return folder


# What single pages need


def late(folder):
    """A firmware whose failsafe comes after 125 ms, with its sources."""
    planted = PLANTED[LATE]
    sources = source_folder()
    assert sources is not None
    shutil.copytree(sources, folder / "late")
    changed = planted.applied((sources / planted.file).read_text("utf-8"))
    (folder / "late" / planted.file).write_text(changed, "utf-8")
    built = build.build({planted.file: changed})
    assert not built.error, built.error
    copy_image(built.image, folder / "late" / "miro.ihx")
    copy_image(built.image, folder / "late.ihx")


def late_case(folder):
    """The case that the page's own block in Python writes, of that firmware."""
    late(folder)
    copy_image(folder / "late.ihx", folder / "build" / "miro.ihx")
    page = (ROOT / "mirotwin/verify/cases/README.md").read_text("utf-8")
    exec(page.split("```python\n")[1].partition("```")[0], {})


def dimmer(folder):
    """The firmware of examples/fuzz-slip, with its cases beside it; `mine.ihx` is the one that is right."""
    example = folder / "fuzz-slip"
    children.run(["make", "-s"], cwd=example, check=True, capture_output=True)
    shutil.rmtree(folder / "build")
    shutil.copytree(example / "build", folder / "build")
    shutil.copytree(example / "cases", folder / "cases")
    copy_image(folder / "build" / "mended.ihx", folder / "mine.ihx")


def regression(target):
    """A folder with a case that the shipped firmware passes."""

    def put(folder):
        late_case(folder)
        copy_image(image_path(), folder / "build" / "miro.ihx")
        (folder / target).mkdir(parents=True)
        shutil.move(folder / "late.stream", folder / target)

    return put


def question(folder):
    """An input for the fuzzer, and bytes of a network of three."""
    for name in ("INPUT", "bytes.bin"):
        (folder / name).write_bytes(bytes.fromhex("5555555555ff2dd4"))


FUNCTIONS = {
    "docs/conformance.md": late,
    "mirotwin/replay/README.md": late,
    "mirotwin/verify/steps/README.md": late,
    "mirotwin/verify/cases/README.md": late_case,
    "examples/fuzz-slip/README.md": dimmer,
    "mirotwin/fuzz/README.md": regression("tests/cases"),
    "mirotwin/fuzz/afl/README.md": question,
    "protocol/README.md": question,
}

COMPILED = {
    *(name for name, put in FUNCTIONS.items() if put is not question),
    "docs/howto/own-firmware.md",
    "docs/howto/sanitize.md",
}
"""Pages that need a compiler for the 8051."""

_SHORT = "mirotwin run fig6 --set duration_s=0.2 --no-figure -q --out"
_CAMPAIGN = "mirotwin campaign run campaign.toml --seeds 0-19 --set duration_s=0.1 -q --out"

COMMANDS = {
    "docs/formats/parquet.md": (f"{_CAMPAIGN} runs/short.parquet || true",),
    "docs/formats/stream.md": (f"{_SHORT} runs/fig6-0",),
    "docs/reference/fixtures.md": ("mirotwin init mine",),
    "protocol/README.md": (f"{_SHORT} first", "mv first/run.mcap ."),
    "mirotwin/campaign/README.md": (
        f"{_CAMPAIGN} runs/campaign.parquet || true",
        "cp runs/campaign.parquet baseline.parquet",
    ),
}
"""Run before anything else, by document."""
