"""The command line and environment of afl-fuzz, with the reason for each variable."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Mapping

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.engine import EngineInput
from mirotwin.fuzz.spec import MAP_SIZE
from mirotwin.shell.processes import python_module

PROGRAM = "afl-fuzz"
ANSWER_MS = 10_000
"""Time limit of one execution. The server answers after the run, all at once (`serve`): AFL++ never sees it expire."""

START_MS = 120_000
"""Time for a target to start: Python, the modules and the boot of the firmware, on a machine that does other things."""

REASONS = {
    "AFL_I_DONT_CARE_ABOUT_MISSING_CRASHES": "a crash is a status: a core_pattern that starts a program is harmless",
    "AFL_SKIP_CPUFREQ": "CPU scaling costs some speed and does no harm; changing it takes root",
    "AFL_SKIP_BIN_CHECK": "the target is a Python program, which no compiler has instrumented",
    "AFL_MAP_SIZE": "bytes of the edge map; the default is eight times as large and slower",
    "AFL_NO_UI": "the output goes to a file",
    "AFL_NO_AFFINITY": "the command binds each job to a core itself: see `run.cores_for`",
    "AFL_NO_CRASH_README": "folders hold inputs only",
    "AFL_FORKSRV_INIT_TMOUT": "milliseconds in which the target has to be ready",
}
"""Variable -> reason. Variables that only switch something on are 1.

All are known to afl-fuzz 4.04c, which for an unknown one would warn and sleep 2 s.
"""


def environment(inherited: Mapping[str, str]) -> dict[str, str]:
    """The environment of afl-fuzz: the inherited one with the variables of `REASONS`, which take precedence."""
    ours = dict.fromkeys(REASONS, "1")
    ours |= {"AFL_MAP_SIZE": str(MAP_SIZE), "AFL_FORKSRV_INIT_TMOUT": str(START_MS)}
    return {**inherited, **ours}


def line(given: EngineInput, job: int) -> list[str]:
    """The command of job number `job`: the first is the main one, the others import its crashes. With a seed, afl-fuzz
    treats all inputs as equally fast, so that its choices do not depend on time. Raises BadInput for a folder name with
    a special meaning for afl-fuzz.
    """
    name, (shortest, longest) = job_name(job, given.jobs), given.lengths
    options = ["-i", str(given.seeds), "-o", str(given.out), "-t", str(ANSWER_MS)]
    options += ["-g", str(shortest), "-G", str(longest)]
    if given.jobs > 1:
        options += ["-M" if job == 0 else "-S", name]
    if given.dictionary is not None:
        options += ["-x", str(given.dictionary)]
    if given.seed is not None:
        options += ["-s", str(given.seed + job)]
    beside = str(given.out / name)
    if "@@" in beside:
        raise BadInput(given.out, "", "afl-fuzz puts the name of a file for @@", "choose another folder")
    server = python_module("mirotwin.fuzz.afl.serve", given.target, beside)
    return [PROGRAM, *options, "--", *server]


def job_name(job: int, jobs: int) -> str:
    """The name of a job, which is that of its folder. One alone has the name that afl-fuzz gives it."""
    if jobs == 1:
        return "default"
    return "main" if job == 0 else f"job{job}"


def missing() -> str | None:
    """The part of AFL++ that is missing and how to get it; None where all is there."""
    if sys.platform != "linux":
        return f"AFL++ is spoken to by System V shared memory as Linux has it; this is {sys.platform}"
    if shutil.which(PROGRAM) is None:
        return f"{PROGRAM} is not on the PATH; install AFL++ (Debian, Ubuntu: `apt install afl++`)"
    return None
