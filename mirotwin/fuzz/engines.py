"""The input generator of a campaign: AFL++ where it is installed, else Hypothesis."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.afl.run import AflRun, shared_cores
from mirotwin.fuzz.afl.settings import missing
from mirotwin.fuzz.engine import Engine, EngineInput, write_dictionary, write_seeds
from mirotwin.fuzz.files import CampaignFolder
from mirotwin.fuzz.hypothesis_process import HypothesisRun
from mirotwin.fuzz.inputs import message_tokens, wire_tokens
from mirotwin.fuzz.spec import TargetSpec

if TYPE_CHECKING:
    from mirotwin.fuzz.target import Target

_TOKENS, _TOKEN = 32, 64
"""Largest number of inputs used as words of a foreign format, and largest length of such a word in bytes."""


def engine_for(
    spec: TargetSpec,
    inputs: Sequence[bytes],
    folder: CampaignFolder,
    target: Target,
    jobs: int,
    seed: int | None,
) -> tuple[Engine, list[str]]:
    """AFL++, or Hypothesis, with a note for the user about it. Raises BadInput where neither can run."""
    seeds, dictionary = folder.folder("seeds"), folder.path / "dictionary"
    write_seeds(seeds, inputs)
    if spec.board != "miro":
        tokens = [data[:_TOKEN] for data in inputs[:_TOKENS]]
    else:
        tokens = wire_tokens(spec.robots) if spec.input == "bytes" else message_tokens(spec.robots)
    write_dictionary(dictionary, tokens)
    given = EngineInput(spec.text(), seeds, folder.folder("engine"), dictionary, jobs, seed)
    lacking = missing()
    if lacking is None:
        return AflRun(given, target), shared_cores(jobs)
    if find_spec("hypothesis") is None:
        remedy = "install it with `pip install 'mirotwin[hypothesis]'`"
        raise BadInput("Hypothesis", "", "Hypothesis is not installed", remedy)
    note = f"{lacking}; until then Hypothesis makes up the inputs, which is slower and not guided by edges"
    return HypothesisRun(given, target), [note]
