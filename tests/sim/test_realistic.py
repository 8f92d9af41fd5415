"""The built-in scenarios with every disturbance on: they track, nothing faults, and no frame is made up."""

import statistics

import pytest

from miro_protocol.decoder import Decoder, Received
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario import file as scenario_file
from miro_sim.world.world import World
from mirotwin.recording.track import Tracks
from mirotwin.report.summary import tracking_of

SEEDS = range(10)


@pytest.fixture(scope="module")
def image():
    return load_hex(image_path())


def peek16(cpu, address):
    return cpu.peek_iram(address) | cpu.peek_iram(address + 1) << 8


def signed(value):
    return value - 0x10000 if value & 0x8000 else value


class Observer:
    """Compares what the firmware acted on, read from its RAM, with what the station sent."""

    def __init__(self, world):
        self.robot = world.networks[0].robots[0]
        self.robots = world.networks[0].spec.robots
        symbols = world.image.symbols
        self.address = {
            name: symbols.find(name).address
            for name in ("frames_accepted", "last_hdr", "last_left", "last_right")
        }
        self.accepted = 0
        self.sent = {}

    def look(self, period):
        for run in period.wire:
            if run.direction == ">":
                [frame] = [
                    event for event in Decoder(self.robots).feed(run.data) if isinstance(event, Received)
                ]
                self.sent[frame.seq] = frame.message(self.robots)
        cpu = self.robot.board.cpu
        accepted = peek16(cpu, self.address["frames_accepted"])
        assert accepted - self.accepted in (0, 1)
        if accepted != self.accepted:
            sent = self.sent[cpu.peek_iram(self.address["last_hdr"]) & 0x3F]
            wheels = tuple(signed(peek16(cpu, self.address[side])) for side in ("last_left", "last_right"))
            assert wheels == sent.velocities[self.robot.spec.slot]
        self.accepted = accepted


@pytest.mark.parametrize("name", ["fig6", "fig8"])
def test_the_figure_is_tracked_within_the_papers_measurement_error(name, image):
    scenario = scenario_file.load(name).scenario
    errors = []
    for seed in SEEDS:
        world = World(scenario, seed, image)
        observer = Observer(world)
        periods = []
        while not world.finished:
            period = world.step()
            observer.look(period)
            periods.append(period)
        assert world.faults == []
        assert observer.accepted > 150
        errors.append(tracking_of(Tracks(periods).robots[0, 0].errors).rms_position_cm)
    assert statistics.median(errors) <= 2.5, errors
