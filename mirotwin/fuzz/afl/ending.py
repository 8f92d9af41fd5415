"""Why afl-fuzz has ended: its own line, and what to do."""

from __future__ import annotations

import re
from pathlib import Path

from miro_exact.bad_input import BadInput

_COLOUR = re.compile(r"\x1b(\[[0-9;?]*[a-zA-Z]|[()].)")
_ABORT = re.compile(r"\[-\]\s+(?:PROGRAM ABORT|SYSTEM ERROR) : (.*)")
_REASON = re.compile(r"OS message : (.*)")

REMEDIES = (
    (
        "valid input seed that does not crash",
        "each seed fails by itself: these are crashes; give one that does not",
    ),
    ("No usable test cases", "give a folder with at least one file that is not empty"),
    ("no test cases", "give a folder with at least one file that is not empty"),
    ("core_pattern", "run `echo core | sudo tee /proc/sys/kernel/core_pattern`"),
    ("CPU scaling", "set AFL_SKIP_CPUFREQ=1"),
    ("free CPU cores", "give fewer --jobs, or end other programs that are bound to cores"),
    ("' is in use", "another campaign runs in this folder: end it, or choose another one"),
    ("shmget", "segments of killed programs may fill the limit: see `ipcs -m`, remove them with `ipcrm`"),
    ("initializing fork server", "the target took too long to start: give fewer --jobs"),
    ("cleanup failed", "something in it is not afl-fuzz's: choose another folder"),
    ("Unable to create", "choose a folder that can be written to"),
    ("Unable to open", "choose a folder that can be read"),
)
"""A part of afl-fuzz's line -> what to do about it. The first that fits counts."""

_ELSE = "its whole output is in the file named first"


def why_ended(log: Path, target: Path) -> BadInput:
    """What is to be told of an afl-fuzz that ended by itself with an error.

    `log` is its output. `target` is what the target process complained of, if it did: that is the cause then.
    """
    own = _read(target).strip().splitlines()
    if own:
        return BadInput(target, len(own), own[-1], "" if len(own) == 1 else f"whole text: {target}")
    text = _COLOUR.sub("", _read(log))
    found = list(_ABORT.finditer(text))
    if not found:
        last = next((line for line in reversed(text.splitlines()) if line.strip()), "it said nothing")
        return BadInput(log, "", f"afl-fuzz ended: {last.strip()}", _ELSE)
    line = found[-1][1].strip()
    reason = _REASON.search(text, found[-1].end())
    said = f"{line} ({reason[1].strip()})" if reason else line
    remedy = next((what for part, what in REMEDIES if part in said), _ELSE)
    return BadInput(log, "", f"afl-fuzz ended: {said}", remedy)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return ""
