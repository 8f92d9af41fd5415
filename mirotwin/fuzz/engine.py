"""Who makes up inputs: AFL++ where it is installed, else Hypothesis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import msgspec

from mirotwin.fuzz.files import CampaignFolder
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import Target

_TOKENS, _TOKEN = 32, 64
"""How many inputs are words of a foreign format, and how much of them."""


class EngineProgress(msgspec.Struct, frozen=True):
    """A campaign so far: `executions` since it began first, the rate of all its jobs together.

    `edges`: of the job that has most, None as long as it has said nothing. `frames` and `characters`: what the machines
    were fed. `stability_percent`: of the job with the least. `run_time_s` of wall time.
    """

    executions: int = 0
    executions_per_s: float = 0.0
    edges: int | None = None
    crashes: int = 0
    corpus_count: int = 0
    stability_percent: float | None = None
    run_time_s: float = 0.0
    frames: int = 0
    characters: int = 0


class Engine(Protocol):
    """One campaign of an engine. Paths are files that hold an input each."""

    def start(self) -> None: ...
    def stop(self) -> None: ...
    def progress(self) -> EngineProgress: ...
    def new_crashes(self) -> list[Path]:
        """Inputs that failed, since the last call."""
        ...

    def new_queue(self) -> list[Path]:
        """Inputs that found something new, since the last call."""
        ...


class NoEngine:
    """Where there is no input to begin with: it makes up none."""

    def start(self) -> None:
        """Nothing."""

    def stop(self) -> None:
        """Nothing."""

    def progress(self) -> EngineProgress:
        return EngineProgress()

    def new_crashes(self) -> list[Path]:
        return []

    def new_queue(self) -> list[Path]:
        return []


def engine_for(
    spec: TargetSpec,
    inputs: Sequence[bytes],
    folder: CampaignFolder,
    target: Target,
    jobs: int,
    seed: int | None,
) -> tuple[Engine, list[str]]:
    """AFL++, or Hypothesis, with what a user should hear about it. Raises BadInput for what cannot be."""
    from mirotwin.fuzz.afl.inputs import message_tokens, wire_tokens, write_dictionary, write_seeds
    from mirotwin.fuzz.afl.run import AflRun
    from mirotwin.fuzz.afl.settings import missing

    seeds, dictionary = folder.folder("seeds"), folder.path / "dictionary"
    write_seeds(seeds, {f"seed-{number:04d}": data for number, data in enumerate(inputs)})
    if spec.board == "bare":
        tokens = {f"seed {number}": data[:_TOKEN] for number, data in enumerate(inputs[:_TOKENS]) if data}
    else:
        tokens = wire_tokens(spec.robots) if spec.input == "bytes" else message_tokens(spec.robots)
    write_dictionary(dictionary, tokens)
    place = (seeds, folder.folder("engine"), dictionary, jobs, seed)
    lacking = missing()
    if lacking is None:
        afl = AflRun([spec.text()], *place, watch=target)
        return afl, afl.notes()
    from mirotwin.fuzz.hypothesis_engine import HypothesisRun

    note = f"{lacking}; until then Hypothesis makes up the inputs, which is slower and not guided by edges"
    return HypothesisRun([spec.text()], *place), [note]
