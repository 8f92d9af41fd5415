"""One trial: an engine fuzzes an image until a crash of it is confirmed, or the time is over.

What counts is processor time of the engine's processes, from their start to the crash, because it depends little on
what else the machine does. A trial ends after `limit_s` of it, or after three times as long on the wall clock. A crash
is confirmed when checks fail for it in a world with the mistaken firmware that do not fail there with the shipped one.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack
from functools import cache
from pathlib import Path

import msgspec

from benchmarks.processor_time import of_descendants
from miro_exact.bad_input import BadInput
from miro_robot.firmware import image_path
from miro_robot.image import Image, load_hex
from mirotwin.fuzz.afl.run import AflRun
from mirotwin.fuzz.engine import EngineInput, write_dictionary, write_seeds
from mirotwin.fuzz.hypothesis_process import HypothesisRun
from mirotwin.fuzz.inputs import message_tokens, seeds
from mirotwin.fuzz.making import make_target
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import Target
from tests.mutants.build import CACHE, IMAGE
from tests.mutants.heard import Input, verdicts

ENGINES = ("afl", "hypothesis")
LOOK_S = 0.2
WALL_FACTOR = 3.0
ROBOTS, SLOT = 3, 0


class Wanted(msgspec.Struct, frozen=True):
    """A trial. `check`: the one that the mistake fails, "" where any will do; `image`: its folder."""

    table: str
    mistake: str
    check: str
    engine: str
    seed: int
    limit_s: float
    image: str

    @property
    def key(self) -> str:
        return f"{self.table}: {self.mistake}: {self.engine}: {self.seed}"

    @property
    def path(self) -> str:
        return str(CACHE / self.image / IMAGE)


class Trial(msgspec.Struct, frozen=True):
    """The result. `found_s`: None where nothing was found; `checks`: those that failed; `seeded`: by a seed.
    `refused`: why no target could be made, because the firmware does not come up: `found_s` is 0.0.
    """

    wanted: Wanted
    found_s: float | None
    wall_s: float
    checks: tuple[str, ...] = ()
    seeded: bool = False
    executions: int = 0
    unconfirmed: int = 0
    refused: str = ""

    @property
    def named(self) -> bool:
        """Found, by the check that the mistake names."""
        return self.found_s is not None and (not self.wanted.check or self.wanted.check in self.checks)

    def answers(self, wanted: Wanted) -> bool:
        """Whether `wanted`, which has the same key, would come to the same."""
        enough = self.found_s is not None or self.wanted.limit_s >= wanted.limit_s
        return enough and self.wanted.image == wanted.image

    def __str__(self) -> str:
        when = f"{self.found_s:.1f} s" if self.found_s is not None else f"not in {self.wanted.limit_s:.0f} s"
        if self.refused:
            return f"{self.wanted.key}: refused: {self.refused}"
        how = f" ({', '.join(self.checks)}{', by a seed' if self.seeded else ''})" if self.checks else ""
        return f"{self.wanted.key}: {when}{how}; {self.executions} executions, {self.unconfirmed} unconfirmed"


def measured(wanted: Wanted) -> Trial:
    """Runs the trial."""
    with tempfile.TemporaryDirectory(prefix="fuzz-time-") as name:
        return _of_engine(wanted, Path(name))


def confirmed(image: Image, heard: Input) -> tuple[str, ...]:
    """The checks that fail by this input with `image` alone."""
    failed = _failed(image, heard)
    return tuple(check for check in failed if check not in _failed(shipped(), heard)) if failed else ()


@cache
def shipped() -> Image:
    """The firmware without a mistake."""
    return load_hex(image_path())


def _failed(image: Image, heard: Input) -> list[str]:
    return (
        [check for check, verdict in verdicts(image, heard).items() if verdict == "failed"] if heard else []
    )


def _of_engine(wanted: Wanted, folder: Path) -> Trial:
    spec = TargetSpec(image=wanted.path, robots=ROBOTS, slot=SLOT)
    try:
        target = make_target(spec)
    except BadInput as error:
        return Trial(wanted, 0.0, 0.0, refused=error.what)
    given = seeds(spec.input, ROBOTS, SLOT)
    write_seeds(folder / "seeds", given)
    write_dictionary(folder / "dictionary", message_tokens(ROBOTS))
    begin = EngineInput(spec.text(), folder / "seeds", folder / "out", folder / "dictionary", 1, wanted.seed)
    engine = (AflRun if wanted.engine == "afl" else HypothesisRun)(begin, make_target(spec))
    looked = _Looked(target)
    with ExitStack() as at_end:
        begun_s, spent_s = time.monotonic(), 0.0
        seeded = looked.at(given)  # afl-fuzz leaves seeds out that fail
        run = None if seeded else at_end.enter_context(engine)
        while run and not looked.checks and _goes_on(wanted, begun_s, spent_s):
            time.sleep(LOOK_S)
            spent_s = of_descendants()
            looked.at([path.read_bytes() for path in run.new_crashes()])
        wall_s = time.monotonic() - begun_s
        executions = run.progress().executions if run else target.executions
    found_s = spent_s if looked.checks else None
    return Trial(wanted, found_s, wall_s, looked.checks, seeded, executions, looked.unconfirmed)


def _goes_on(wanted: Wanted, begun_s: float, spent_s: float) -> bool:
    return spent_s < wanted.limit_s and time.monotonic() - begun_s < WALL_FACTOR * wanted.limit_s


class _Looked:
    """At crashes. `checks`: those that fail by the first one that is confirmed."""

    def __init__(self, target: Target) -> None:
        self.target = target
        self.checks: tuple[str, ...] = ()
        self.unconfirmed = 0

    def at(self, inputs: Sequence[bytes]) -> bool:
        """Whether one of these is confirmed."""
        for data in inputs:
            if not self.checks and self.target.run(data):
                self.checks = confirmed(self.target.image, self.target.script(data))
                self.unconfirmed += not self.checks
        return bool(self.checks)
