"""The text of a scenario as TOML: what may be given to the parser, and writing one.

What belongs here: limits of the text, tables to text. What does not: what the tables mean (`keys`), finding and reading
files (`file`).
"""

from collections.abc import Sequence
from typing import Any

from miro_exact.bad_input import one_line
from miro_protocol.toml_text import KEY_PARTS, TEXT_KIB, long_key_line, too_long
from miro_sim.scenario.errors import ScenarioError


def check_size(text: str, origin: str) -> None:
    """Refuses what would take `tomllib` minutes."""
    if too_long(text):
        what = f"holds more than {TEXT_KIB} KiB"
        raise ScenarioError(origin, "", what, "is this the right file?")
    line = long_key_line(text)
    if line is not None:
        what = f"a key of more than {KEY_PARTS} parts"
        raise ScenarioError(origin, f"line {line}", what, "remove it; no key of a scenario has more than 6")


def written(raw: dict[str, Any], origin: str, settings: Sequence[str]) -> str:
    """A scenario file of these tables; its head says what it was made of."""
    import tomli_w  # only scenarios with settings need it

    head = [f"# {origin} with these keys set:", *(f"#   {setting}" for setting in settings)]
    return "\n".join([*map(one_line, head), "", tomli_w.dumps(raw)])
