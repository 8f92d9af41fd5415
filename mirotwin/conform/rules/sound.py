"""Rules about the processor and its chips under load (bus, main loop, stack, the reset pin in the middle of it), and
about a robot that runs for long.
"""

from __future__ import annotations

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.actions import Power, Reset
from miro_protocol.table import SYNC
from miro_robot.faults import STACK_FAULTS, FaultKind
from miro_robot.lm629.signals import COMMAND_ERROR
from mirotwin.conform.observed import Observed
from mirotwin.conform.rule import FAULTS, FRESHNESS, POWER_ON, THREE, TURNS, Chapter
from mirotwin.conform.rules.boot import keeps_off
from mirotwin.conform.trial_script import BOOTED_MS, Found, TrialScript, ms

CHAPTER = Chapter("Soundness")
LONG = Chapter("Long trials")
"""Trials of a minute or more of virtual time: `mirotwin conform --long`."""
_FRAMES = 2000
_EACH = 100
_OFF_MS = 520.0
_WRAPS_MS = (2560.0, (1 << 23) / 1000, 8542.5, (1 << 24) / 1000, 32768.0, (1 << 25) / 1000, 65536.0)
"""Wrap times of counters: 8 bits of 10 ms or of camera frames, 23 to 25 bits of microseconds, 15 or 16 bits of ms."""


def nothing_refused(script: TrialScript) -> None:
    """Expects that no LM629 refused a command up to now."""
    end = script.now

    @script.expects(end, "no command that an LM629 refuses")
    def refused(observed: Observed) -> Found:
        for tick, side, chip in observed.chips(0, end):
            if chip.status & COMMAND_ERROR:
                yield tick, f"command error of the {side} one"


@CHAPTER.rule(
    "P51",
    FAULTS,
    presupposes="P52",
    faults=(FaultKind.BUS_CONTENTION, FaultKind.LM629_BUSY, FaultKind.LM629_TIMING),
    broken="LM629s are not used as their data sheet says",
)
def lm629(script: TrialScript) -> None:
    """The LM629s MUST be used as their data sheet says: bus timing, never written while busy, one at a time on the bus,
    and no command that they refuse.
    """
    load(script)
    nothing_refused(script)


@CHAPTER.rule(
    "P52",
    FAULTS,
    presupposes="P13 P16 P36",
    faults=(FaultKind.MAIN_LOOP_STARVED, FaultKind.INTERRUPT_NOT_LEFT),
    broken="interrupts leave the main loop no time or end in RET, or frames are lost under load",
)
def main_loop(script: TrialScript) -> None:
    """Interrupts MUST leave the main loop time: never all of 10 ms, whatever comes over the air. Their routines MUST
    end with RETI.
    """
    load(script)


@CHAPTER.rule(
    "P53",
    FAULTS,
    presupposes="P52",
    faults=STACK_FAULTS,
    broken="the stack runs into data, or leaves internal RAM",
)
def stack(script: TrialScript) -> None:
    """The stack MUST stay clear of data and within internal RAM."""
    load(script)


@CHAPTER.rule(
    "P54",
    FAULTS,
    presupposes="P52",
    faults=(FaultKind.UNDEFINED_OPCODE, FaultKind.OUTSIDE_IMAGE),
    broken="it executes what is no code of its own",
)
def own_code(script: TrialScript) -> None:
    """The processor MUST execute defined instructions of its own image alone."""
    load(script)


@CHAPTER.rule("P55", POWER_ON, presupposes="P01 P41", broken="a reset of the processor does harm")
def reset_pin(script: TrialScript) -> None:
    """A reset of the processor MUST do no harm, whenever it comes: 40 ms after it both motors are off, and the first
    frame is taken as after power-on.
    """
    for when, for_ms in (("in motion", 3.0), ("within a frame", 0.05), ("while it answers", 7.0)):
        script.obeyed(script.team())
        if when == "within a frame":
            tick = script.team().tick + 15 * script.character_ticks
        else:
            tick = script.ask().end_tick + ms(9.0 if when == "while it answers" else 40.0)
        _begins_again(script, script.hold(Reset, tick, for_ms), 30, f"team frame after a reset {when}")


@CHAPTER.rule("P56", POWER_ON, presupposes="P55")
def supply(script: TrialScript) -> None:
    """A robot that is switched off and on MUST begin as from power-on, wherever it was."""
    for off_ms in (2.0, 60.0):
        script.obeyed(script.team())
        end = script.hold(Power, script.ask().end_tick + ms(9.0), off_ms)
        _begins_again(script, end, 20, "team frame after the supply was off")


def _begins_again(script: TrialScript, tick: int, step: int, name: str) -> None:
    """Expects the state after power-on, from `tick` on: motors off, and a frame is fresh however many steps on."""
    script.wait_until(tick + ms(BOOTED_MS))
    script.wait(45.0)
    keeps_off(script, tick, script.now)
    script.obeyed(script.team(step=step + 1, label=name))
    script.answered(script.ask(gap_ms=36.0))


def load(script: TrialScript) -> None:
    """Everything at once: questions without a pause, settings, garbage full of syncs; then a frame that is obeyed."""
    for count in range(3):
        for _ in range(4):
            script.team(ask=True, lead=b"", gap_ms=0.0)
        script.filter((400, 40, 3000, 2000), gap_ms=0.0)
        script.acceleration(5973 + count, gap_ms=0.0)
        script.characters(SYNC * 25)
        script.characters(bytes(range(1, 250, 7)))
        script.obeyed(script.ask(lead=b"", label="question under load"))
    script.wait(540.0)
    script.obeyed(script.team(label="team frame after the load"))


@LONG.rule("P61", TURNS, presupposes="P34 P41", topologies=THREE)
def many(script: TrialScript) -> None:
    """However many frames came, the next one MUST be obeyed and the next question answered."""
    for number in range(1, _FRAMES + 1):
        begun = script.now
        frame = script.ask(gap_ms=0.0) if number % 3 == 0 else script.team(gap_ms=0.0)
        if number % _EACH < 3 or number > _FRAMES - 6:
            script.obeyed(frame)
            if number % 3 == 0:
                script.answered(frame)
        script.wait_until(begun + CONTROL_PERIOD_TICKS)
    script.wait(40.0)


@LONG.rule("P62", FRESHNESS, presupposes="P20 P32", topologies=THREE)
def ages(script: TrialScript) -> None:
    """After any silence motors MUST stay off, the last frame again MUST NOT be fresh, and one with another seq MUST
    be.
    """
    for silence_ms in _WRAPS_MS:
        last = script.team()
        until = last.end_tick + ms(silence_ms + 40.0)
        script.unchanged(
            last.end_tick + ms(_OFF_MS), until, f"motors off {silence_ms / 1000:.1f} s after the last frame"
        )
        script.wait_until(until)
        script.ignored(script.team(step=0, fresh=False))
        script.wait(20.0)
        script.obeyed(script.team(step=20, label=f"team frame 20 steps on after {silence_ms / 1000:.1f} s"))
