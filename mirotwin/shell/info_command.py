"""`mirotwin info`: installed versions, the engine, and the firmware."""

import importlib
import platform
from importlib import metadata
from typing import Annotated

from miro_exact import engine as engines
from miro_exact import hot_modules
from mirotwin.shell.command import Options, command_of
from mirotwin.shell.console import facts_table, show
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import FIRMWARE, Engine
from mirotwin.shell.program import complain
from mirotwin.shell.verdicts import BAD_INPUT, DONE

PACKAGES = (
    "numpy", "msgspec", "click", "rich", "mcap", "pillow", "pyserial", "crcmod-plus", "pyvcd",
    "tomli-w", "hypothesis", "pyarrow", "bokeh", "jinja2", "markupsafe",
)  # fmt: skip

PLAIN_REMEDY = "rebuild with GCC or Clang, and with the Cython of .ci/constraints.txt"


def version_of(package: str) -> str:
    """The installed version of a distribution, or a word for a missing one."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


class InfoOptions(Options, frozen=True, kw_only=True):
    COMMAND = "info"
    firmware: Annotated[
        str | None, FIRMWARE.saying("Image to describe instead of the robot's own.", heading="")
    ] = None
    engine: Engine = None


@command_of(InfoOptions)
def info(options: InfoOptions) -> int:
    """Shows versions, the engine, and the firmware image with its hash."""
    active = engines.active()
    broken = _broken_modules(active)
    image = load_firmware(options.firmware, named=False)
    table = facts_table()
    table.add_row("mirotwin", version_of("mirotwin"))
    table.add_row("Python", f"{platform.python_version()} ({platform.python_implementation()})")
    table.add_row("platform", platform.platform())
    for package in PACKAGES:
        table.add_row(package, version_of(package))
    table.add_row("engine", _engine_line(active))
    table.add_row("firmware", str(image.path))
    table.add_row("", f"sha256 {image.sha256}")
    table.add_row("", f"{image.size} bytes of 8192")
    show(table)
    for message in broken:
        complain(f"error: {message}")
    return BAD_INPUT if broken else DONE


def _engine_line(active: str) -> str:
    """With whether the build gave the CPU's loop the shape that processors predict well."""
    finder = engines.install()
    compiled = finder.compiled()
    if active != "compiled":
        return f"python ({len(compiled)} of {len(finder.sources)} modules have a compiled twin)"
    replicated = hot_modules.dispatch_replicated(compiled)
    dispatch = "replicated" if replicated else f"plain: slower, the same bits; {PLAIN_REMEDY}"
    return f"compiled ({len(compiled)} modules), dispatch {dispatch}"


def _broken_modules(active: str) -> list[str]:
    """Imports every hot module, so that one that cannot be loaded (a stale one, for example) is reported here and not
    in a run. In Python mode, modules without a `.py` file are skipped: they are unused and cannot be imported.
    """
    problems = []
    for name, source in engines.install().sources.items():
        if active == "python" and source.suffix != ".py":
            continue
        try:
            importlib.import_module(name)
        except ImportError as error:
            problems.append(str(error))
    return problems
