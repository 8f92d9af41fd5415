"""Tries rules on a robot at a port, where only sent and received characters can be observed.

A rule is judged by the robot's answers and by its count of accepted frames at the end of the trial. Parts of a trial
that a PC cannot send (bad stop bits, pauses within a frame shorter than it can time) are left out if nothing else
depends on them. A failed trial is repeated, because noise may have spoilt it. A rule fails if every trial failed and
the characters of at least one came in time; if they never did, the rule is not judged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Unpack

import msgspec

from miro_exact.bad_input import BadInput, amount
from miro_protocol.events import Received
from miro_protocol.table import ROBOT_COUNTS, TICKS_PER_MS
from miro_protocol.transmission import Transmission, joined
from miro_sim.world.conditions import answer_of
from miro_sim.world.events import Cursor
from mirotwin.conform.observed import Observed
from mirotwin.conform.rule import Rule, Topology
from mirotwin.conform.run import Outcome, in_order
from mirotwin.conform.trial import trial_of
from mirotwin.conform.trial_script import Found, Frame, How, Pairs, TrialScript
from mirotwin.desk.guard import DeskOptions
from mirotwin.desk.robot_port import Note, RobotPort
from mirotwin.verify.checks.interface import Failure

_REASONS = {
    "it is switched off and on, or reset": "P01 P02 P03 P19 P55 P56",
    "no serial port sends a bad stop bit": "P09",
    "a PC cannot time what decides": "P10 P11 P18 P42",
    "its trial tells wheels to go at full speed": "P12",
    "its trial takes the gains away": "P63 P64",
    "it is the radio's noise": "P15",
    "answers do not tell what wheels are told": (
        "P22 P23 P24 P25 P26 P27 P28 P29 P30 P31 P32 P33 P34 P35 P36 P37 P38 P39 P40 P62"
    ),
    "answers are all that is known of the chips": "P46 P47",
    "it is inside the robot": "P51 P52 P53 P54",
    "only a twin has such LM629s, or such pins": "P57 P58 P59 P60",
}
NOT_OBSERVABLE = {id: why for why, ids in _REASONS.items() for id in ids.split()}
"""Why a rule cannot be observed at a port."""
SHORTEST_US = 5000.0
"""A pause that a PC can make within a frame."""
SURE_TICKS = 5 * TICKS_PER_MS
"""Timing uncertainty up to which the failure of a trial counts.

Chosen: half of the time in which a robot must act, a quarter of the shortest margin of the silences.
"""
ANSWERED_TICKS = 24 * TICKS_PER_MS
"""From the end of a question to the end of its answer, with key-up, by the shipped firmware.

The extra time of the quickest answer is the delay of the path: USB adapters hold characters back.
"""
TRIES = 4
NOISY = {"P49": 16}
"""More tries: noise between the frames of a keyed radio makes robots count windows in which no frame was sent."""


class PortScript(TrialScript):
    """A trial as a PC can send it. `standing`: all velocities are 0. `fresh`: frames that a robot has to accept."""

    def __init__(self, topology: Topology, standing: bool) -> None:
        super().__init__(topology)
        self.standing = standing
        self.fresh = 0

    def words(self) -> Pairs:
        return ((0, 0),) * self.n if self.standing else super().words()

    def same(self, left: int, right: int) -> Pairs:
        return self.words() if self.standing else super().same(left, right)

    def say(self, kind: int, payload: bytes, label: str, words: Pairs = (), **how: Unpack[How]) -> Frame:
        """Sends a frame that a PC can send; lets the frame's time pass without it otherwise."""
        before = len(self.sent)
        frame = super().say(kind, payload, label, words, **how)
        if "bad_stop" in how or any(pause < SHORTEST_US for pause in how.get("pauses", {}).values()):
            del self.sent[before:]
        elif how.get("fresh", True):
            self.fresh += 1
        elif how.get("step", 1) == 1:
            self.seq = frame.seq  # else a robot that takes it would not take the next one, and count right
        return frame


