"""The page for people who test their own firmware: its examples run as they stand there."""

import re
from pathlib import Path

import pytest

from tests.mirotwin.testing.sessions import session

PAGE = Path(__file__).parents[3] / "mirotwin/testing/README.md"
(PLUGIN,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.slow
def test_the_examples_of_the_fixtures_pass(tmp_path):
    (tmp_path / "test_mine.py").write_text(PLUGIN)
    done = session(tmp_path)
    assert done.returncode == 0, done.stdout
    assert f"{PLUGIN.count('def test_')} passed" in done.stdout
