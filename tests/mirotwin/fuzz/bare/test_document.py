"""The page about foreign firmware: its format and its check work as they stand there."""

import re
from pathlib import Path
from types import SimpleNamespace

from miro_protocol.protocol import Damage, Frame

ROOT = Path(__file__).parents[4]
PAGE = (ROOT / "docs" / "fuzz-any-8051.md").read_text(encoding="utf-8")
CHECK, FORMAT = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


def test_its_check_says_what_is_wrong():
    found = {}
    exec(CHECK, found)
    levels = [found["level_is_kept"](SimpleNamespace(memory={"level": level})) for level in (100, 101)]
    assert levels == [None, "the level is 101"]


def test_its_format_keeps_the_laws_of_the_interface():
    found = {}
    exec(FORMAT, found)
    lines = found["Lines"]()
    assert lines.encode(b"ab") == b"abc3\n"
    assert lines.decode(b"abc3\n" + b"abc4\n") == [Frame(b"ab", 0, 5), Damage(5, 10, "bad sum")]
    assert lines.decode(lines.repair(b"a\nb")) == [Frame(b"a b", 0, 6)]


def test_its_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#]+)\)", PAGE):
        assert (ROOT / "docs" / target).exists(), target
