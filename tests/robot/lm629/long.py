"""The LM629's property tests for as long as one likes: `python -m tests.robot.lm629.long --minutes 30`.

Every test of this folder that takes drawn input is called in turn, with ten times the examples it draws in the test
suite and new ones each time, until the process has used so much CPU time. A test that fails prints its example, as it
does in the suite, and is not called again. Hypothesis keeps the example, so that `pytest` shows it again.
"""

import argparse
import importlib
import sys
import time
import traceback
from pathlib import Path

from hypothesis import HealthCheck, is_hypothesis_test, settings

from tests.example_count import NORM

ROUND = 10
"""Times the examples of the test suite."""


def properties():
    """The tests of this folder that take drawn input. They read the profile when they are imported."""
    for path in sorted(Path(__file__).parent.glob("test_*.py")):
        module = importlib.import_module(f"{__package__}.{path.stem}")
        yield from (
            test for name, test in vars(module).items() if name[:5] == "test_" and is_hypothesis_test(test)
        )


class Counted:
    """A test that counts the examples it was called with and the CPU time it took."""

    def __init__(self, test):
        self.test = test
        self.examples = 0
        self.seconds = 0.0
        self.failed = False
        handle = test.hypothesis
        inner = handle.inner_test

        def count(*arguments, **named):
            self.examples += 1
            inner(*arguments, **named)

        handle.inner_test = count

    def call(self):
        begin = time.process_time()
        try:
            self.test()
        except Exception:
            self.failed = True
            traceback.print_exc()
        self.seconds += time.process_time() - begin

    def line(self):
        verdict = "FAILED" if self.failed else "ok"
        return f"{self.examples:9} examples {self.seconds:7.0f} s  {verdict:6}  {self.test.__name__}"


def main(arguments):
    parser = argparse.ArgumentParser(prog="python -m tests.robot.lm629.long")
    parser.add_argument("--minutes", type=float, default=30.0, help="CPU time, in whole rounds (default 30)")
    wanted = parser.parse_args(arguments).minutes * 60
    settings.register_profile(
        "long", max_examples=ROUND * NORM, print_blob=True, suppress_health_check=list(HealthCheck)
    )
    settings.load_profile("long")
    tests = [Counted(test) for test in properties()]
    while sum(test.seconds for test in tests) < wanted and not all(test.failed for test in tests):
        for test in tests:
            if not test.failed:
                test.call()
    print(*(test.line() for test in tests), sep="\n")
    return int(any(test.failed for test in tests))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
