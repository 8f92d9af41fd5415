"""Rules about the processor and its chips under load: bus, main loop, stack, and the reset pin in the middle of it."""

from __future__ import annotations

from miro_protocol.table import SYNC, Opcode
from miro_robot.faults import STACK_FAULTS, FaultKind
from miro_robot.lm629.signals import COMMAND_ERROR
from mirotwin.verify.conform.rule import Chapter
from mirotwin.verify.conform.rules import FAULTS, POWER_ON
from mirotwin.verify.conform.rules.boot import keeps_off
from mirotwin.verify.conform.seen import Seen
from mirotwin.verify.conform.trial_script import BOOTED_MS, Found, Talk, ms

CHAPTER = Chapter("Soundness")


def nothing_refused(talk: Talk) -> None:
    """Expects that no LM629 refused a command up to now."""
    end = talk.now

    def refused(seen: Seen) -> Found:
        for tick, side, chip in seen.chips(0, end):
            if chip.status & COMMAND_ERROR:
                return tick, f"command error of the {side} one"
        return None

    talk.expect(end, "no command that an LM629 refuses", refused)


@CHAPTER.rule(
    "P51",
    "The LM629s MUST be used as their data sheet says: bus timing, never written while busy, one at a time on the bus,"
    " and no command that they refuse.",
    FAULTS,
    faults=(FaultKind.BUS_CONTENTION, FaultKind.LM629_BUSY, FaultKind.LM629_TIMING),
    presupposes=("P52",),
    broken="LM629s are not used as their data sheet says",
)
def lm629(talk: Talk) -> None:
    load(talk)
    nothing_refused(talk)


@CHAPTER.rule(
    "P52",
    "Interrupts MUST leave the main loop time: never all of 10 ms, whatever comes over the air.",
    FAULTS,
    faults=(FaultKind.MAIN_LOOP_STARVED,),
    presupposes=("P13", "P16", "P36"),
    broken="interrupts leave the main loop no time, or frames are lost under load",
)
def main_loop(talk: Talk) -> None:
    load(talk)


@CHAPTER.rule(
    "P53",
    "The stack MUST stay clear of data and within internal RAM.",
    FAULTS,
    faults=STACK_FAULTS,
    presupposes=("P52",),
    broken="the stack runs into data, or leaves internal RAM",
)
def stack(talk: Talk) -> None:
    load(talk)


@CHAPTER.rule(
    "P54",
    "The processor MUST execute defined instructions of its own image alone.",
    FAULTS,
    faults=(FaultKind.UNDEFINED_OPCODE, FaultKind.OUTSIDE_IMAGE),
    presupposes=("P52",),
    broken="it executes what is no code of its own",
)
def own_code(talk: Talk) -> None:
    load(talk)


@CHAPTER.rule(
    "P55",
    f"A reset of the processor MUST do no harm, whenever it comes: {BOOTED_MS:g} ms after it both motors are off, and"
    " the first frame is taken as after power-on.",
    POWER_ON,
    presupposes=("P01", "P41"),
    broken="a reset of the processor does harm",
)
def reset_pin(talk: Talk) -> None:
    slot = talk.air.slots[0]
    for when, for_ms in (("in motion", 3.0), ("within a frame", 0.05), ("while it answers", 7.0)):
        talk.obeyed(talk.team(step=1))
        if when == "within a frame":
            begun = talk.now
            talk.team()
            end = talk.reset(begun + 15 * talk.character_ticks, for_ms)
        else:
            question = talk.ask(slot)
            end = talk.reset(question.end_tick + ms(9.0 if when == "while it answers" else 40.0), for_ms)
        talk.wait_until(end + ms(BOOTED_MS))
        talk.wait(45.0)
        keeps_off(talk, end, talk.now)
        talk.seq += 30  # any number is fresh again
        talk.obeyed(talk.team(what=f"team frame after a reset {when}"))
        talk.answered(talk.ask(slot, gap_ms=36.0), slot)


@CHAPTER.rule(
    "P56",
    "A robot that is switched off and on MUST begin as from power-on, wherever it was.",
    POWER_ON,
    presupposes=("P55",),
)
def supply(talk: Talk) -> None:
    slot = talk.air.slots[0]
    for off_ms in (2.0, 60.0):
        talk.obeyed(talk.team())
        question = talk.ask(slot)
        end = talk.switch_off(question.end_tick + ms(9.0), off_ms)
        talk.wait_until(end + ms(BOOTED_MS))
        talk.wait(45.0)
        keeps_off(talk, end, talk.now)
        talk.seq += 20
        talk.obeyed(talk.team(what="team frame after the supply was off"))
        talk.answered(talk.ask(slot, gap_ms=36.0), slot)


def load(talk: Talk) -> None:
    """Everything at once: questions without a pause, settings, garbage full of syncs; then a frame that is obeyed."""
    slot = talk.air.slots[0]
    for count in range(3):
        for _ in range(4):
            talk.team(ask=True, lead=b"", gap_ms=0.0)
        talk.service(slot, Opcode.FILTER, bytes((0x90, 1, 40, 0, 0xB8, 11, 0xD0, 7)), gap_ms=0.0)
        talk.service(slot, Opcode.ACCELERATION, (5973 + count).to_bytes(4, "little"), gap_ms=0.0)
        talk.characters(SYNC * 25)
        talk.characters(bytes(range(1, 250, 7)))
        talk.obeyed(talk.ask(slot, lead=b"", what="question under load"))
    talk.wait(540.0)
    talk.obeyed(talk.team(what="team frame after the load"))
