"""The timeline of a rule's trial: frames sent and received, commands, answers, and expectations with their ticks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

from miro_exact.bad_input import amount
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.frames import ContentError, TeamFrame, describe
from miro_protocol.table import TICKS_PER_MS
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.image import Image
from miro_robot.lm629.commands import BY_NAME
from miro_sim.world.events import Event
from mirotwin.conform.hints import between, in_a_row, in_words, number
from mirotwin.conform.observed import Observed, within
from mirotwin.conform.probe import listen
from mirotwin.conform.rule import Rule
from mirotwin.conform.trial import trial_of
from mirotwin.conform.trial_script import TrialExpectation
from mirotwin.verify.checks.orders import Orders

Row = tuple[int, str, str]
"""Tick, label, and details."""
_STT = BY_NAME["STT"].opcode


def explain(rule: Rule, image: Image, seed: int = 0) -> tuple[list[str], int, int]:
    """Runs the trial and lists its events, robot by robot.

    With the lines, how many of the rule's expectations failed, and how many faults the firmware had.
    """
    trial = trial_of(rule)
    lines = [f"{rule.id} {rule.name}: {rule.text}", f"({rule.source})"]
    failed = faults = 0
    for listener in listen(trial, image, seed):
        subject = listener.subject
        verdicts = [_verdict(expected, listener.observed) for expected in trial.expected_of(subject)]
        bad = len([row for row in verdicts if row[1] == "FAILED"])
        board = subject.robot.board
        fault_rows = [(fault.tick, "fault", str(fault)) for fault in board.faults]
        failed, faults = failed + bad, faults + board.fault_count
        summary = amount(len(verdicts), "expectation") + (f", {bad} failed" if bad else " passed")
        lines += ["", f"net{subject.network}/robot{subject.slot} (N = {subject.robots}): {summary}"]
        rows = sorted([*_rows(listener.observed), *fault_rows, *verdicts], key=lambda row: row[0])
        lines += map(_line, _collapsed(rows))
    return lines, failed, faults


def _line(row: Row) -> str:
    tick, kind, text = row
    return f"{tick:>10} {tick / TICKS_PER_MS:>10.3f} ms  {kind:<9} {text}"


def _collapsed(rows: list[Row]) -> Iterator[Row]:
    """Joins equal rows that follow each other into one row with their number."""
    for (kind, text), group in groupby(rows, key=lambda row: row[1:]):
        same = list(group)
        more = f" ({len(same)} times, until tick {same[-1][0]})" if len(same) > 1 else ""
        yield same[0][0], kind, text + more


def _verdict(expected: TrialExpectation, observed: Observed) -> Row:
    """The row of an expectation: at the tick of its failure, or, if it was fulfilled, at its end."""
    failure = expected.found(observed)
    if failure is None:
        return expected.tick, "passed", expected.wanted
    return failure[0], "FAILED", f"wanted {expected.wanted}, found {failure[1]}"


def _rows(observed: Observed) -> Iterator[Row]:
    orders, decoder = Orders(), Decoder(observed.robots)
    for event in observed.events:
        if event.what == "sent":
            yield event.tick, "sent", _sent(event, decoder, observed)
        elif event.what == "frame" and event.frame is not None:
            fresh = "fresh" if event.value else "not fresh"
            yield event.tick, "received", f"{_frame(event.frame, observed)}, {fresh}"
        elif event.what == "command":
            yield event.tick, "commanded", _command(event, orders)
        elif event.what in ("reset", "power"):
            yield event.tick, event.what, f"{event.value}"
    for kind, label in (("received", "received"), ("heard", "answered")):
        left: Sequence[Event] = [event for event in observed.events if event.what == kind]
        while left:
            run = in_a_row(left)
            left = left[len(run) :]
            yield run[-1].tick, label, _characters(run) + (_answer(run, observed) if kind == "heard" else "")


def _sent(event: Event, decoder: Decoder, observed: Observed) -> str:
    receptions = decoder.hear(Transmission(event.tick, DOWN, event.data, event.network))
    frames = [_frame(reception, observed) for reception in receptions if isinstance(reception, Received)]
    return ": ".join(filter(None, [event.data.hex(" "), "; ".join(frames)]))


def _frame(frame: Received, observed: Observed) -> str:
    try:
        message = frame.message(observed.robots)
    except ContentError as error:
        return f"frame of type {frame.type}, seq {frame.seq}, unknown content: {error}"
    if not isinstance(message, TeamFrame):
        return describe(message)
    left, right = message.velocities[observed.slot]
    return f"{describe(message)}, this robot {number(left)}, {number(right)}"


def _command(event: Event, orders: Orders) -> str:
    order = orders.take(event)
    text = str(event).partition(" command ")[2]
    return f"{text}: {in_words(order)}" if order is not None and event.opcode == _STT else text


def _characters(run: Sequence[Event]) -> str:
    shown = " ".join(f"{character.value:02x}" + ("" if character.good_stop else "!") for character in run)
    return f"{amount(len(run), 'character')}, {between(run[0].tick, run[-1].tick)}: {shown}"


def _answer(run: Sequence[Event], observed: Observed) -> str:
    """The content of the characters, if they are an answer."""
    for answer in within(observed.answers, run[0].tick, run[-1].tick):
        content = answer.content
        if content is None:
            return ": an answer with unknown contents"
        return (
            f": {describe(content)} status={content.status_left:02X}h,{content.status_right:02X}h"
            f" position={number(content.position_left)}, {number(content.position_right)}"
        )
    return ": no answer"
