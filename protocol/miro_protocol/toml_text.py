"""What must not be given to `tomllib`: text that takes it minutes.

What belongs here: the limits, and finding what is beyond them. What does not: which keys a document may have.
"""

import re

TEXT_KIB = 512
"""Most KiB of a document: a built-in scenario has 4."""
KEY_PARTS = 16
"""Most parts of a dotted key: the deepest key of a scenario has 6. The time of `tomllib` grows with their square; a
whole file of such keys takes it 2.5 s.
"""

_KEY_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_KEY_PART}(?:[ \t]*+\.[ \t]*+{_KEY_PART}){{{KEY_PARTS}}}")


def too_long(text: str) -> bool:
    """Whether `text` holds more than `TEXT_KIB`."""
    return len(text) > TEXT_KIB << 10


def long_key_line(text: str) -> int | None:
    """The line, from 1, of the first key with more than `KEY_PARTS` parts; None if there is none."""
    found = _LONG_KEY.search(text)
    return None if found is None else text.count("\n", 0, found.start()) + 1
