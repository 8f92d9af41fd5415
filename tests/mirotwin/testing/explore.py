"""Lets the state machine look for trouble as long as one likes: `python -m tests.mirotwin.testing.explore [EXAMPLES]`.

The test run does a CI-sized part of the same (test_machine.py). A failure ends it and stands in link-failure.stream.
"""

import sys
import time

from hypothesis import HealthCheck, settings
from hypothesis.stateful import run_state_machine_as_test

from mirotwin.testing.machine import LinkMachine


def main() -> None:
    examples = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    begun = time.monotonic()
    run_state_machine_as_test(  # type: ignore[no-untyped-call]
        LinkMachine,
        settings=settings(
            max_examples=examples,
            stateful_step_count=50,
            deadline=None,
            database=None,
            suppress_health_check=list(HealthCheck),
        ),
    )
    print(f"{examples} examples of up to 50 steps: nothing found ({time.monotonic() - begun:.0f} s)")


if __name__ == "__main__":
    main()
