"""One camera frame followed through the whole loop: `python -m benchmarks.one_frame --write docs/one-frame.md`.

The run is `fig6` with seed 0. A camera frame is exposed at the start of a control period and reaches the law one period
later. The bytes that answer it arrive in the period after that, so three periods are watched. Wires come from a
waveform (`mirotwin fw vcd`), functions from the CPU's watcher (`mirotwin fw trace`), commands and characters from the
event logs, all else from the records of the control periods. Watching changes no bit of the run.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from miro_exact.clock import CONTROL_PERIOD_TICKS, CYCLE_TICKS
from miro_exact.dmath import sincos
from miro_protocol.decoder import Decoder, Received
from miro_robot.firmware import image_path
from miro_robot.image import Image, load_hex
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.watcher import Watcher, attach, detach
from miro_robot.inspect.waveform import Waveform
from miro_robot.mcs51.cpu import Cpu
from miro_sim.periods import Period
from miro_sim.scenario.file import load
from miro_sim.world.events import Event
from miro_sim.world.network import Network
from miro_sim.world.robot import Robot
from miro_sim.world.world import World
from mirotwin.camera.view import View, view_of

SCENARIO, SEED = "fig6", 0
FRAME = 32
"""On the way to the line, where the law turns the robot. The answering command asks the robot for telemetry."""
ARROW_M = 0.07
Edges = dict[str, list[tuple[int, int]]]
"""By wire: (tick, level) of the first level and of each change."""


class Span(NamedTuple):
    """The CPU was in one function from one tick to another; the empty name is sleep."""

    name: str
    address: int
    start_tick: int
    end_tick: int


class Sample(NamedTuple):
    """Both LM629 after the sample at `tick`: desired velocity in counts a sample, counts, PWM in 1/128 with sign."""

    tick: int
    left: tuple[float, int, int]
    right: tuple[float, int, int]


class Functions(Watcher):
    """Notes in which function the CPU was, and when."""

    def __init__(self, names: SymbolNames) -> None:
        self.names = names
        self.spans: list[Span] = []

    def executed(self, cpu: Cpu, pc: int, start: int) -> None:
        address, name = self.names.function(pc)
        self._note(name, address, start, cpu.cycles)

    def interrupted(self, cpu: Cpu, source: int, pc: int, start: int) -> None:
        address, name = self.names.function(cpu.pc)
        self._note(name, address, start, cpu.cycles)

    def slept(self, cpu: Cpu, start: int, end: int) -> None:
        self._note("", 0, start, end)

    def _note(self, name: str, address: int, start: int, end: int) -> None:
        span = Span(name, address, CYCLE_TICKS * start, CYCLE_TICKS * end)
        if self.spans and self.spans[-1].name == name:
            span = self.spans.pop()._replace(end_tick=span.end_tick)
        self.spans.append(span)


@contextmanager
def watched(robot: Robot, image: Image) -> Iterator[tuple[io.StringIO, Functions]]:
    """The wires of a robot as VCD, and what its CPU does."""
    functions, wires, cpu = Functions(SymbolNames(image)), io.StringIO(), robot.board.cpu
    waveform = Waveform(wires, robot.board).attach(cpu)
    attach(cpu, functions)
    yield wires, functions
    detach(cpu, functions)
    waveform.close()


class Way:
    """Runs the scenario and says what became of frame FRAME.

    `before`: the control period of its exposure; `answer`: the one whose command answers it; `after`: two more.
    """

    def __init__(self) -> None:
        image = load_hex(image_path())
        world = World(load(SCENARIO).scenario, SEED, image)
        self.robot = world.robot()
        view = view_of(world, 0, SCENARIO)
        while world.index < FRAME:
            world.step()
        self.before = world.step()
        self._take_picture(view)
        periods: list[Period] = []
        world.observers.append(periods.append)
        with watched(self.robot, image) as (wires, functions):
            self.samples = list(_samples(world, self.robot, world.tick + 3 * CONTROL_PERIOD_TICKS))
        self.answer, *self.after = periods
        self.edges = edges_of(wires.getvalue())
        self._take_events(world.networks[0])
        self.spans = [span for span in functions.spans if span.start_tick > self.received[-1].tick]

    def _take_picture(self, view: View) -> None:
        pair, tracker = view.notes.pairs[0], view.sight.tracker
        assert pair is not None
        self.picture, self.window, self.pair = view.picture(), view.notes.windows[0], pair
        at = pair.sighting
        sine, cosine = sincos(at.theta_rad)
        ends = ((at.x_m, at.y_m), (at.x_m + ARROW_M * cosine, at.y_m + ARROW_M * sine))
        self.arrow = [tracker.top.lens.pixel(x_m, y_m, tracker.top.z_m) for x_m, y_m in ends]

    def _take_events(self, network: Network) -> None:
        """The frame on the air, its characters in the robot, the LM629's commands, the robot's answer."""
        at_pc = [event for _, event in network.log.since(0) if event.tick >= self.answer.tick]
        self.sent = next(event for event in at_pc if event.what == "sent")
        self.key_up_tick = self.sent.tick - network.outbox.lead_ticks
        log = [event for _, event in self.robot.log.since(0) if event.tick > self.sent.tick]
        self.received = [event for event in log if event.what == "received"][: len(self.sent.data)]
        last_tick = self.received[-1].tick
        self.commands = [event for event in log if event.what == "command" and event.tick > last_tick][:3]
        self.telemetry = next(event for event in at_pc if event.what == "answer" and event.tick > last_tick)
        (decoded,) = Decoder(network.spec.robots).feed(bytes(event.value for event in self.received))
        assert isinstance(decoded, Received)
        self.decoded = decoded

    @property
    def exposed_tick(self) -> int:
        return self.before.tick

    def us(self, tick: int) -> float:
        """Microseconds since the exposure."""
        return (tick - self.exposed_tick) / 24

    def first(self, function: str) -> Span:
        """Where the CPU first enters a function after the frame's last character."""
        return next(span for span in self.spans if span.name == function)

    def next_edge(self, wire: str, level: int, tick: int) -> int:
        """The first tick after `tick` at which a wire gets this level."""
        return next(at for at, found in self.edges[wire] if at > tick and found == level)

    @property
    def on_the_way(self) -> list[Span]:
        """What the CPU did from the frame's last character to the start of the wheels."""
        return [span for span in self.spans if span.start_tick < self.start_command.tick]

    @property
    def start_command(self) -> Event:
        """STT, which starts both wheels."""
        return self.commands[-1]

    @property
    def taken(self) -> Sample:
        """The sample in which both LM629 take the new velocities."""
        return next(sample for sample in self.samples if sample.tick > self.start_command.tick)


