"""A worker's job and its outcome. Workers run in this process, in another one, or on another machine.

Nothing here imports a hot module: a new process reads this file before its engine is chosen.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from functools import cache, lru_cache

import msgspec

from miro_exact.bad_input import BadInput
from mirotwin.campaign.versions import Versions, versions_here

Figure = float | int | bool | str | None


class ImageCopy(msgspec.Struct, frozen=True):
    """An image without its file: the content, and the addresses of its names as JSON. `path` is for messages."""

    path: str
    sha256: str
    content: bytes
    names: bytes


class Work(msgspec.Struct, frozen=True):
    """One run: a whole scenario as text, `settings` to make in it, and a seed. `run`: its number in the plan. `values`:
    the values of parts in its row, and their types. `recording`: path of the recording, if there is one. `brought`:
    plug-in files, by the fields of `mirotwin.shell.plugin_files.PluginFiles`.
    """

    run: int
    origin: str
    text: str
    settings: tuple[str, ...]
    seed: int
    firmware: ImageCopy
    engine: str
    versions: Versions
    values: Mapping[str, type] = {}
    recording: str = ""
    brought: Mapping[str, tuple[str, ...]] = {}


class RunOutcome(msgspec.Struct, frozen=True, omit_defaults=True):
    """The result of a run. `verdict`: passed, failed (a check or a step), not judged (a named check never applied),
    fault (of the firmware) or error (no run).

    `error`: why there are no figures; `traceback`: of a plug-in's error, if requested. `failure`: the first failed
    check or step, or the check that was not judged. `checks`: name -> verdict. `wall_s`: the simulation loop.
    """

    run: int
    verdict: str = "error"
    error: str = ""
    traceback: str = ""
    failure: str = ""
    digest: str = ""
    figures: dict[str, Figure] = {}
    checks: dict[str, str] = {}
    wall_s: float = 0.0


def work(job: Work) -> RunOutcome:
    """Runs a job to its end and catches its errors.

    Raises BadInput if this process has other versions than the job requires.
    """
    difference = _engine(job.engine)
    if not difference:
        _bring(tuple(job.brought.items()))
        difference = job.versions.difference(versions_here(job.versions))
    if difference:
        worker = f"worker {socket.gethostname()} process {os.getpid()}"
        raise BadInput("", worker, f"has {difference}", "install there what runs here")
    from mirotwin.campaign.single import run_single  # loads hot modules

    return run_single(job)


@lru_cache(maxsize=1)  # the last ones are there; others take their place
def _bring(files: tuple[tuple[str, tuple[str, ...]], ...]) -> None:
    if any(given for _, given in files):
        from mirotwin.shell.plugin_files import PluginFiles  # loads hot modules

        PluginFiles(**dict(files)).bring()


@cache
def _engine(name: str) -> str:
    from miro_exact import engine

    try:
        engine.select(name)
    except BadInput as error:
        return f"{error}"
    return ""
