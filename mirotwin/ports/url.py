"""What stands in a `miro://` URL.

    miro://SCENARIO?seed=7&firmware=build/mine.ihx&set=network.radio.latency_s=0.002&network=0&realtime=1&limit_s=60&out=DIR

SCENARIO is a built-in name or the path of a .toml file (`miro:///tmp/my.toml` is absolute). `set` may be repeated.
`%xx` stands for a byte.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from urllib.parse import unquote

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.domain import MAX_SEED
from miro_sim.scenario.file import LONGEST_S
from miro_sim.scenario.keys import MAX_NETWORKS
from mirotwin.rerun.pacing import FASTEST

SCHEME = "miro://"


class UrlOptions(msgspec.Struct, frozen=True):
    """What a URL asks for. `realtime`: virtual seconds in a second; 0: time passes in calls. `out` "": no files."""

    scenario: str
    seed: int = 0
    firmware: str = ""
    settings: tuple[str, ...] = ()
    network: int = 0
    realtime: float = 0.0
    limit_s: float = LONGEST_S
    out: str = ""


def parse_url(url: str) -> UrlOptions:
    """Raises BadInput for a scheme, an option or a value that it does not know, and for an option that stands twice."""
    if not url.lower().startswith(SCHEME):
        raise BadInput(url, "", "is no miro:// URL", f"begin with {SCHEME}SCENARIO")
    name, _, query = url[len(SCHEME) :].partition("?")
    scenario = unquote(name.rstrip("/") if not name.endswith(".toml") else name)
    if not scenario:
        raise BadInput(url, "", "names no scenario", f"give {SCHEME}fig6, for example")
    found: dict[str, Any] = {}
    settings: list[str] = []
    for part in query.split("&") if query else ():
        key, _, value = (unquote(word) for word in part.partition("="))
        if key == "set":
            settings.append(value)
            continue
        if key not in _READERS:
            known = ", ".join(["set", *_READERS])
            raise BadInput(url, key, "is no option of the URL", f"there are {known}")
        if key in found:
            raise BadInput(url, key, "stands twice", "give it once")
        try:
            found[key] = _READERS[key](value)
        except ValueError as error:
            raise BadInput(url, key, f"{value!r} {error}") from None
    return UrlOptions(scenario, settings=tuple(settings), **found)


def _whole(most: int) -> Callable[[str], int]:
    def read(value: str) -> int:
        if not (value.isascii() and value.isdecimal()) or not 0 <= int(value) <= most:
            raise ValueError(f"is no whole number from 0 to {most}")
        return int(value)

    return read


def _number(most: float) -> Callable[[str], float]:
    def read(value: str) -> float:
        try:
            number = float(value)
        except ValueError:
            number = -1.0
        if not 0.0 < number <= most:
            raise ValueError(f"is no number above 0 and up to {most:g}")
        return number

    return read


def _text(value: str) -> str:
    if not value:
        raise ValueError("is empty")
    return value


_READERS: dict[str, Callable[[str], Any]] = {
    "seed": _whole(MAX_SEED),
    "firmware": _text,
    "network": _whole(MAX_NETWORKS - 1),
    "realtime": _number(FASTEST),
    "limit_s": _number(LONGEST_S),
    "out": _text,
}
