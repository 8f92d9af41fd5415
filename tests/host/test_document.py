"""The package's page: its example runs as it stands there."""

import re
import sys
from pathlib import Path

from tests import children

PAGE = Path(__file__).parents[2] / "host" / "README.md"


EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def printed(code):
    done = children.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_the_first_example_prints_three_frames():
    lines = printed(EXAMPLES[0])
    assert [bytes.fromhex(line)[5:8] for line in lines] == [bytes.fromhex("ff 2d d4")] * 3


def test_the_law_of_the_second_example_is_driven_and_remembers():
    lines = [[float(number) for number in line.split()] for line in printed(EXAMPLES[1])]
    errors_m = [error_m for _, error_m in lines]
    assert errors_m == sorted(errors_m)
    assert 0.0 < errors_m[0] < errors_m[2]
    assert all(0.0 < v_m_s <= 0.5 for v_m_s, _ in lines)
    assert len(EXAMPLES) == 2


def test_the_page_names_every_module():
    package = PAGE.parent / "miro_host"
    paths = {path.relative_to(package).with_suffix("") for path in package.rglob("*.py")}
    modules = {path.as_posix() for path in paths if path.name != "__init__"}
    assert modules == set(re.findall(r"^\| `([\w/]+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE))
