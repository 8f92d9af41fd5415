"""The targets of fuzzing under Hypothesis: the engine where AFL++ is missing.

HypothesisRun ── starts ──► python -m mirotwin.fuzz.hypothesis_process SPECIFICATION SEEDS JOB SEED
                               │ JOB/queue/id:..     inputs that executed something new
                               │ JOB/crashes/id:..   inputs with a failure
     reads ◄───────────────────┘ JOB/progress        counters
"""

from __future__ import annotations

import os
import subprocess
import time
from importlib.util import find_spec
from pathlib import Path

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.engine import Engine, EngineInput, EngineProgress
from mirotwin.fuzz.hypothesis_process import KINDS, told
from mirotwin.shell.program import python_module

_PROCESS = "mirotwin.fuzz.hypothesis_process"
_LOG = "log"


def missing() -> str | None:
    """What of Hypothesis is missing and how to get it; None where it is there."""
    if find_spec("hypothesis") is not None:
        return None
    return "Hypothesis is not installed; install it with `pip install 'mirotwin[hypothesis]'`"


class HypothesisRun(Engine):
    """A campaign: each of the jobs is a process with a seed of its own. A dictionary is not used.

    Inputs are made of whole operations. Raises BadInput for Hypothesis that is missing.
    """

    def __init__(self, given: EngineInput) -> None:
        given.check("Hypothesis", missing())
        super().__init__()
        self._given = given
        self._folders = [given.out / f"job{job}" for job in range(given.jobs)]
        self._seed = int.from_bytes(os.urandom(4), "little") if given.seed is None else given.seed
        self._stopped = False
        self._processes: list[subprocess.Popen[bytes]] = []
        self._began_s = 0.0

    def start(self) -> None:
        self._began_s = time.monotonic()
        for number, folder in enumerate(self._folders):
            for kind in KINDS:
                (folder / kind).mkdir(parents=True, exist_ok=True)
            what = [self._given.target, str(self._given.seeds), str(folder), str(self._seed + number)]
            with (folder / _LOG).open("wb") as log:
                self._processes.append(
                    subprocess.Popen(
                        python_module(_PROCESS, *what),
                        stdin=subprocess.DEVNULL,
                        stdout=log,
                        stderr=log,
                        start_new_session=True,  # Ctrl-C is the command's, which stops its processes
                    )
                )

    def stop(self) -> None:
        self._stopped = True
        for process in self._processes:
            process.kill()
        for process in self._processes:
            process.wait()

    def progress(self) -> EngineProgress:
        self._require_health()
        said = [one for one in (told(folder) for folder in self._folders) if one]
        run_time_s = time.monotonic() - self._began_s
        executions = sum(one.executions for one in said)
        per_s = executions / run_time_s if run_time_s > 0 else 0.0
        return EngineProgress(executions, per_s, max((one.edges for one in said), default=None))

    def _require_health(self) -> None:
        for process, folder in zip(self._processes, self._folders, strict=False):
            if process.poll() is not None and not self._stopped:
                lines = (folder / _LOG).read_text("utf-8", "replace").strip().splitlines()
                what = lines[-1] if lines else f"ended with exit code {process.returncode}"
                raise BadInput("Hypothesis", "", what, f"see {folder / _LOG}")

    def _inputs(self, kind: str) -> list[Path]:
        return [path for folder in self._folders for path in sorted((folder / kind).glob("id:*"))]
