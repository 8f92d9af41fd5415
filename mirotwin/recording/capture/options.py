"""Options of all commands that read captures."""

from __future__ import annotations

from typing import Annotated

import click

from miro_protocol.transmission import DOWN, UP
from mirotwin.recording.capture.forms import FORMS
from mirotwin.shell.command import Option, Options
from mirotwin.shell.options import BAUD

DIRECTIONS = {"down": DOWN, "up": UP}


class CaptureOptions(Options, frozen=True, kw_only=True):
    """Options for reading a capture, for properties that the file does not contain."""

    HEADING = "A capture"
    from_form: Annotated[
        str | None,
        Option(
            type=click.Choice([*FORMS]),
            metavar="FORM",
            help="Its form. Default: recognised by its beginning.",
        ),
    ] = None
    direction: Annotated[
        str | None,
        Option(
            type=click.Choice([*DIRECTIONS]),
            help="Where it does not say who sent: down to the robots (default, unless it decodes as telemetry), or up.",
        ),
    ] = None
    baud: Annotated[
        int | None,
        BAUD.saying("Bit rate of the sender. Default: fitted, else the line's 9600."),
    ] = None
    wires: Annotated[
        tuple[str, ...],
        Option(
            "--wire", metavar="NAME", help="Only this channel of an analyser. Default: all with characters."
        ),
    ] = ()
    assume_contiguous: Annotated[
        bool,
        Option(help="Without times: all characters follow each other without a pause, from tick 0 on."),
    ] = False


AS_IT_SAYS = CaptureOptions()
