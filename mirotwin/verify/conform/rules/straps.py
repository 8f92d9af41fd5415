"""Rules about the pins that say which robot this is."""

from __future__ import annotations

from mirotwin.verify.conform.rule import Air, Chapter
from mirotwin.verify.conform.rules import TURNS
from mirotwin.verify.conform.trial_script import Talk

CHAPTER = Chapter("Straps")


@CHAPTER.rule(
    "P60",
    "A robot whose slot pins say N or more MUST never move and never answer.",
    TURNS,
    airs=(
        Air(3, (1,)),
        Air(3, (1,), strap=3),
        Air(3, (1,), strap=4),
        Air(3, (1,), strap=7),
        Air(5, (3,), strap=5),
    ),
    presupposes=("P41",),
)
def no_slot(talk: Talk) -> None:
    for _ in range(2):
        for slot in range(talk.n):
            talk.team()
            question = talk.ask(slot, gap_ms=36.0)
            if talk.air.strap is None:  # a robot that is there, beside them
                talk.obeyed(question)
    if talk.air.strap is None:
        return
    talk.unchanged(0, talk.now, "the wheels of no robot of this network told anything")
    talk.silent(0, talk.now, "no robot of this network is asked")
