"""The package's page: its example runs as it stands there."""

import re
import sys
from pathlib import Path

from tests import children

PAGE = Path(__file__).parents[2] / "host" / "README.md"


def test_the_example_prints_three_frames():
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    done = children.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert [bytes.fromhex(line)[5:8] for line in lines] == [bytes.fromhex("ff 2d d4")] * 3


def test_the_page_names_every_module():
    package = PAGE.parent / "miro_host"
    paths = {path.relative_to(package).with_suffix("") for path in package.rglob("*.py")}
    modules = {path.as_posix() for path in paths if path.name != "__init__"}
    assert modules == set(re.findall(r"^\| `([\w/]+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE))
