"""The rules of `miro_protocol.robot_rules`, each said over a whole history with nothing remembered on the way."""

from typing import NamedTuple

CHARACTER = 25_000  # 10 bits at 9600 baud
MS = 24_000


class Said(NamedTuple):
    """A frame, an order or an answer: when, and what is in it."""

    tick: int
    what: tuple[int, ...]


def silence_deadline(last_tick, after, tolerance, received):
    """When a wheel must have gone over after the fresh frame at `last_tick`."""
    due = last_tick + CHARACTER + after
    tests = any(due - 2 * MS <= tick <= due + tolerance for tick in received)
    return due + tolerance + (2 * MS if tests else 0)


def silence_is_early(last_tick, after, tolerance, tick):
    """Whether a wheel that goes over at `tick` does so before the failsafe may, and not because of the frame."""
    from_frame = tick <= last_tick + CHARACTER + 10 * MS
    return not from_frame and tick < last_tick + max(0, after - tolerance)


def missed(frames, orders, within, end):
    """Team frames that neither an order in time has obeyed, nor one of a later frame has made past."""
    found = []
    for at, frame in enumerate(frames):
        deadline = frame.tick + within
        if deadline >= end:
            continue
        answers = [other for other in frames[at:] for order in orders if _obeys(order, other, deadline)]
        if not answers:
            found.append(frame)
    return found


def _obeys(order, frame, deadline):
    return order.what == frame.what and frame.tick < order.tick <= deadline


def is_sent(frames, tick, words, within):
    """Whether a frame with these velocities was sent at most `within` before `tick`."""
    return any(one.what == words and 0 <= tick - one.tick <= within for one in frames)


def answer_fails(events, within, last_character):
    """What is wrong with answers to questions: events are ("asked", "answer", "character" or "look", tick, number)."""
    found = []
    for at, (kind, tick, seq) in enumerate(events):
        past = events[:at]
        asked = [number for what, _, number in past if what == "asked"]
        if kind == "character" and _left(past) == 0:
            found.append(("unasked", tick))
        if kind == "answer" and seq not in asked[-2:]:
            found.append(("wrong", tick))
        waiting = _waiting(past, within + last_character)
        if waiting is not None:
            begun, number = waiting
            if tick > begun + within + last_character:
                found.append(("missing", begun + within))
            elif kind == "answer" and number == seq and tick > begun + within:
                found.append(("late", tick))
    return found


def _left(past):
    """How many characters of an answer are still to come."""
    left = 0
    for at, (kind, _, seq) in enumerate(past):
        asked = [number for what, _, number in past[:at] if what == "asked"]
        if kind == "asked":
            left = 19
        elif kind == "character":
            left = max(0, left - 1)
        elif kind == "answer" and asked[-1:] == [seq]:
            left = 0
    return left


def _waiting(past, patience):
    """The question that waits: the first that came while none did."""
    waiting = None
    for kind, tick, seq in past:
        if waiting is not None and tick > waiting[0] + patience:
            waiting = None
        if kind == "asked" and waiting is None:
            waiting = (tick, seq)
        elif kind == "answer" and waiting is not None and waiting[1] == seq:
            waiting = None
    return waiting


class Wheel:
    """What one LM629 is told, from the bytes of its commands: (what, velocity, acceleration, abrupt)."""

    def __init__(self):
        self.control = 0
        self.velocity = 0
        self.acceleration = 0
        self.order = ("off", 0, 0, False)

    def reset(self):
        self.__init__()

    def load(self, data):
        self.control = int.from_bytes(data[:2], "big")
        rest = data[2:]
        if self.control & 1 << 5 and len(rest) >= 4:
            number, rest = int.from_bytes(rest[:4], "big", signed=True), rest[4:]
            self.acceleration = number + (self.acceleration if self.control & 1 << 4 else 0)
        if self.control & 1 << 3 and len(rest) >= 4:
            number = int.from_bytes(rest[:4], "big", signed=True)
            self.velocity = number + (self.velocity if self.control & 1 << 2 else 0)

    def start(self):
        backward = self.control & 1 << 11 and not self.control & 1 << 12
        if self.control & 1 << 8:
            self.order = ("off", 0, self.acceleration, False)
        elif self.control & (1 << 9 | 1 << 10):
            self.order = ("stop", 0, self.acceleration, bool(self.control & 1 << 9))
        else:
            self.order = ("drive", -self.velocity if backward else self.velocity, self.acceleration, False)
