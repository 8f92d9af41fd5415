"""A recording lists an answer as valid exactly where the PC took it: stop bits are recorded."""

import io

import pytest
from msgspec.structs import replace

from miro_exact.clock import HOST_CHARACTER_TICKS
from miro_protocol.events import Received
from miro_protocol.frames import TelemetryFrame, encode
from miro_protocol.transmission import UP, Transmission
from miro_sim.periods import Period
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.recording import runner
from mirotwin.recording.capture.input import Input
from mirotwin.recording.capture.recorded import transmissions, transmissions_of
from mirotwin.recording.capture.rows import rows
from mirotwin.recording.reader import parse
from mirotwin.recording.recorder import Recorder, RunSource
from tests.sim.world.rig import image

PERIODS = 150


def noisy_world(seed):
    text = load("fig6")
    network = text.scenario.networks[0]
    radio = replace(network.radio, bit_error_rate=5e-3)
    network = replace(network, radio=radio)
    return World(replace(text.scenario, networks=(network,)), seed, image())


def recorded(seed):
    """The recording of a noisy run, and start and body of the answers that the PC took."""
    world = noisy_world(seed)
    stream = io.BytesIO()
    source = RunSource(scenario_name="x", scenario_text="", seed=seed, firmware=b"", firmware_sha256="")
    with Recorder(stream, source) as recorder:
        runner.run(world, recorder, False, lambda period: period.index == PERIODS)
    answers = [event.frame for _, event in world.networks[0].log.since(0) if event.what == "answer"]
    return stream.getvalue(), [(answer.start_tick, answer.body) for answer in answers if answer is not None]


def listed(path):
    with Input(str(path)) as given:
        return [row for row in rows(transmissions(given, {}), lambda network: 3) if row.direction == UP]


@pytest.mark.parametrize("seed", range(6))
def test_the_answers_in_a_recording_are_those_that_the_pc_took(tmp_path, seed):
    path = tmp_path / "run.mcap"
    data, answers = recorded(seed)
    path.write_bytes(data)
    found = [row.event for row in listed(path) if isinstance(row.event, Received)]
    assert [event.body for event in found] == [body for _, body in answers]
    # Behind a bad stop bit in the preamble the PC takes its next start edge a part of a bit later than it was sent.
    bit = HOST_CHARACTER_TICKS // 10
    assert all(abs(event.start_tick - tick) < bit for event, (tick, _) in zip(found, answers, strict=True))
    assert answers
    periods = parse(data, "run.mcap").periods
    with Input(str(path)) as given:
        assert transmissions_of(periods) == list(transmissions(given, {}))


@pytest.mark.parametrize("place", [5, 12, 18])
def test_an_answer_refused_for_one_stop_bit_even_its_last_is_listed_as_refused(mirotwin, tmp_path, place):
    answer = encode(TelemetryFrame(3, 1), 3)
    source = RunSource(scenario_name="x", scenario_text="", seed=1, firmware=b"", firmware_sha256="")
    recording, exported = tmp_path / "run.mcap", tmp_path / "run.stream"
    with recording.open("wb") as stream, Recorder(stream, source) as recorder:
        wire = (Transmission(90_000, UP, answer, 0, (place,)), Transmission(900_000, UP, answer))
        recorder.write(Period(0, 0, (), wire, "00"))
    assert mirotwin("export", recording, "--out", exported, "-q")[0] == 0
    for path in (recording, exported):
        code, out, _ = mirotwin("decode", path, "--robots", "3")
        assert code == 0
        assert "1 telemetry; 1 damaged runs of 19 bytes (1 bad stop bit)" in out
