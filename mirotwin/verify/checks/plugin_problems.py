"""A judge, looked at before the run: that it is one, hears events that there are, and has been begun."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any, get_args

from miro_host.plugins import PluginError
from miro_host.raised import at_place, defined_at
from mirotwin.verify.checks.interface import EVENTS, Check, Judge, Kind, Subject


def checked_judge(check: Check, subject: Subject) -> Judge[Any]:
    """The judge of one robot. Raises PluginError for what is not one."""
    judge: Any = check.judge(subject)
    place = defined_at(check.judge)
    if not isinstance(judge, Judge):
        what = at_place(f"`judge` returned {judge!r:.40}", place)
        raise PluginError(what, "return an object of a class that derives from Judge")
    if not hasattr(judge, "failures"):
        what = f"the constructor of {type(judge).__name__} does not call that of Judge"
        raise PluginError(
            at_place(what, defined_at(type(judge).__init__)), "call super().__init__(check, subject)"
        )
    _check_hears(judge, place)
    return judge


def problem_of_class(struct: type[Check]) -> str:
    """What the class of a check lacks, or the empty string."""
    name = f"{struct.__module__}.{struct.__name__}"
    if getattr(struct, "KIND", None) not in get_args(Kind):
        return f"{name} has no KIND: write KIND = 'safety' (never) or 'liveness' (within a time)"
    if struct.judge is Check.judge:
        return f"{name} has no method `judge`"
    return ""


def _check_hears(judge: Judge[Any], place: str) -> None:
    hears: Any = judge.HEARS
    name = f"HEARS of {type(judge).__name__}"
    if not isinstance(hears, tuple | list | set | frozenset):
        raise PluginError(at_place(f"{name} is {hears!r:.40}", place), f"write ({hears!r:.40},)")
    for what in hears:
        if what not in EVENTS:
            close = get_close_matches(str(what), EVENTS, n=1)
            mean = f"did you mean {close[0]}? " if close else ""
            said = at_place(f"{name} names {what!r:.40}, which is no event", place)
            raise PluginError(said, f"{mean}there are {', '.join(EVENTS)}")
