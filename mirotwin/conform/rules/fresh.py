"""Rules about which valid frame is news."""

from __future__ import annotations

from miro_protocol.table import FRESH_AGAIN_TICKS, FRESH_STEPS, SEQ_MODULUS, TICKS_PER_MS
from mirotwin.conform.rule import FRESHNESS, Chapter, Topology
from mirotwin.conform.trial_script import How, TrialScript, ms

CHAPTER = Chapter("Freshness")
AGAIN_MS = FRESH_AGAIN_TICKS / TICKS_PER_MS
NEAR_MS = 0.3
"""Within this distance of 150 ms a robot may decide either way. Chosen: three times the shipped firmware's error."""


@CHAPTER.rule("P16", FRESHNESS, presupposes="P28", broken="a frame 1 to 8 steps on is not obeyed")
def steps(script: TrialScript) -> None:
    """A valid frame MUST be fresh if its seq is 1 to 8 steps (mod 64) past that of the last fresh one."""
    script.seq = 30 + 20 * script.network
    script.obeyed(script.team())
    for step in range(1, FRESH_STEPS + 1):
        script.obeyed(script.team(step=step, label=f"team frame {step} steps on"))


@CHAPTER.rule("P17", FRESHNESS, presupposes="P04 P16", broken="a frame that is not fresh is acted on")
def stale(script: TrialScript) -> None:
    """A valid frame with the same seq as the last fresh one, or 9 to 63 steps past it within 150 ms, MUST NOT be acted
    on.
    """
    every = range(FRESH_STEPS + 1, SEQ_MODULUS) if script.n == 3 else (9, 10, 16, 24, 32, 40, 48, 56, 62, 63)
    for count, step in enumerate((0, *every)):
        if count % 2 == 0:
            script.obeyed(script.team(lead=b"\xff"))
        script.ignored(script.team(step=step, label=f"team frame {step} steps on", lead=b"", fresh=False))
    script.obeyed(script.team())


@CHAPTER.rule("P18", FRESHNESS, presupposes="P30")
def again(script: TrialScript) -> None:
    """150 ms or more after the last fresh frame a valid frame with any other seq MUST be fresh, and less than that
    after it none but 1 to 8 steps on. Times run from last character to last character; within 0.3 ms of the limit
    either is right.
    """
    for step in (20, 63, 9):
        for after_ms, fresh in ((AGAIN_MS - NEAR_MS, False), (AGAIN_MS + NEAR_MS, True), (400.0, True)):
            last = script.obeyed(script.team())
            start = last.last_tick + ms(after_ms) - (script.form.wire_size - 1) * script.character_ticks
            if after_ms < 200.0:  # a frame that is not fresh must not count here
                script.team(step=0, lead=b"", fresh=False)
            script.wait_until(start)
            name = f"team frame {step} steps on after {after_ms:g} ms"
            (script.obeyed if fresh else script.ignored)(script.team(step=step, label=name, fresh=fresh))


@CHAPTER.rule(
    "P19",
    FRESHNESS,
    presupposes="P03",
    topologies=(Topology(3, (1,)), Topology(5, (3,)), Topology(3, (2,)), Topology(3, (0,))),
    broken="the first frame is not obeyed, whatever its seq",
)
def first(script: TrialScript) -> None:
    """The first valid frame after power-on MUST be fresh, whatever its seq."""
    script.seq = (0, 40, 63, 1)[script.network]
    script.obeyed(script.team(step=0, label="first team frame"))
    script.obeyed(script.team())


@CHAPTER.rule("P20", FRESHNESS, presupposes="P17 P29", broken="a repeated frame is acted on")
def repeated(script: TrialScript) -> None:
    """A host that repeats one frame MUST never become fresh again, not after 150 ms either."""
    script.obeyed(script.team())
    for _ in range(3):
        script.wait(105.0)
        script.ignored(script.team(step=0, label="team frame with the same seq", fresh=False))
    script.obeyed(script.team())


@CHAPTER.rule("P21", FRESHNESS, presupposes="P17 P34", broken="not one counter serves all types")
def one_counter(script: TrialScript) -> None:
    """One counter MUST serve all types: a frame with the seq of the last fresh one is not fresh, whatever the type of
    either.
    """
    script.obeyed(script.team())
    how = How(step=0, fresh=False, lead=b"", gap_ms=12.0)
    for make in (script.ping, script.of_type_2, script.ask_nobody):
        make()
        script.ignored(script.team(label="team frame with the seq of another type", **how))
        script.obeyed(script.team())
    script.ignored(script.team(ask=True, label="question with the seq of a team frame", **how))
    script.obeyed(script.team())
