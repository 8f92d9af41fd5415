"""Many runs: what a run is made from, the row of figures that it leaves, and the workers that make the rows.

    from mirotwin import campaign

    plan = campaign.load("noise.toml")              # or campaign.parse(text, "noise.toml")
    campaign.run(plan, "noise.parquet")             # or with any executor of concurrent.futures
    table, about = campaign.read("noise.parquet")   # an Arrow table, a row a run

Names are loaded on first use: workers read this file before their engine is chosen.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mirotwin.campaign.plan import Plan as Plan
    from mirotwin.campaign.plan import load_plan as load
    from mirotwin.campaign.plan import parse_plan as parse
    from mirotwin.campaign.results import read as read
    from mirotwin.campaign.running import run as run
    from mirotwin.campaign.workers import Processes as Processes

_PLACES = {
    "Plan": "plan:Plan",
    "Processes": "workers:Processes",
    "load": "plan:load_plan",
    "parse": "plan:parse_plan",
    "read": "results:read",
    "run": "running:run",
}

__all__ = ["Plan", "Processes", "load", "parse", "read", "run"]


def __getattr__(name: str) -> Any:
    place = _PLACES.get(name)
    if place is None:
        raise AttributeError(
            f"module 'mirotwin.campaign' has no attribute {name!r}; it has {', '.join(_PLACES)}"
        )
    module, _, inner = place.partition(":")
    value = getattr(import_module(f"mirotwin.campaign.{module}"), inner)
    globals()[name] = value
    return value
