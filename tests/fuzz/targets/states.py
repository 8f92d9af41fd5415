"""Saved states whose fields are others and whose checksum is right: worlds, a robot's board, a board alone.

An input names fields by number, each with the bytes that stand there instead. A field of fixed size keeps it unless
the input says otherwise. The state must be refused with a ValueError and without a change, or run on.
"""

import hashlib
import math
import struct

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.state import Flat
from miro_robot.board import Board
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.plant import IdealWheels
from miro_robot.wiring import load_wiring
from miro_sim.scenario.terminal import InputPiece, PinEvent
from miro_sim.world.saved import opened, sealed
from tests.alone import Alone
from tests.fuzz.target import Draws, Target, folder, refused
from tests.mirotwin.mutated_files import ECHO, hex_records
from tests.sim.mutated_worlds import fresh, saved_worlds

_FRESH_AFTER = 64
"""Inputs that one world, board or machine loads: what was loaded before must not matter."""


def spans_of(fields, state):
    """Begin and end of each field in the bytes of a state."""
    found, at = [], 0
    for field in fields:
        _, end = field.kind.decode(state, at)
        found.append((at, end))
        at = end
    return found


def patched(state, spans, draw):
    """`state` with the fields that are drawn, until there are no more."""
    others = {}
    while draw.left:
        number, head = draw.below(len(spans)), draw.below(256)
        begin, end = spans[number]
        data = draw.take(min(head & 0x7F, 64))
        before = others.get(number, state[begin:end])
        others[number] = data if head & 0x80 else (data + before[len(data) :])[: len(before)]
    for number in sorted(others, reverse=True):
        begin, end = spans[number]
        state = state[:begin] + others[number] + state[end:]
    return state


def _loading(make, states, go_on):
    """`make` gives something new to load into, `go_on` lets it run a little."""
    count, subject = 0, make()
    spans = [spans_of(subject.state.fields, state) for state in states]

    def run(data):
        nonlocal count, subject
        count += 1
        if count % _FRESH_AFTER == 0:
            subject = make()
        draw = Draws(data)
        which = draw.below(len(states))
        state = patched(states[which], spans[which], draw)
        before = subject.state.save()
        try:
            subject.put(state)
        except ValueError as error:
            assert subject.state.save() == before, "refused with a change"
            return refused(error)
        go_on(subject)
        subject.state.save()
        return "ran"

    return run


class _World:
    """A world with its `Flat` state; what is put is sealed again."""

    def __init__(self, profile):
        self.world = fresh(profile)
        self.state = self.world.state

    def put(self, state):
        self.world.load(sealed(self.world.identity(), state))


def _world(profile):
    identity = _World(profile).world.identity()
    states = [opened(saved, identity) for saved in saved_worlds(profile)]

    def go_on(subject):
        subject.world.run_to(subject.world.tick + CONTROL_PERIOD_TICKS // 4)

    return _loading(lambda: _World(profile), states, go_on)


def _sealed():
    """The form around the state: magic, version, what a world belongs to, checksum."""
    world = fresh()
    saved = saved_worlds()[1][:-32]
    before = world.state.save()

    def run(data):
        draw = Draws(data)
        content = bytearray(saved)
        while draw.left:
            place = draw.below(200) if draw.below(2) else draw.below(len(content))
            content[place : place + draw.below(4)] = draw.take(draw.below(9))
            if not content:
                break
        whole = bytes(content) + (hashlib.sha256(content).digest() if len(data) % 4 else data[:32])
        try:
            world.load(whole)
        except ValueError as error:
            assert world.state.save() == before, "refused with a change"
            return refused(error)
        world.state.load(before)
        return "loaded"

    return run


class _Flat:
    """Anything with a table of state."""

    def __init__(self, root):
        self.root = root
        self.state = Flat(root)

    def put(self, state):
        self.state.load(state)


def _board():
    image = load_hex(image_path())

    def make():
        board = Board(load_wiring(), IdealWheels(), 1, 3)
        board.load(image)
        board.cpu.rxd.settled_tick = 1 << 40
        return _Flat(board)

    states = []
    subject = make()
    for tick in (1, 30_001, 240_000, 2_000_003):
        subject.root.run(tick)
        states.append(subject.state.save())

    def go_on(subject):
        subject.root.cpu.rxd.settled_tick = 1 << 60
        subject.root.run(12 * subject.root.cpu.cycles + 24_000)

    return _loading(make, states, go_on)


def _bare():
    path = folder() / "state.ihx"
    path.write_bytes(hex_records(ECHO))
    image = load_hex(path)

    def make():
        pieces = (InputPiece(b"abc"), InputPiece(b"de", b"c", 5))
        return _Flat(
            Alone(image, False, pieces, 9600, pins=(PinEvent(5000, 1, 2, 0), PinEvent(90_000, 1, 2, 1)))
        )

    states = []
    subject = make()
    for cycles in (1, 1_500, 5_000):
        subject.root.run(max_cycles=cycles)
        states.append(subject.state.save())

    def go_on(subject):
        subject.root.run(max_cycles=subject.root.cpu.cycles + 2_000)

    return _loading(make, states, go_on)


_NUMBERS = [
    number.to_bytes(8, "little", signed=number < 0)
    for number in (1, -1, 1 << 31, 1 << 40, 1 << 61, (1 << 63) - 1, -(1 << 63), 4096, 4097)
]
_NUMBERS += [struct.pack("<d", number) for number in (math.nan, math.inf, 1e300)]


def _target(what, make):
    return Target(what, make, most_bytes=128, words=_NUMBERS)


TARGETS = {
    "world": _target("saved worlds with other values, radio `wire`", lambda: _world("wire")),
    "world-shared": _target("the same with radio `shared`", lambda: _world("shared")),
    "sealed": Target("the form around a saved world", _sealed, most_bytes=64),
    "board-state": _target("a board's state with other values", _board),
    "bare-state": _target("a board alone, its state with other values", _bare),
}
