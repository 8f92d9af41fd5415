"""`mirotwin export run.mcap --as foxglove`: a recording with the topics that Foxglove draws."""

from __future__ import annotations

import sys
from io import BytesIO
from pathlib import Path

from miro_exact.bad_input import BadInput
from mirotwin.recording.capture.detect import NAMES
from mirotwin.recording.capture.input import STDIN, Input
from mirotwin.shell.console import show
from mirotwin.shell.outputs import whole_file
from mirotwin.shell.program import DONE, complain


def export_foxglove(given: Input, format: str, out: str, quiet: bool) -> int:
    """Writes what `given` holds with Foxglove's topics to `out`; returns the exit code. Raises BadInput."""
    if format != "recording":
        what = f"{NAMES[format]}, which holds no postures"
        raise BadInput(given.label, "", what, "give a run.mcap that `mirotwin run` wrote")
    from mirotwin.report.foxglove.convert import convert  # loads most of the package

    pieces = []
    while piece := given.read_some():
        pieces.append(piece)
    made = BytesIO()
    result = convert(b"".join(pieces), given.label, made)
    if out == STDIN:
        sys.stdout.buffer.write(made.getbuffer())
    else:
        with whole_file(Path(out), "--out") as staging:
            staging.write_bytes(made.getbuffer())
    for note in result.notes:
        complain(note)
    if not quiet and out != STDIN:
        frames = f" and {result.images} camera frames" if result.images else ""
        show(f"{out}: {result.periods} control periods{frames} for Foxglove")
    return DONE
