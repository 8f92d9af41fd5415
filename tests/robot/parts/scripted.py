"""A part whose behaviour is a list, for tests of the nets: what it drives by itself, and how it answers."""

from typing import NamedTuple

from miro_exact.clock import NEVER_TICK
from miro_exact.rng import Stream
from miro_exact.state import TICK, Rows
from miro_robot.board_spec import BoardSpec
from miro_robot.parts.keys import IN, OPEN_DRAIN, STRONG, TWO_WAY, PartKeys, Pin, Place
from miro_robot.parts.netlist import Netlist, PartPin
from miro_robot.parts.part import Part
from miro_robot.wired_board import WiredBoard
from tests.robot.mcs51.asm import image_of

A, B, Q, R, D, W = range(6)
"""Two inputs, two strong outputs, an open drain, a two-way pin."""


class Answer(NamedTuple):
    """When `pin` has another level: `output` gets `level`, or what `others` of the pin is, inverted or not, later."""

    pin: int
    output: int
    level: int | None = None
    inverted: int = 0
    delay: int = 0


class Scripted(PartKeys, frozen=True, kw_only=True, tag="scripted"):
    """`events`: tick, pin, drive, in the order of time. `honest`: says when it next reaches a pin."""

    PINS = (
        Pin("a", IN, optional=True),
        Pin("b", IN, optional=True),
        Pin("q", STRONG, optional=True),
        Pin("r", STRONG, optional=True),
        Pin("d", OPEN_DRAIN, optional=True),
        Pin("w", TWO_WAY, optional=True),
    )
    PUTS = {"drive": int}
    READS = {"count": "calls"}

    events: tuple[tuple[int, int, int], ...] = ()
    answers: tuple[Answer, ...] = ()

    def make(self, place: Place) -> Part:
        return ScriptedPart(self, place)


class ScriptedPart(Part):
    """`heard`: all calls, with what the part saw then. Puts drive its pin q."""

    STATE = {"count": TICK, "events": Rows(4096, "q", "B", "B", ordered=True)}
    NOT_STATE = ("heard",)

    def __init__(self, keys: Scripted, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.count = 0
        self.events: list[tuple[int, int, int]] = []
        self.heard: list[tuple[int, str, int, list[int], list[int], list[int]]] = []

    def start(self, tick: int) -> None:
        self.events = list(self.keys.events)
        self._plan()

    def changed(self, pins: int, tick: int) -> None:
        self._hear(tick, "changed", pins)
        for pin, output, level, inverted, delay in self.keys.answers:
            if pins >> pin & 1:
                level = self.others(pin) ^ inverted if level is None else level
                level = 2 if output == D and level else level
                if delay:
                    self.events.append((tick + delay, output, level))
                    self.events.sort(key=lambda event: event[0])
                else:
                    self.drive(output, level)
        self._plan()

    def due(self, tick: int) -> None:
        self._hear(tick, "due", 0)
        while self.events and self.events[0][0] == tick:
            _, pin, level = self.events.pop(0)
            self.drive(pin, level)
        self._plan()

    def put(self, name: str, value: int, tick: int) -> None:
        self.drive(Q, value)

    def _plan(self) -> None:
        self.next_tick = self.events[0][0] if self.events else NEVER_TICK

    def _hear(self, tick: int, what: str, pins: int) -> None:
        self.count += 1
        seen = [[look(pin) for pin in range(6)] for look in (self.level, self.others, self.is_driven)]
        self.heard.append((tick, what, pins, *seen))


def place(name: str, crystal_hz: int = 24_000_000) -> Place:
    """Where a part is soldered that nobody shares a net with."""
    return Place(name=name, crystal_hz=crystal_hz, noise=Stream(0, name), connected=frozenset(), peers={})


def board_of(program="SJMP $", netlist=None, parts=(), **options) -> WiredBoard:
    """A board with these parts, whose UART hears nothing."""
    spec = options.pop("spec", BoardSpec())
    board = WiredBoard(spec, image_of(program), netlist or Netlist(), parts, **options)
    board.cpu.rxd.settled_tick = 1 << 60
    return board


def wired(ports, parts, **more) -> Netlist:
    """Nets from names: `ports`: port pin -> net, `parts`: by part, pin -> net, with ! for an inverter."""
    used = [*ports.values(), *(net.lstrip("!") for pins in parts for net in pins.values())]
    names = tuple(sorted({*used, *(net for key in more for net in more[key])}))
    numbers = {name: number for number, name in enumerate(names)}
    tables = {key: tuple(numbers[net] for net in nets) for key, nets in more.items()}
    return Netlist(
        names=names,
        ports=tuple(numbers.get(ports.get((number >> 3, number & 7), ""), -1) for number in range(32)),
        parts=tuple(
            tuple(
                PartPin(numbers[pins[pin].lstrip("!")], pins[pin].startswith("!"))
                if pin in pins
                else PartPin()
                for pin in range(6)
            )
            for pins in parts
        ),
        **tables,
    )


def scripted(name, events=(), answers=(), cls=ScriptedPart) -> Part:
    return cls(Scripted(events=tuple(events), answers=tuple(answers)), place(name))
