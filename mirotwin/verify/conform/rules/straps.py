"""Rules about the pins that say which robot this is."""

from __future__ import annotations

from mirotwin.verify.conform.rule import Chapter, Topology
from mirotwin.verify.conform.rules import TURNS
from mirotwin.verify.conform.trial_script import TrialScript

CHAPTER = Chapter("Straps")


@CHAPTER.rule(
    "P60",
    "A robot whose slot pins say N or more MUST never move and never answer.",
    TURNS,
    topologies=(
        Topology(3, (1,)),
        Topology(3, (1,), strap=3),
        Topology(3, (1,), strap=4),
        Topology(3, (1,), strap=7),
        Topology(5, (3,), strap=5),
    ),
    presupposes=("P41",),
)
def no_slot(script: TrialScript) -> None:
    for _ in range(2):
        for slot in range(script.n):
            script.team()
            question = script.ask(slot, gap_ms=36.0)
            if script.topology.strap is None:  # a robot that is there, beside them
                script.obeyed(question)
    if script.topology.strap is None:
        return
    script.unchanged(0, script.now, "the wheels of no robot of this network told anything")
    script.silent(0, script.now, "no robot of this network is asked")
