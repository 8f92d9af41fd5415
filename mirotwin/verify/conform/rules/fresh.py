"""Rules about which valid frame is news."""

from __future__ import annotations

from miro_protocol.table import FRESH_STEPS, SEQ_MODULUS
from mirotwin.verify.conform.rule import Air, Chapter
from mirotwin.verify.conform.rules import FRESHNESS
from mirotwin.verify.conform.trial_script import How, Talk, ms

CHAPTER = Chapter("Freshness")
AGAIN_MS = 150.0
NEAR_MS = 0.3
"""So near to 150 ms a robot may judge either way: three times the error of the shipped firmware. Chosen."""


@CHAPTER.rule(
    "P16",
    f"A valid frame MUST be fresh if its seq is 1 to {FRESH_STEPS} steps (mod 64) past that of the last fresh one.",
    FRESHNESS,
    presupposes=("P28",),
    broken="a frame 1 to 8 steps on is not obeyed",
)
def steps(talk: Talk) -> None:
    talk.seq = 30 + 20 * talk.network
    talk.obeyed(talk.team())
    for step in range(1, FRESH_STEPS + 1):
        talk.obeyed(talk.team(step=step, what=f"team frame {step} steps on"))


@CHAPTER.rule(
    "P17",
    f"A valid frame with the same seq as the last fresh one, or {FRESH_STEPS + 1} to 63 steps past it within 150 ms,"
    " MUST NOT be acted on.",
    FRESHNESS,
    presupposes=("P04", "P16"),
    broken="a frame that is not fresh is acted on",
)
def stale(talk: Talk) -> None:
    every = range(FRESH_STEPS + 1, SEQ_MODULUS) if talk.n == 3 else (9, 10, 16, 24, 32, 40, 48, 56, 62, 63)
    for count, step in enumerate((0, *every)):
        if count % 2 == 0:
            talk.obeyed(talk.team(lead=b"\xff"))
        frame = talk.team(step=step, what=f"team frame {step} steps on", lead=b"", fresh=False)
        talk.ignored(frame)
    talk.obeyed(talk.team())


@CHAPTER.rule(
    "P18",
    "150 ms or more after the last fresh frame a valid frame with any other seq MUST be fresh, and less than that after"
    f" it none but 1 to {FRESH_STEPS} steps on. Times run from last character to last character; within {NEAR_MS:g} ms"
    " of the limit either is right.",
    FRESHNESS,
    presupposes=("P30",),
)
def again(talk: Talk) -> None:
    for step in (20, 63, 9):
        for after_ms, fresh in ((AGAIN_MS - NEAR_MS, False), (AGAIN_MS + NEAR_MS, True), (400.0, True)):
            last = talk.team()
            talk.obeyed(last)
            start = last.last_tick + ms(after_ms) - (talk.form.wire_size - 1) * talk.character_ticks
            if after_ms < 200.0:  # a frame that is not fresh must not count here
                talk.team(step=0, lead=b"", fresh=False)
            talk.wait_until(start)
            frame = talk.team(
                step=step, what=f"team frame {step} steps on after {after_ms:g} ms", fresh=fresh
            )
            if fresh:
                talk.obeyed(frame)
            else:
                talk.ignored(frame)


@CHAPTER.rule(
    "P19",
    "The first valid frame after power-on MUST be fresh, whatever its seq.",
    FRESHNESS,
    airs=(Air(3, (1,)), Air(5, (3,)), Air(3, (2,)), Air(3, (0,))),
    presupposes=("P03",),
    broken="the first frame is not obeyed, whatever its seq",
)
def first(talk: Talk) -> None:
    talk.seq = (0, 40, 63, 1)[talk.network]
    talk.obeyed(talk.team(step=0, what="first team frame"))
    talk.obeyed(talk.team())


@CHAPTER.rule(
    "P20",
    "A host that repeats one frame MUST never become fresh again, not after 150 ms either.",
    FRESHNESS,
    presupposes=("P17", "P29"),
    broken="a repeated frame is acted on",
)
def repeated(talk: Talk) -> None:
    talk.obeyed(talk.team())
    for _ in range(3):
        talk.wait(105.0)
        talk.ignored(talk.team(step=0, what="team frame with the same seq", fresh=False))
    talk.obeyed(talk.team())


@CHAPTER.rule(
    "P21",
    "One counter MUST serve all types: a frame with the seq of the last fresh one is not fresh, whatever the type of"
    " either.",
    FRESHNESS,
    presupposes=("P17", "P34"),
    broken="not one counter serves all types",
)
def one_counter(talk: Talk) -> None:
    talk.obeyed(talk.team())
    how = How(fresh=False, lead=b"", gap_ms=12.0)
    for make in (talk.ping, talk.of_type_2, talk.ask_nobody):
        make()
        talk.ignored(talk.team(step=0, what="team frame with the seq of another type", **how))
        talk.obeyed(talk.team())
    talk.ignored(talk.team(ask=True, step=0, what="question with the seq of a team frame", **how))
    talk.obeyed(talk.team())
