"""Rules about the wheels' reaction to a team frame."""

from __future__ import annotations

from typing import Unpack

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.table import VELOCITY_SATURATION
from miro_robot.lm629.chip import SAMPLE_TICKS
from miro_robot.lm629.commands import BY_NAME
from mirotwin.conform.observed import Observed
from mirotwin.conform.probe import why_deaf
from mirotwin.conform.rule import FIRMWARE, FRAME, TURNS, Chapter, Topology
from mirotwin.conform.trial_script import Found, Frame, How, TrialScript, ms

CHAPTER = Chapter("Velocities")
_LTRJ = BY_NAME["LTRJ"].opcode
_ACCELERATION = 0x20
"""Bit of LTRJ's control word: an acceleration follows."""
_ANY_BOOT_MS = 260.0
"""More than that of P03, which presupposes P24."""


@CHAPTER.rule("P22", FRAME, presupposes="P19", topologies=(Topology(3, (0, 1, 2)),))
def own_slot_of_three(script: TrialScript) -> None:
    """In a network of 3, each robot MUST take the velocities of its own slot."""
    for _ in range(4):
        script.obeyed(script.team())


@CHAPTER.rule("P23", FRAME, presupposes="P19", topologies=(Topology(5, (0, 1, 2, 3, 4)),))
def own_slot_of_five(script: TrialScript) -> None:
    """In a network of 5, each robot MUST take the velocities of its own slot."""
    for _ in range(4):
        script.obeyed(script.team())


@CHAPTER.rule("P24", FRAME, broken="a plain team frame is not obeyed", probe=why_deaf)
def both_types(script: TrialScript) -> None:
    """On a fresh frame of type 0 or 3 both LM629 MUST be told the velocities within 10 ms of its end."""
    script.wait(_ANY_BOOT_MS)
    after = ""
    for ask in (False, True, True, False):
        name = "question" if ask else "team frame"
        script.obeyed(script.team(ask=ask, label=name + after))
        after = f" after a {name}"


@CHAPTER.rule("P25", FRAME, presupposes="P19")
def words(script: TrialScript) -> None:
    """Velocities MUST be taken as they are: 16 bits, low byte first, two's complement, left before right, 1/256 count
    per sample, none rounded.
    """
    pairs = [
        (1, -1), (-1, 1), (2, 255), (-255, -256), (256, 257), (-257, 127), (128, -128),
        (0x1234, -0x1234),
    ]  # fmt: skip
    pairs += [(0x55AA >> 2, -0x2AD5), (0, 300), (-300, 0), (4097, 16), (-16633, 16632)]
    for left, right in pairs:
        _drive(script, left, right)


@CHAPTER.rule("P26", FRAME, presupposes="P19")
def saturation(script: TrialScript) -> None:
    """Velocities beyond +-16633 MUST be cut off there, and those within MUST not."""
    limit = VELOCITY_SATURATION
    for left, right in (
        (limit, -limit),
        (limit + 1, -limit - 1),
        (-limit - 1, limit + 1),
        (32767, -32767),
        (-32767, 32767),
        (limit - 1, 1 - limit),
        (20000, 100),
        (-100, -20000),
    ):
        _drive(script, left, right)


def _drive(script: TrialScript, left: int, right: int, **how: Unpack[How]) -> Frame:
    """Sends a frame with these velocities, and expects that the wheels obey it."""
    return script.obeyed(
        script.team(script.same(left, right), label=f"team frame with {left}, {right}", **how)
    )


@CHAPTER.rule("P27", FIRMWARE, presupposes="P32")
def one_sample(script: TrialScript) -> None:
    """Both wheels MUST get their velocities in one LM629 sample, and likewise stop and go off."""
    frames = [script.team(gap_ms=12.0 + 0.11 * count) for count in range(12)]
    script.wait(620.0)
    for frame in frames:
        script.obeyed(frame)
        _together(script, frame.tick, frame.acted_tick, frame.what)
    end = frames[-1].end_tick
    _together(script, end + ms(50.0), end + ms(120.0), "the failsafe's stop")
    _together(script, end + ms(450.0), end + ms(510.0), "motors off")


def _together(script: TrialScript, after_tick: int, until_tick: int, name: str) -> None:
    @script.expects(until_tick, f"{name}: STT of both wheels in one sample")
    def test(observed: Observed) -> Found:
        left, right = observed.both_orders(until_tick)
        if min(left.tick, right.tick) <= after_tick:
            yield until_tick, "a wheel without an order"
        grid = observed.samples[-1][1]
        if (left.tick - grid) // SAMPLE_TICKS != (right.tick - grid) // SAMPLE_TICKS:
            yield max(left.tick, right.tick), f"{abs(left.tick - right.tick)} ticks from one to the other"


@CHAPTER.rule("P28", TURNS, presupposes="P19", broken="velocities are not kept between frames")
def kept(script: TrialScript) -> None:
    """Between frames the wheels MUST keep their velocities."""
    for sign in (1, -1, 1):
        frame = _drive(script, 300 * sign, -311 * sign, gap_ms=65.0)
        script.unchanged(frame.acted_tick, script.now, f"velocities kept after {frame.what}")
        _reached(script, frame)


def _why_not_reached(observed: Observed, tick: int) -> str:
    orders = observed.both_orders(tick)
    if not all(order.moves for order in orders):
        return ""
    if not all(order.acceleration for order in orders):
        return ": an acceleration of 0 is loaded"
    begun = next(order.tick for order in observed.ordered(0, tick) if order.moves)
    for command in observed.wrote(begun, tick):
        if command.opcode == _LTRJ and command.data[1] & _ACCELERATION:
            loaded = f"{command.side} LTRJ {command.data.hex(' ')}"
            return f": at tick {command.tick} an acceleration was loaded in motion, {loaded}"
    return ""


def _reached(script: TrialScript, frame: Frame) -> None:
    """Both chips run at the frame's velocities 20 ms after it."""
    after_tick, until_tick = frame.end_tick + ms(20.0), script.now
    assert until_tick - after_tick > CONTROL_PERIOD_TICKS

    @script.expects(until_tick, f"both LM629 at the velocities of {frame.what}")
    def test(observed: Observed) -> Found:
        wanted = frame.for_robot(observed.slot)
        for tick, record in observed.periods:
            velocities = (record.left.desired_velocity / 256, record.right.desired_velocity / 256)
            if after_tick <= tick <= until_tick and velocities != wanted:
                yield tick, f"{velocities[0]:g}, {velocities[1]:g}{_why_not_reached(observed, tick)}"
