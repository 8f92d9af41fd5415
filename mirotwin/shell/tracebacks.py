"""The traceback behind an error that is told in one line, for who wants it: MIROTWIN_TRACEBACK=1 in the environment."""

from __future__ import annotations

import os
import sys
import traceback


def show_traceback(error: BaseException) -> None:
    """Writes it to stderr, if it is wanted. For plug-ins: an error that nothing caused has no more to say."""
    if error.__cause__ is not None and os.environ.get("MIROTWIN_TRACEBACK"):
        sys.stderr.write("".join(traceback.format_exception(error)))
