"""`mirotwin fw sanitize`: what firmware does without noticing, such as variables that an interrupt may tear."""

from __future__ import annotations

from typing import Annotated

import click
import msgspec

from miro_robot.inspect.findings import Reader
from miro_robot.inspect.sanitizer import Sanitizer
from miro_robot.inspect.sanitizer_layout import layout_of
from mirotwin.firmware.subject import SubjectOptions, WindowOptions, look, open_window
from mirotwin.runs.sanitized import ALLOW, KIND, judged, line_of, ram_of, read_allowed, stale_line
from mirotwin.shell.command import command_of
from mirotwin.shell.debug_files import with_debug_files
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.options import AT, JSON
from mirotwin.shell.program import complain, show_line
from mirotwin.shell.verdicts import VERDICTS, exit_code


class SanitizeOptions(WindowOptions, frozen=True, kw_only=True):
    COMMAND = "fw sanitize"
    kinds: Annotated[tuple[str, ...], KIND] = ()
    allow: Annotated[str | None, ALLOW] = None
    as_json: Annotated[bool, JSON] = False


class _DebugLine(SubjectOptions, frozen=True, kw_only=True):
    """The subject as `mirotwin debug` takes it."""

    COMMAND = "debug"
    at: Annotated[str, AT] = ""


@command_of(SanitizeOptions)
def sanitize(options: SanitizeOptions) -> int:
    """Runs SUBJECT and reports what its firmware does without noticing: variables torn by interrupts, and such.

    A finding is a line of C, the variable, and the line that comes between; "did" happened in this run, "may" needs
    another moment of an interrupt. The command below it stands there.

    Exit codes: 3 something happened, 1 something may, else that of the run.
    """
    allowed = read_allowed(options.allow)
    run = open_window(options)
    image = with_debug_files(run.image)
    layout = layout_of(image)
    if layout.unseen:
        complain(f"{image.path.name}: {layout.unseen}")
    sanitizer = Sanitizer(layout, ram_of(run.device))
    code = look(run, options, sanitizer)
    findings, stale = judged(Reader(image, layout).findings(sanitizer), allowed, options.kinds)
    slot = -1 if options.slot is None else options.slot
    findings = [
        msgspec.structs.replace(finding, network=options.network or 0, slot=slot) for finding in findings
    ]
    subject = {name: getattr(options, name) for name in SubjectOptions.__struct_fields__ if name != "engine"}
    lines = [_DebugLine(**subject, at=f"{finding.tick}t").command_line() for finding in findings]
    complain(*(stale_line(options.allow, entry) for entry in stale))
    if options.as_json:
        shown = [
            {**msgspec.structs.asdict(finding), "debug": line}
            for finding, line in zip(findings, lines, strict=True)
        ]
        click.echo(json_bytes({"findings": shown, "not_found": [finding.key for finding in stale]}, indent=2))
    else:
        for finding, line in zip(findings, lines, strict=True):
            show_line(f"{finding}")
            show_line(f"    {line}")
        if not findings:
            show_line("nothing found")
    worst = exit_code(*(line_of(finding)[0] for finding in findings))
    return code if code == VERDICTS["fault"].code or not findings else worst
