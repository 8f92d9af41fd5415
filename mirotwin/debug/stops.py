"""The verbs for breakpoints."""

from __future__ import annotations

from miro_exact.bad_input import BadInput
from mirotwin.debug.debugger import ACCESSES
from mirotwin.debug.session import Session


def add(session: Session, rest: str, once: bool = False) -> None:
    """At a place; alone it lists them."""
    if not rest:
        tell_all(session)
        return
    place, _, condition = (part.strip() for part in f" {rest}".partition(" if "))
    point = session.debugger.add(session.place(place or f"{session.here().place:#x}"), condition)
    point.once = once
    note = f" ({point.note})" if point.note else ""
    session.tell(f"breakpoint {point.number}: {session.symbols.place(min(point.addresses))}{note}")


def tell_all(session: Session) -> None:
    for point in session.debugger.breakpoints:
        once = "   (once)" if point.once else ""
        session.tell(f"{point.number}  {point.text}{once}")


def watch(session: Session, rest: str, access: str = "write") -> None:
    name, _, condition = (part.strip() for part in rest.partition(" if "))
    point = session.debugger.watch(name, condition, access=access)
    session.tell(f"breakpoint {point.number}: before {name} {ACCESSES[access]}")


def delete(session: Session, rest: str) -> None:
    there = session.debugger.breakpoints
    for word in rest.split():
        if not any(str(point.number) == word for point in there):
            raise BadInput("", "delete", f"there is no breakpoint {word}", "`break` lists them")
    there[:] = [point for point in there if rest and str(point.number) not in rest.split()]
