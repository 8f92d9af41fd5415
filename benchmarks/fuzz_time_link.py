"""The link machine on an image until it fails: `python -m benchmarks.fuzz_time_link IMAGE.ihx SEED`."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import hypothesis
from hypothesis.stateful import run_state_machine_as_test

from miro_robot.image import load_hex
from mirotwin.testing.bench import LinkFailure
from mirotwin.testing.machine import LinkMachine

EXAMPLES = 1_000_000


class FirstFailure(LinkMachine):
    """Ends the process with the first failure."""

    stream_file = None
    examples = 0

    def __init__(self) -> None:
        super().__init__()
        FirstFailure.examples += 1

    def _do(self, action: Callable[[], None]) -> None:
        try:
            action()
        except LinkFailure:
            print(FirstFailure.examples, flush=True)
            os._exit(0)


def main() -> None:
    FirstFailure.image = load_hex(Path(sys.argv[1]))
    settings = hypothesis.settings(
        max_examples=EXAMPLES,
        stateful_step_count=50,
        deadline=None,
        database=None,
        suppress_health_check=list(hypothesis.HealthCheck),
    )
    run_state_machine_as_test(hypothesis.seed(int(sys.argv[2]))(FirstFailure), settings=settings)  # type: ignore[no-untyped-call]


if __name__ == "__main__":
    main()
