"""What is wrong with a check of another distribution, looked at before the run."""

from __future__ import annotations

from typing import Any, get_args

from miro_exact.bad_input import did_you_mean
from miro_host.plugins import PluginError
from miro_host.raised import at_place, defined_at
from mirotwin.verify.checks.interface import EVENT_KINDS, Check, Kind, Monitor, Subject


def checked_monitor(check: Check, subject: Subject) -> Monitor[Any]:
    """The monitor of one robot. Raises PluginError for what is not one."""
    monitor: Any = check.monitor(subject)
    place = defined_at(check.monitor)
    if not isinstance(monitor, Monitor):
        what = at_place(f"`monitor` returned {monitor!r:.40}", place)
        raise PluginError(what, "return an object of a class that derives from Monitor")
    if not hasattr(monitor, "failures"):
        what = f"the constructor of {type(monitor).__name__} does not call that of Monitor"
        raise PluginError(
            at_place(what, defined_at(type(monitor).__init__)), "call super().__init__(check, subject)"
        )
    _check_events(monitor, place)
    return monitor


def problem_of_class(struct: type[Check]) -> str:
    """What the class of a check lacks, or the empty string."""
    name = f"{struct.__module__}.{struct.__name__}"
    if getattr(struct, "KIND", None) not in get_args(Kind):
        return f"{name} has no KIND: write KIND = 'safety' (never) or 'liveness' (within a time)"
    if struct.monitor is Check.monitor:
        return f"{name} has no method `monitor`"
    return ""


def _check_events(monitor: Monitor[Any], place: str) -> None:
    events: Any = monitor.EVENTS
    name = f"EVENTS of {type(monitor).__name__}"
    if not isinstance(events, tuple | list | set | frozenset):
        raise PluginError(at_place(f"{name} is {events!r:.40}", place), f"write ({events!r:.40},)")
    for what in events:
        if what not in EVENT_KINDS:
            said = at_place(f"{name} names {what!r:.40}, which is no event", place)
            raise PluginError(
                said, did_you_mean(str(what), EVENT_KINDS, f"there are {', '.join(EVENT_KINDS)}")
            )
