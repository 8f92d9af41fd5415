"""The package's page: its example runs as it stands there."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "host" / "README.md"


def test_the_page_names_every_module():
    package = PAGE.parent / "miro_host"
    paths = {path.relative_to(package).with_suffix("") for path in package.rglob("*.py")}
    modules = {path.as_posix() for path in paths if path.name != "__init__"}
    assert modules == set(re.findall(r"^\| `([\w/]+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE))
