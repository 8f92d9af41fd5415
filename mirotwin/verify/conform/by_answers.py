"""The rules that answers can show, tried on a robot at a port: what a PC can send and hear, and nothing else.

A rule is seen in what the robot answers (`ANSWERS`), or in how many frames it has accepted by the end of the trial
(`COUNTED`). What a PC cannot send is left out of a trial, where that changes nothing else: bad stop bits, and pauses
within a frame that are shorter than it can time. Where answers of a robot that breaks the rule may be the same, only a
failure is a verdict (`ONLY_FAILURES`). A trial that fails although characters came in time is a failure;
where they did not, it is tried again, and in the end not judged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Literal, Unpack, get_args

import msgspec

from miro_exact.bad_input import BadInput
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.table import ROBOT_COUNTS, TICKS_PER_MS
from miro_protocol.transmission import Transmission, joined
from mirotwin.desk.guard import MotionLimits
from mirotwin.desk.port_world import PortWorld
from mirotwin.desk.robot_port import RobotPort
from mirotwin.desk.session import Greeting, greet, play
from mirotwin.verify.conform.observed import Observed
from mirotwin.verify.conform.rule import Rule, Topology
from mirotwin.verify.conform.trial import make_trial
from mirotwin.verify.conform.trial_script import Expectation, Frame, How, Pairs, TrialScript

ANSWERS = ("P41", "P43", "P44", "P45", "P48", "P49", "P50", "P61")
COUNTED = ("P04", "P05", "P06", "P07", "P08", "P10", "P13", "P14", "P16", "P17", "P20", "P21", "P34")
_REASONS: dict[str, tuple[str, ...]] = {
    "it is switched off and on, or reset": ("P01", "P02", "P03", "P19", "P55", "P56"),
    "no serial port sends a bad stop bit": ("P09",),
    "a PC cannot time what decides": ("P11", "P18", "P42"),
    "its trial tells wheels to go at full speed": ("P12",),
    "it is the radio's noise": ("P15",),
    "answers do not tell what wheels are told": (
        *("P22", "P23", "P24", "P25", "P26", "P27", "P28", "P29", "P30", "P31", "P32", "P33"),
        *("P35", "P36", "P37", "P38", "P39", "P40", "P62"),
    ),
    "answers are all that is known of the chips": ("P46", "P47"),
    "it is inside the robot": ("P51", "P52", "P53", "P54"),
    "only a twin has such LM629s, or such pins": ("P57", "P58", "P59", "P60"),
}
NOT_OBSERVABLE = {id: why for why, ids in _REASONS.items() for id in ids}
"""Why a rule cannot be seen at a port."""
ONLY_FAILURES = {
    "P10": "a keyed radio fills pauses with noise, which spoils the frame for every robot",
    "P34": "answers tell that a service frame is fresh, and not what wheels are told",
}
"""Why a robot that does not fail a rule is not judged: one that breaks it may answer the same."""
LEFT_OUT = {
    "bad stop bits": ("P04", "P13", "P43", "P49"),
    "pauses within a frame of less than 5 ms": ("P04", "P10", "P13", "P49"),
    "the flags of power-on": ("P45",),
}
"""What of the trials of rules that can be seen no PC can do."""
SHORTEST_US = 5000.0
"""A pause that a PC can make within a frame."""
SURE_TICKS = 5 * TICKS_PER_MS
"""Characters that come and go so much later than others still say what a trial wants to know. Chosen: half of what a
robot has to act in, a quarter of the shortest margin of the silences."""
TRIES = 4

PortVerdict = Literal["passed", "failed", "not judged", "not observable"]
PORT_VERDICTS: tuple[PortVerdict, ...] = get_args(PortVerdict)


class PortOutcome(msgspec.Struct, frozen=True):
    """The result of a rule at a port: what was wanted and found, or why it is not judged."""

    rule: str
    verdict: PortVerdict
    text: str = ""


class PortScript(TrialScript):
    """A trial as a PC can send it. `standing`: all velocities are 0. `fresh`: frames that a robot has to accept."""

    def __init__(self, topology: Topology, standing: bool) -> None:
        super().__init__(topology)
        self.standing = standing
        self.fresh = 0
        self._seen_by_answers: list[Expectation] = []

    def words(self) -> Pairs:
        return ((0, 0),) * self.n if self.standing else super().words()

    def same(self, slot: int, left: int, right: int) -> Pairs:
        return self.words() if self.standing else super().same(slot, left, right)

    def say(
        self,
        kind: int,
        payload: bytes,
        step: int = 1,
        what: str = "frame",
        words: Pairs = (),
        **how: Unpack[How],
    ) -> Frame:
        """The same, where a PC can send it; else nothing, for as long."""
        before = len(self.said)
        frame = super().say(kind, payload, step, what, words, **how)
        pauses = how.get("pauses", {}).values()
        if "bad_stop" in how or any(pause < SHORTEST_US for pause in pauses):
            del self.said[before:]
        elif how.get("fresh", True):
            self.fresh += 1
        elif step == 1:
            self.seq = frame.seq  # else a robot that takes it would not take the next one, and count right
        return frame

    def answered(self, question: Frame, slot: int, *more: Any, **named: Any) -> None:
        before = len(self.expected)
        super().answered(question, slot, *more, **named)
        self._seen_by_answers += self.expected[before:]

    def silent(self, after_tick: int, until_tick: int, why: str) -> None:
        before = len(self.expected)
        super().silent(after_tick, until_tick, why)
        self._seen_by_answers += self.expected[before:]

    def first_seq(self) -> int:
        """The number of the first frame."""
        decoder = Decoder(self.n)
        events = (event for one in self.said for event in decoder.feed(one.data))
        return next(event.seq for event in events if isinstance(event, Received))

    def judged(self) -> list[Expectation]:
        """What answers show of the trial; the robot was switched on before."""
        return [one for one in self._seen_by_answers if "of power-on" not in one.wanted]


def find_robot(port: RobotPort) -> tuple[Greeting, Topology]:
    """The robot at the port: that in the lowest slot of a network of three, or of five. Raises BadInput."""
    for robots in ROBOT_COUNTS:
        try:
            greeting = greet(port, robots)
        except BadInput:
            if robots == ROBOT_COUNTS[-1]:
                raise
            continue
        return greeting, Topology(robots, greeting.slots[:1])
    raise AssertionError


def try_at_port(rules: Sequence[Rule], url: str, limits: MotionLimits) -> Iterator[PortOutcome]:
    """Each as soon as it is known. Raises BadInput where no robot answers, PortError."""
    with RobotPort(url, limits, url) as port:
        _, topology = find_robot(port)
        for rule in rules:
            if rule.id in NOT_OBSERVABLE:
                yield PortOutcome(rule.id, "not observable", NOT_OBSERVABLE[rule.id])
            else:
                yield _try_often(rule, port, topology)


def _try_often(rule: Rule, port: RobotPort, topology: Topology) -> PortOutcome:
    unsure = 0
    for _ in range(TRIES):
        try:
            found, unsure = _try(rule, port, topology)
        except BadInput as error:
            if not error.remedy or "--" not in error.remedy:
                raise
            return PortOutcome(rule.id, "not judged", f"{error.what}; {error.remedy}")
        if not found and rule.id in ONLY_FAILURES:
            return PortOutcome(rule.id, "not judged", f"it does not fail, but {ONLY_FAILURES[rule.id]}")
        if not found:
            return PortOutcome(rule.id, "passed")
        if unsure <= SURE_TICKS:
            return PortOutcome(rule.id, "failed", found)
    late = f"characters come and go up to {unsure / TICKS_PER_MS:.1f} ms late"
    return PortOutcome(
        rule.id, "not judged", f"{late}, {SURE_TICKS / TICKS_PER_MS:g} ms are allowed; {found}"
    )


def _try(rule: Rule, port: RobotPort, topology: Topology) -> tuple[str, int]:
    """What is wrong, or "", and how well the times of the trial are known."""
    script = PortScript(topology, standing=not port.guard.limits.motion)
    rule.write(script)
    counted = rule.id in COUNTED
    last = script.ask(topology.slots[0], gap_ms=36.0)
    trial = make_trial(msgspec.structs.replace(rule, topologies=(topology,)))
    world = PortWorld(port, trial.scenario, script.first_seq())
    first = len(port.late_ticks)
    seen = Observed(topology.robots, topology.slots[0])
    cursor = world.networks[0].log.end

    def gather(one: Transmission | None = None) -> None:
        nonlocal cursor
        log = world.networks[0].log
        for _, event in log.since(cursor):
            if event.what != "sent":
                seen.take(event)
        cursor = log.end

    play(port, _whole(script.said), world.began_tick, gather)
    gather()
    seen.end_tick = world.tick
    delays = [answer.tick - last.tick for answer in seen.answers if answer.frame.seq == last.seq][-1:]
    shortest, longest = world.greeting.delay_ticks
    unsure = max([*port.late_ticks[first:], longest - shortest, *(delay - shortest for delay in delays)])
    slot = topology.slots[0]
    for expectation in script.judged():
        if not expectation.slots or slot in expectation.slots:
            what = expectation.test(seen)
            if what is not None:
                return f"wanted {expectation.wanted}, found {what[1]}", unsure
    if counted:
        wanted = script.fresh % 256
        said = [
            answer.said for answer in seen.answers if answer.said is not None and answer.frame.seq == last.seq
        ]
        found = said[-1].accepted if said else None
        if found != wanted:
            shown = "no answer" if found is None else f"{found}"
            return f"wanted {wanted} frames accepted by {last.what}, found {shown}", unsure
    return "", unsure


def _whole(said: Sequence[Transmission]) -> list[Transmission]:
    """Transmissions that follow each other without a pause as one: a PC sends them in one piece."""
    found: list[Transmission] = []
    for one in sorted(said, key=lambda one: one.tick):
        both = joined(found[-1], one) if found and found[-1].end_tick == one.tick else None
        if both is not None:
            found[-1] = both
        else:
            found.append(one)
    return found
