"""The text of a scenario as TOML: reading its tables, and writing them."""

import tomllib
from collections.abc import Sequence
from typing import Any

from miro_exact.bad_input import one_line
from miro_protocol.toml_text import KEY_PARTS, TEXT_KIB, long_key_line, too_long
from miro_sim.scenario.errors import ScenarioError

LONGEST_BITS = 1024
"""Beyond it an integer is beyond every float, too."""


def check_size(text: str, origin: str) -> None:
    """Refuses what would take `tomllib` minutes."""
    if too_long(text):
        what = f"holds more than {TEXT_KIB} KiB"
        raise ScenarioError(origin, "", what, "is this the right file?")
    line = long_key_line(text)
    if line is not None:
        what = f"a key of more than {KEY_PARTS} parts"
        raise ScenarioError(origin, f"line {line}", what, "remove it; no key of a scenario has more than 6")


def tables(text: str, origin: str) -> dict[str, Any]:
    """The tables that the text holds. Raises ScenarioError."""
    check_size(text, origin)
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(origin, text, str(error)) from None
    except ValueError:  # an integer with more digits than Python converts
        raise ScenarioError(origin, "", "an integer of thousands of digits") from None
    check_integers(raw, origin)  # they could not be written as text either
    return raw


def _syntax_error(origin: str, text: str, message: str) -> ScenarioError:
    what, _, position = message.partition(" (at ")
    position = position.rstrip(")")
    if position == "end of document":
        position = f"line {text.count(chr(10)) + 1}"
    return ScenarioError(origin, position, f"not TOML: {what}")


def check_integers(value: Any, origin: str, path: str = "") -> None:
    """Refuses integers in hex that are too long to be shown, let alone meant; `tomllib` reads them."""
    if isinstance(value, int) and value.bit_length() > LONGEST_BITS:
        raise ScenarioError(origin, path, f"an integer of {value.bit_length()} bits", "give a smaller one")
    if isinstance(value, dict):
        for key, inner in value.items():
            check_integers(inner, origin, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            check_integers(inner, origin, f"{path}[{index}]")


def written(raw: dict[str, Any], origin: str, settings: Sequence[str]) -> str:
    """A scenario file of these tables; its head says what it was made of."""
    import tomli_w  # only scenarios with settings need it

    head = [f"# {origin} with these keys set:", *(f"#   {setting}" for setting in settings)]
    if not settings:
        head = [f"# {origin} with what the scenario says that it names"]
    return "\n".join([*map(one_line, head), "", tomli_w.dumps(raw)])
