"""Parses a `miro://` URL.

    miro://SCENARIO?seed=7&firmware=build/mine.ihx&set=network.radio.latency_s=0.002&network=0&realtime=1&limit_s=60&out=DIR

SCENARIO is a built-in name or the path of a .toml file (`miro:///tmp/my.toml` is absolute). `set` may be repeated.
`%xx` stands for a byte.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any
from urllib.parse import unquote

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.domain import MAX_SEED
from miro_sim.scenario.file import LONGEST_S
from miro_sim.scenario.keys import MAX_NETWORKS
from mirotwin.ports.session import FASTEST

SCHEME = "miro://"


class UrlOptions(msgspec.Struct, frozen=True):
    """The options of a URL.

    `realtime`: virtual seconds per second; 0: time passes only in calls. `out` "": no files.
    """

    scenario: str
    seed: int = 0
    firmware: str = ""
    settings: tuple[str, ...] = ()
    network: int = 0
    realtime: float = 0.0
    limit_s: float = LONGEST_S
    out: str = ""


def parse_url(url: str) -> UrlOptions:
    """Raises BadInput for an unknown scheme, option or value, and for an option given twice."""
    if not url.lower().startswith(SCHEME):
        raise BadInput(url, "", "is no miro:// URL", f"begin with {SCHEME}SCENARIO")
    name, _, query = url[len(SCHEME) :].partition("?")
    scenario = unquote(name.rstrip("/") if not name.endswith(".toml") else name)
    if not scenario:
        raise BadInput(url, "", "names no scenario", f"give {SCHEME}fig6, for example")
    options: dict[str, Any] = {}
    settings: list[str] = []
    for part in query.split("&") if query else ():
        key, _, value = (unquote(word) for word in part.partition("="))
        if key == "set":
            settings.append(value)
            continue
        if key not in _LIMITS:
            known = ", ".join(["set", *_LIMITS])
            raise BadInput(url, key, "is no option of the URL", f"there are {known}")
        if key in options:
            raise BadInput(url, key, "stands twice", "give it once")
        try:
            options[key] = _read(value, _LIMITS[key])
        except ValueError as error:
            raise BadInput(url, key, f"{value!r} {error}") from None
    return UrlOptions(scenario, settings=tuple(settings), **options)


_LIMITS: dict[str, int | float | None] = {
    "seed": MAX_SEED,
    "firmware": None,
    "network": MAX_NETWORKS - 1,
    "realtime": FASTEST,
    "limit_s": LONGEST_S,
    "out": None,
}
"""Option -> largest number; None for text. `set` is read apart."""


def _read(value: str, most: float | None) -> str | float:
    """The value of an option. Raises ValueError."""
    if most is None:
        if not value:
            raise ValueError("is empty")
        return value
    if isinstance(most, int):
        if not (value.isascii() and value.isdecimal()) or int(value) > most:
            raise ValueError(f"is no whole number from 0 to {most}")
        return int(value)
    with suppress(ValueError):
        if 0.0 < float(value) <= most:
            return float(value)
    raise ValueError(f"is no number above 0 and up to {most:g}")
