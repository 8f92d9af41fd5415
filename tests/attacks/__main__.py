"""All attacks, and how many of them came through: python -m tests.attacks [--times 20] [PYTEST OPTION ..]"""

import argparse
import os
import sys
from collections import Counter
from pathlib import Path

import pytest

from tests.attacks import VARIABLE


class Count:
    """Counts what pytest reports, by surface."""

    def __init__(self):
        self.tried, self.through = Counter(), Counter()

    def pytest_runtest_logreport(self, report):
        surface = Path(report.fspath).stem.removeprefix("test_")
        self.tried[surface] += report.when == "call"
        self.through[surface] += report.failed

    def pytest_terminal_summary(self, terminalreporter):
        for surface, tried in sorted(self.tried.items()):
            terminalreporter.write_line(
                f"{surface:24} {tried:4} attacks, {self.through[surface]} came through"
            )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--times", type=int, default=20, help="how often attacks of chance are tried (default 20)"
    )
    asked, options = parser.parse_known_args()
    os.environ[VARIABLE] = str(asked.times)
    here = str(Path(__file__).parent)
    return pytest.main([here, "-n", "0", *options], plugins=[Count()])


if __name__ == "__main__":
    sys.exit(main())
