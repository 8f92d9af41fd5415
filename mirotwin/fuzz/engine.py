"""Who makes up inputs: AFL++ where it is installed, else Hypothesis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Self

import msgspec

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.files import CampaignFolder
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import Target

_TOKENS, _TOKEN = 32, 64
"""How many inputs are words of a foreign format, and how much of them."""


class EngineInput(msgspec.Struct, frozen=True):
    """What an engine begins with. `target`: the JSON of a `TargetSpec`. `seeds`: a folder of inputs.

    `out`: the folder of the campaign, made if it is not there. `dictionary`: a file of words for AFL++. `jobs`: so many
    processes, each with a target of its own. `seed`: of the random numbers; the system's where none is given.
    """

    target: str
    seeds: Path
    out: Path
    dictionary: Path | None = None
    jobs: int = 1
    seed: int | None = None

    def check(self, program: str, absent: str | None) -> None:
        """Raises BadInput for no job, and for a program of which `absent` says what is missing and how to get it."""
        if self.jobs < 1:
            raise BadInput("--jobs", "", f"{self.jobs}: there is nothing to do", "give 1 or more")
        if absent:
            raise BadInput(program, "", *absent.split("; ", 1))


class EngineProgress(msgspec.Struct, frozen=True):
    """A campaign so far: the rate is that of all its jobs together; `edges` is None as long as nothing is known."""

    executions: int = 0
    executions_per_s: float = 0.0
    edges: int | None = None


class Engine:
    """One campaign of an engine, which gives paths of files that hold an input each.

    This one makes up no inputs: there is none to begin with. The others derive from it.
    """

    def __init__(self) -> None:
        self._handed_out: dict[Path, None] = {}

    def start(self) -> None:
        """Starts all jobs."""

    def stop(self) -> None:
        """Ends all jobs. A second call does nothing."""

    def progress(self) -> EngineProgress:
        """How far it is."""
        return EngineProgress()

    def new_crashes(self) -> list[Path]:
        """Inputs with a failure that were not given before. Different jobs may find the same."""
        return self._new("crashes")

    def new_queue(self) -> list[Path]:
        """Inputs that executed something new and were not given before."""
        return self._new("queue")

    def _new(self, kind: str) -> list[Path]:
        self._require_health()
        found = [path for path in self._inputs(kind) if path not in self._handed_out and self._is_whole(path)]
        self._handed_out.update(dict.fromkeys(found))
        return found

    def _inputs(self, kind: str) -> list[Path]:
        """All that its jobs have left in `queue` or `crashes`."""
        return []

    def _is_whole(self, path: Path) -> bool:
        """Whether a job has written all of an input."""
        return True

    def _require_health(self) -> None:
        """Raises BadInput for a job that has ended with an error, with its own line."""

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *raised: object) -> None:
        self.stop()


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
    given = EngineInput(spec.text(), seeds, folder.folder("engine"), dictionary, jobs, seed)
    lacking = missing()
    if lacking is None:
        afl = AflRun(given, target)
        return afl, afl.notes()
    from mirotwin.fuzz.hypothesis_engine import HypothesisRun

    note = f"{lacking}; until then Hypothesis makes up the inputs, which is slower and not guided by edges"
    return HypothesisRun(given), [note]
