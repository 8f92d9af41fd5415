"""Rules about service frames, and about frames whose content is unknown."""

from __future__ import annotations

from miro_protocol.table import DEFAULT_ACCELERATION, Opcode
from miro_sim.world.events import SIDES
from mirotwin.conform.hints import number
from mirotwin.conform.observed import Observed, Words
from mirotwin.conform.rule import FIRMWARE, FRAME, RECEPTION, VERSIONS, Chapter, Topology
from mirotwin.conform.rules.failsafe import stops_behind
from mirotwin.conform.rules.sound import nothing_refused
from mirotwin.conform.trial_script import Found, Frame, TrialScript, ms

CHAPTER = Chapter("Service frames and unknown contents")


@CHAPTER.rule("P34", FRAME, presupposes="P29", broken="a ping does not do what it has to")
def ping(script: TrialScript) -> None:
    """A service frame MUST count as fresh and leave the velocities as they are: a ping does nothing else."""
    frame = script.obeyed(script.team())
    for _ in range(5):
        last = script.ping(gap_ms=60.0)
        script.untouched(last, since=frame)
    script.unchanged(frame.acted_tick, script.now, "velocities kept while service frames come")
    stops_behind(script, last)
    script.wait(70.0)


@CHAPTER.rule("P35", FRAME, presupposes="P21", broken="filter words are not loaded as they have to be")
def filter_words(script: TrialScript) -> None:
    """Opcode 1 MUST load kp, ki, kd and il into both LM629 and put them in force, at rest and in motion."""
    for words in ((0x0102, 0x0304, 0x0506, 0x0708), (0x7FFF, 0, 1, 0x55AA), (400, 40, 3000, 2000)):
        _filter_taken(script, script.filter(words, "filter frame"), words)
    script.obeyed(script.team())
    words = (401, 41, 2900, 1999)
    frame = script.filter(words, "filter frame in motion")
    _filter_taken(script, frame, words)
    script.unchanged(frame.tick, frame.acted_tick, "velocities kept")
    script.obeyed(script.team())


def _filter_taken(
    script: TrialScript,
    frame: Frame,
    words: Words,
    wanted: str = "kp, ki, kd, il = ",
    slots: tuple[int, ...] = (),
) -> None:
    @script.expects(frame.acted_tick, f"{wanted}{_listed(words)} in force after {frame.what}", slots)
    def test(observed: Observed) -> Found:
        for side in SIDES:
            taken = observed.set_to(side, frame.acted_tick)
            if taken != words:
                yield frame.acted_tick, f"{_listed(taken)} in the {side} one"


def _listed(words: Words | None) -> str:
    return "none" if words is None else ", ".join(map(number, words))


@CHAPTER.rule("P36", FRAME, presupposes="P21", broken="an acceleration is not set as it has to be")
def acceleration(script: TrialScript) -> None:
    """Opcode 2 MUST set the acceleration of both wheels, all 32 bits of it; at rest it is in force from the next
    velocities on.
    """
    for value in (0x0102_0304, 0x3FFF_FFFF, 0x0001_2345, 4000):
        script.acceleration(value, "acceleration frame")
        _driven_with(script, script.team(), value)
        script.obeyed(script.team(_standing(script)))
        script.wait(520.0)  # motors off: at rest in any case


@CHAPTER.rule("P37", FIRMWARE, presupposes="P31 P41", broken="an acceleration in motion does not wait")
def acceleration_waits(script: TrialScript) -> None:
    """An acceleration that comes in motion MUST wait until the wheels stand: velocities go on with the one before."""
    script.obeyed(script.team())
    _sent_in_motion(script, 9000)
    for words in (script.words(), ((0, 700),) * script.n, ((-700, 0),) * script.n):
        _driven_with(script, script.team(words), DEFAULT_ACCELERATION)
    for _ in range(8):  # told to stand by frames
        script.obeyed(script.team(_standing(script), gap_ms=20.0))
    for _ in range(4):
        fast = script.team(((300, 14000),) * script.n, gap_ms=60.0)
    _driven_with(script, fast, 9000)
    _sent_in_motion(script, 7000)
    script.obeyed(script.team(_standing(script), gap_ms=15.0))
    _driven_with(script, script.team(label="team frame while one wheel slows down"), 9000)
    script.wait(300.0)  # told to stand by the failsafe
    _driven_with(script, script.team(), 7000)
    script.answered(script.ask(gap_ms=40.0))
    nothing_refused(script)


def _sent_in_motion(script: TrialScript, value: int) -> None:
    frame = script.acceleration(value, "acceleration in motion")
    script.unchanged(frame.tick, frame.acted_tick, "velocities kept")


def _standing(script: TrialScript) -> tuple[tuple[int, int], ...]:
    return ((0, 0),) * script.n


def _driven_with(script: TrialScript, frame: Frame, value: int) -> None:
    """The frame is obeyed, and this acceleration is in force."""
    script.obeyed(frame)

    @script.expects(frame.acted_tick, f"acceleration {number(value, 8)} in force with {frame.what}")
    def test(observed: Observed) -> Found:
        for order in observed.both_orders(frame.acted_tick):
            if order.acceleration != value:
                yield frame.acted_tick, f"{number(order.acceleration, 8)} in the {order.side} one"


@CHAPTER.rule("P38", FRAME, presupposes="P35 P36", topologies=(Topology(3, (0, 1, 2)), Topology(5, (0, 4))))
def addressed(script: TrialScript) -> None:
    """A setting MUST be made by the addressed robot alone."""
    words = (300, 30, 2500, 1500)
    for slot in script.topology.slots:
        others = tuple(other for other in script.topology.slots if other != slot)
        name = f"service frame to robot {slot}, opcode "
        frame = script.filter(words, f"{name}{Opcode.FILTER}", slot=slot)
        script.untouched(frame, others)
        _filter_taken(script, frame, words, "", (slot,))
        script.untouched(script.acceleration(8000, f"{name}{Opcode.ACCELERATION}", slot=slot), others)
    script.obeyed(script.team())
    absent = script.n - 2
    if absent not in script.topology.slots:
        script.untouched(script.filter(words, "service frame to a slot without a robot", slot=absent))


@CHAPTER.rule("P39", VERSIONS, presupposes="P31")
def unknown_opcode(script: TrialScript) -> None:
    """A service frame with an unknown opcode MUST be valid and count as fresh, and nothing in it be acted on."""
    data = bytes(range(1, 9))
    for opcode in (3, 0xFE):
        script.untouched(script.service(opcode, data, f"service frame at rest, opcode {opcode}"))
    frame = script.obeyed(script.team())
    for opcode in (3, 4, 0x7F, 0x81, 0xFF):
        last = script.service(opcode, data, gap_ms=50.0)
        script.untouched(last, since=frame)
    script.unchanged(frame.acted_tick, script.now, "velocities kept")
    stops_behind(script, last)
    script.wait(150.0)
    _driven_with(script, script.team(), DEFAULT_ACCELERATION)


@CHAPTER.rule("P40", RECEPTION, presupposes="P29", broken="a frame of type 2 is not handled as it has to be")
def type_2(script: TrialScript) -> None:
    """A frame of type 2 from a host MUST be valid and count as fresh, and nothing in it be acted on or answered."""
    frame = script.obeyed(script.team())
    for _ in range(3 * script.n):  # each number asks another robot
        last = script.of_type_2(gap_ms=40.0)
        script.untouched(last, since=frame)
    script.silent(frame.end_tick + ms(25.0), script.now, "frames of type 2 ask nobody")
    stops_behind(script, last)
    script.wait(80.0)
