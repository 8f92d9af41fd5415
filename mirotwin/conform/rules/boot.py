"""Rules about power-on (motors off, both chips reset together, ready in time) and the pins that name the robot."""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_robot.lm629.chip import SAMPLE_TICKS
from miro_robot.lm629.commands import BY_NAME
from miro_robot.lm629.signals import MOTOR_OFF
from miro_sim.world.events import SIDES
from mirotwin.conform.hints import in_words
from mirotwin.conform.observed import Observed
from mirotwin.conform.rule import POWER_ON, TURNS, Chapter, Topology
from mirotwin.conform.trial_script import BOOTED_MS, Found, TrialScript, ms

CHAPTER = Chapter("Power-on")
STRAPS = Chapter("Straps")
_RESET, _RSTI = BY_NAME["RESET"].opcode, BY_NAME["RSTI"].opcode


@CHAPTER.rule("P01", POWER_ON, presupposes="P24", broken="a motor is on before the first team frame")
def motors_off(script: TrialScript) -> None:
    """From power-on until the first fresh team frame both motors MUST be off, however long that takes."""
    script.wait(600.0)
    first = script.team()
    keeps_off(script, 0, first.tick)
    script.obeyed(first)


@CHAPTER.rule("P02", POWER_ON, presupposes="P03")
def reset_together(script: TrialScript) -> None:
    """Both LM629 MUST leave reset together, and RESET (00h) MUST never be sent to one alone: their samples coincide;
    RSTI 0000h follows, and both show 80h or C0h.
    """
    script.wait(60.0)
    first = script.obeyed(script.team())
    end, up = script.now, ms(BOOTED_MS)

    @script.expects(first.tick, f"status 80h or C0h {BOOTED_MS:g} ms after power-on")
    def shown(observed: Observed) -> Found:
        for tick, side, chip in observed.chips(up, first.tick):
            if chip.status not in (0x80, 0xC0):
                yield tick, f"{chip.status:02X}h of the {side} one"

    @script.expects(first.tick, "RSTI 0000h")
    def other_mask(observed: Observed) -> Found:
        for command in observed.commands:
            if command.tick <= first.tick and command.opcode == _RSTI and command.data != bytes(2):
                yield command.tick, f"RSTI {command.data.hex()} to the {command.side} one"

    @script.expects(end, "RESET sent to both LM629 or none")
    def alone(observed: Observed) -> Found:
        resets = [(command.tick, command.side) for command in observed.commands if command.opcode == _RESET]
        for tick, side in resets:
            if len([at for at, _ in resets if at == tick]) != len(SIDES):
                yield tick, f"RESET to the {side} one"

    @script.expects(end, f"both LM629 with the same samples {BOOTED_MS:g} ms after power-on")
    def apart(observed: Observed) -> Found:
        for tick, left, right in observed.samples:
            if tick > up and NEVER_TICK in (left, right):
                yield tick, "one in reset"
            if tick > up and (left - right) % SAMPLE_TICKS:
                yield tick, f"{(left - right) % SAMPLE_TICKS} ticks from one to the other"


@CHAPTER.rule("P03", POWER_ON, presupposes="P24", broken="it is not ready 40 ms after power-on")
def ready(script: TrialScript) -> None:
    """A robot MUST be ready 40 ms after power-on: it acts on a frame that begins then."""
    script.seq = 0  # P19 has other numbers
    script.obeyed(script.team())


def keeps_off(script: TrialScript, after_tick: int, until_tick: int) -> None:
    """Expects both motors off in between; the chips have `BOOTED_MS` for their reset."""

    @script.expects(until_tick, "both motors off")
    def ordered(observed: Observed) -> Found:
        for order in observed.ordered(after_tick, until_tick):
            if order.what != "off":
                yield order.tick, f"an order to the {order.side} wheel: {in_words(order)}"

    @script.expects(until_tick, "both motors off")
    def driven(observed: Observed) -> Found:
        for tick, side, chip in observed.chips(after_tick + ms(BOOTED_MS), until_tick):
            if chip.pwm_magnitude:
                yield tick, f"the {side} one driven"
            elif not chip.status & MOTOR_OFF:
                yield tick, f"status {chip.status:02X}h of the {side} LM629"


@STRAPS.rule(
    "P60",
    TURNS,
    presupposes="P41",
    topologies=(
        Topology(3, (1,)),
        Topology(3, (1,), strap=3),
        Topology(3, (1,), strap=4),
        Topology(3, (1,), strap=7),
        Topology(5, (3,), strap=5),
    ),
)
def no_slot(script: TrialScript) -> None:
    """A robot whose slot pins say N or more MUST never move and never answer."""
    for _ in range(2):
        for slot in range(script.n):
            script.team()
            question = script.ask(slot=slot, gap_ms=36.0)
            if script.topology.strap is None:  # a robot that is there, beside them
                script.obeyed(question)
    if script.topology.strap is None:
        return
    script.unchanged(0, script.now, "the wheels of no robot of this network told anything")
    script.silent(0, script.now, "no robot of this network is asked")