def try_at_port(
    rules: Sequence[Rule], desk: DeskOptions, note: Note, everything: bool = False
) -> Iterator[Outcome]:
    """Yields each outcome when it is known. `note` gets notes; `everything`: as of `in_order`.

    Raises BadInput if no robot answers, PortError.
    """
    with RobotPort(desk, trial_of(rules[0]).scenario, note=note) as port:
        topology = Topology(port.greet(ROBOT_COUNTS), port.slots[:1])
        if len(port.slots) > 1:
            who = " and ".join(map(str, port.slots))
            note(f"{desk.port}: robots {who} answer; robot {port.slots[0]} is tried")

        def tried(rule: Rule) -> Outcome:
            if rule.id in NOT_OBSERVABLE:
                return Outcome(rule.id, (), unseen=NOT_OBSERVABLE[rule.id])
            return _try_often(rule, port, topology)

        yield from in_order(rules, tried, everything)


def _try_often(rule: Rule, port: RobotPort, topology: Topology) -> Outcome:
    """Tries a rule several times: noise or late characters may spoil a trial, but a robot that breaks the rule fails
    each.
    """
    sure: tuple[Failure, ...] = ()
    for _ in range(NOISY.get(rule.id, TRIES)):
        try:
            failure, unsure_ticks = _try(rule, port, topology)
        except BadInput as error:
            if sure:
                break  # the trial has silenced the robot
            if "--" not in error.remedy:
                raise
            return Outcome(rule.id, (), unsure=f"{error.what}; {error.remedy}")
        if failure is None:
            return Outcome(rule.id, ())
        if unsure_ticks <= SURE_TICKS:
            sure = (failure,)
    late = f"characters come and go up to {unsure_ticks / TICKS_PER_MS:.1f} ms late"
    allowed = f"{SURE_TICKS / TICKS_PER_MS:g} ms are allowed"
    return Outcome(rule.id, sure, unsure="" if sure else f"{late}, {allowed}; {failure}")


def _try(rule: Rule, port: RobotPort, topology: Topology) -> tuple[Failure | None, int]:
    """The failure, if any, and the uncertainty of the trial's times in ticks."""
    slot = topology.slots[0]
    script = PortScript(topology, standing=not port.guard.desk.allow_motion)
    rule.write(script)
    last = script.ask(gap_ms=36.0)
    fresh = script.fresh % 256

    @script.expects(last.end_tick, f"{amount(fresh, 'frame')} accepted by {last.what}", by_answers=True)
    def counted(observed: Observed) -> Found:
        answers = [
            answer.content for answer in observed.answers if answer.frame.seq == last.seq and answer.content
        ]
        accepted = f"{answers[-1].accepted}" if answers else "no answer"
        if accepted != f"{fresh}":
            yield observed.end_tick, accepted

    sent = _whole(script.sent)
    port.greet((script.n,), sent)
    # from here on: delays of the greeting do not count
    cursor, begun = Cursor(port.log), len(port.late_ticks)
    observed = Observed(script.n, slot)

    # the quickest answer took the firmware's own time; what is over is the way there and back
    shortest = min(port.delays)
    way = max(0, shortest - (last.end_tick - last.tick) - ANSWERED_TICKS)

    def gather(tick: int) -> None:
        for _, event in cursor.read():
            if event.frame is not None and _in_turn_of_another(event.frame, topology, port.slots):
                observed.forget(event.frame.data)
            elif event.what != "sent":
                observed.take(msgspec.structs.replace(event, tick=event.tick - way))
        observed.end_tick = tick - way

    port.play(sent, gather)
    gather(port.tick)
    unsure = max(*port.late_ticks[begun:], max(port.delays) - shortest)

    for expectation in script.expected:  # the effects of power-on are reported by now
        if expectation.by_answers and slot in expectation.slots and "of power-on" not in expectation.wanted:
            if (failure := expectation.found(observed)) is not None:
                return Failure("conforms_to", 0, slot, failure[0], expectation.wanted, failure[1]), unsure
    return None, unsure


def _in_turn_of_another(frame: Received, topology: Topology, there: Sequence[int]) -> bool:
    """True if another robot at the port may send this."""
    answer = answer_of(frame)
    others = (slot for slot in there if slot not in topology.slots)
    return answer is not None and answer.slot in others and answer.slot == answer.seq % topology.robots


def _whole(transmissions: Sequence[Transmission]) -> list[Transmission]:
    """Transmissions that follow each other without a pause as one: a PC sends them in one piece."""
    pieces: list[Transmission] = []
    for transmission in sorted(transmissions, key=lambda transmission: transmission.tick):
        both = (
            joined(pieces[-1], transmission) if pieces and pieces[-1].end_tick == transmission.tick else None
        )
        pieces[-1 if both else len(pieces) :] = [both or transmission]
    return pieces
