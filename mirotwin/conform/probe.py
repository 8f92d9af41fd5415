"""Runs an extra trial to find out how a robot that obeys no plain team frame reacts instead."""

from __future__ import annotations

from collections.abc import Sequence

from miro_exact.bad_input import amount
from miro_protocol.frames import seal
from miro_protocol.table import TICKS_PER_MS
from miro_protocol.transmission import Transmission
from miro_robot.image import Image
from miro_robot.lm629.commands import BY_NAME, BY_OPCODE
from miro_sim.world.events import Event
from mirotwin.conform.hints import characters
from mirotwin.conform.observed import Observed
from mirotwin.conform.rule import BOTH, Rule, Topology
from mirotwin.conform.rule_monitor import ObservingMonitor
from mirotwin.conform.sealing import MISTAKES
from mirotwin.conform.trial import Trial, run_trial, trial_of
from mirotwin.conform.trial_script import Frame, TrialScript, obeys
from mirotwin.verify.checks.interface import Check, Monitor, Subject

Listener = ObservingMonitor[Check]


class Listening(Check, frozen=True, kw_only=True, tag="listening"):
    """A check without expectations; it only listens."""

    KIND = "safety"

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return ObservingMonitor(self, subject)


def listen(trial: Trial, image: Image, seed: int) -> list[Listener]:
    """Runs the trial to its end; returns a listener for each of its robots."""
    monitors = run_trial(trial, Listening(), image, seed).checks.monitors
    return [monitor for monitor in monitors if isinstance(monitor, ObservingMonitor)]


_SETTLING_MS = 200.0
_STT = BY_NAME["STT"].opcode
_UNHEARD = 4
"""Frames without any command to an LM629, after which a robot counts as hanging."""


def why_deaf(network: int, image: Image, seed: int) -> str:
    """The wrong reaction of the robot in this topology of `BOTH` to plain frames; "" if none is recognised."""
    topology = BOTH[network]
    tried: list[tuple[str, Frame]] = []

    def ways(script: TrialScript) -> None:
        script.wait(_SETTLING_MS)
        tried.append(("", script.team()))
        body = bytes(script.form.body_size)
        for mistake, sealing in MISTAKES.items():
            if sealing.seal(script.form, body) != seal(script.form, body):
                tried.append((f"frames with {mistake}", script.team(sealed=sealing.seal)))
        other = _other_layout(script)
        tried.append((f"frames for {other.n} robots: its strap for N is read the other way", other.team()))
        script.sent += other.sent
        script.wait_until(other.now)
        script.expects(script.now, "")(lambda observed: iter(()))

    rule = Rule("P24", "", ways, (topology,))
    (listener,) = listen(trial_of(rule), image, seed)
    # the earliest link of the chain first: a mistake in one makes all after it look wrong
    return (
        _serial_port(listener.observed.events, tried[0][1])
        or _begins_again(listener)
        or _obeyed(listener.observed, tried)
        or _chips(listener)
    )


def _other_layout(script: TrialScript) -> TrialScript:
    """A script that continues at the end of `script` with frames for a network of the other size."""
    other = TrialScript(next(topology for topology in BOTH if topology.robots != script.n), script.network)
    other.topology = Topology(other.n, script.topology.slots)
    other.now, other.seq = script.now, script.seq
    return other


def _begins_again(listener: Listener) -> str:
    """A text if the firmware has reset LM629s that it had ordered to turn, else "".

    The trial resets no processor.
    """
    turned_tick = min(
        (command.tick for command in listener.observed.commands if command.opcode == _STT), default=None
    )
    board = listener.subject.robot.board
    if turned_tick is None or board.left.reset_tick <= turned_tick:
        return ""
    return f"it resets unexpectedly: it reset its LM629s at {board.left.reset_tick / TICKS_PER_MS:.0f} ms"


def _serial_port(events: Sequence[Event], frame: Frame) -> str:
    sent = next(event.data for event in events if event.what == "sent")
    limit = frame.end_tick + TICKS_PER_MS
    received = [event for event in events if event.what == "received" and event.tick <= limit]
    if not received:
        return "its serial port takes no character: not set up, or off"
    if len(received) < len(sent):
        taken = f"{len(received)} of {amount(len(sent), 'character')}"
        return f"its serial port takes {taken}: RI stays set, or another bit rate"
    if bytes(event.value for event in received) != sent:
        return f"its serial port takes other characters than were sent, as at another bit rate: {characters(received)}"
    return ""


def why_lost(rule: Rule, network: int, image: Image, seed: int) -> str:
    """A text if a robot did not take all characters of the rule's trial, or its program hangs; else ""."""
    trial = trial_of(rule)
    if rule.topologies[network].keyed or not all(isinstance(event, Transmission) for event in trial.script):
        return ""  # noise, or a robot that was off
    transmissions = trial.transmissions_of(network)
    sent = len(b"".join(event.data for event in transmissions))
    for listener in listen(trial, image, seed):
        if listener.subject.network == network:
            received = [event for event in listener.observed.events if event.what == "received"]
            if len(received) < sent:
                return (
                    f"its serial port took {len(received)} of the trial's {sent} characters: off or too slow"
                )
            if again := _begins_again(listener):
                return again
            last_tick = max((event.tick for event in listener.observed.commands), default=0)
            later = [event for event in transmissions if event.tick > last_tick]
            if last_tick and len(later) > _UNHEARD:
                when = f"{last_tick / TICKS_PER_MS:.0f} ms"
                return f"it does nothing after {when}, though {len(later)} frames follow: it hangs"
    return ""


def _obeyed(observed: Observed, tried: Sequence[tuple[str, Frame]]) -> str:
    for mistake, frame in tried[1:]:
        if observed.slot < len(frame.words) and all(
            map(obeys, observed.both_orders(frame.acted_tick), frame.for_robot(observed.slot))
        ):
            return f"it obeys {mistake}"
    return ""


def _chips(listener: Listener) -> str:
    if not listener.subject.robot.board.left.reset_level:
        return "it holds its LM629s in reset (/RST is low)"
    opcodes = {command.opcode for command in listener.observed.commands}
    if not opcodes:
        return "it tells its LM629s nothing at all"
    if opcodes.isdisjoint(BY_OPCODE):
        return "it gives its LM629s unknown commands alone: data gone before /WR rises, or wrong pins"
    if not any(listener.observed.filters.values()):
        return "no filter was loaded into its LM629 (LFIL, UDF), so no wheel follows"
    return ""