def _samples(world: World, robot: Robot, end_tick: int) -> Iterator[Sample]:
    """Both chips after each of their samples up to `end_tick`."""
    chips = robot.board.left, robot.board.right
    while world.tick < end_tick:
        tick = robot.board.left.sample_tick
        world.run_to(tick + 100)  # the chip has done the sample, and the next one is far
        left, right = (
            (
                chip.desired_velocity / 65536,
                chip.real_position,
                -chip.pwm_magnitude if chip.sign else chip.pwm_magnitude,
            )
            for chip in chips
        )
        yield Sample(tick, left, right)


def edges_of(vcd: str) -> Edges:
    """The wires of a VCD file as `Waveform` writes it."""
    names: dict[str, str] = {}
    edges: Edges = {}
    tick = 0
    for line in vcd.splitlines():
        words = line.split()
        if line.startswith("$var"):
            names[words[3]] = words[4]
        elif line.startswith("#"):
            tick = -(-3 * int(line[1:]) // 125)
        elif line[:1] in ("0", "1") and line[1:] in names:
            edges.setdefault(names[line[1:]], []).append((tick, int(line[0])))
    return edges


def main() -> None:
    from benchmarks import one_frame_page, one_frame_pictures

    parser = argparse.ArgumentParser(description="Follows one camera frame through the loop.")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="docs/one-frame.md, with its pictures")
    given = parser.parse_args()
    way = Way()
    text = one_frame_page.page(way)
    if given.write:
        given.write.write_text(text, encoding="utf-8")
        one_frame_pictures.draw(way, given.write.parent)
    else:
        print(text, end="")


if __name__ == "__main__":
    main()
