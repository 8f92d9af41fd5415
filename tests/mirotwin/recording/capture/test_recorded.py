"""The characters in a recording: every one, in the order of time, also when the file was cut short."""

import re
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from miro_protocol.frames import TelemetryFrame, encode
from miro_protocol.transmission import Transmission
from miro_sim.periods import Period
from miro_sim.scenario.file import load
from mirotwin.recording.capture import recorded
from mirotwin.recording.capture.input import Input
from mirotwin.recording.container import RecordingError
from mirotwin.recording.recorder import Recorder, RunSource
from tests.mirotwin.synthetic import periods

PERIOD = 800_800
UP = 24_960
ANSWER = encode(TelemetryFrame(3, 1), 3)
TEXT = load("fig6").text


def recording(wires, text=TEXT):
    stream = BytesIO()
    source = RunSource(scenario_name="x", scenario_text=text, seed=1, firmware=b"", firmware_sha256="")
    with Recorder(stream, source) as recorder:
        for index, wire in enumerate(wires):
            recorder.write(Period(index, index * PERIOD, (), wire, "00"))
    return stream.getvalue()


def foreign_mcap():
    stream = BytesIO()
    writer = Writer(stream)
    writer.start()
    writer.add_metadata("foreign", {"format": "1"})
    writer.finish()
    return stream.getvalue()


def read(path, tell=lambda text: None):
    robots = {}
    found = []
    with Input(str(path)) as given:
        try:
            for run in recorded.transmissions(given, robots, tell):
                found.append(run)
        except RecordingError as error:
            return found, robots, error
    return found, robots, None


def down(tick, data=b"down", network=0):
    return Transmission(tick, ">", data, network)


def up(tick, data, network=0, bad_stop=()):
    return Transmission(tick, "<", data, network, bad_stop)


def test_runs_come_in_the_order_of_time_with_the_layout_of_their_network(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(
        recording([(down(100), down(PERIOD + 50), up(90, b"a")), (down(PERIOD + 10, network=1),)])
    )
    found, robots, error = read(path)
    assert error is None
    assert [(run.tick, run.direction, run.network) for run in found] == [
        (90, "<", 0),
        (100, ">", 0),
        (PERIOD + 10, ">", 1),
        (PERIOD + 50, ">", 0),
    ]
    assert robots == {0: 3}


@pytest.mark.parametrize("cuts", [[], [1], [18], [5, 9], [1, 2, 3]])
def test_an_answer_that_goes_on_over_the_end_of_periods_is_one_run(tmp_path, cuts):
    places = [0, *cuts, len(ANSWER)]
    wires = [(up(7 + start * UP, ANSWER[start:end]),) for start, end in pairwise(places)]
    path = tmp_path / "run.mcap"
    path.write_bytes(recording([*wires, ()]))
    assert read(path)[0] == [up(7, ANSWER)]


def test_bad_stop_bits_are_told_wherever_they_are(tmp_path):
    path = tmp_path / "run.mcap"
    first = up(7, ANSWER[:8], bad_stop=(2, 7))
    second = up(7 + 8 * UP, ANSWER[8:], bad_stop=(0, 10))
    path.write_bytes(recording([(first,), (second,)]))
    assert read(path)[0] == [up(7, ANSWER, bad_stop=(2, 7, 8, 18))]


def test_what_comes_after_a_pause_is_another_transmission(tmp_path):
    path = tmp_path / "run.mcap"
    sent = [up(7, b"abc"), up(7 + 3 * UP + 1300, b"de"), up(7 + 9 * UP, b"f", 1), up(7 + 20 * UP, b"g")]
    path.write_bytes(recording([tuple(sent[:1]), tuple(sent[1:]), ()]))
    assert read(path)[0] == sent


def test_periods_in_memory_give_the_same_as_their_recording(tmp_path):
    first = (down(5), up(7, b"abc"), up(7 + 5 * UP, b"de"), up(7 + 9 * UP, ANSWER[:4], 1, (3,)))
    second = (down(PERIOD + 9), up(7 + 7 * UP, b"f"), up(7 + 13 * UP, ANSWER[4:], 1))
    path = tmp_path / "run.mcap"
    path.write_bytes(recording([first, second, ()]))
    wires = enumerate((first, second))
    found = recorded.transmissions_of([Period(index, index * PERIOD, (), wire, "") for index, wire in wires])
    assert found == read(path)[0]
    assert [sent.data for sent in found] == [b"down", b"abc", b"def", ANSWER, b"down"]


def test_every_recorded_character_of_a_run_is_there(tmp_path):
    path = tmp_path / "run.mcap"
    wires = [period.wire for period in periods(5)]
    path.write_bytes(recording(wires))
    found = read(path)[0]
    assert sorted(run.data for run in found) == sorted(run.data for wire in wires for run in wire)


def test_a_recording_cut_short_anywhere_gives_what_came_before_and_the_offset(tmp_path):
    whole = recording([(down(index * PERIOD),) for index in range(12)])
    path = tmp_path / "run.mcap"
    counts = []
    for size in range(8, len(whole), 97):
        path.write_bytes(whole[:size])
        notes = []
        found, _, error = read(path, notes.append)
        said = str(error) if error is not None else notes[0]
        assert re.search("the file ends in the middle of a record|the recording has no end", said)
        offset = re.search(r"offset (\d+)", said)
        assert int(offset[1]) <= size
        assert [run.tick for run in found] == [index * PERIOD for index in range(len(found))]
        counts.append(len(found))
    assert counts == sorted(counts)
    assert set(counts) == set(range(13))  # not all or nothing: a chunk gives what is in it


WHOLE = recording([(down(index * PERIOD),) for index in range(3)])


@settings(max_examples=100)
@given(st.integers(0, len(WHOLE) - 1), st.integers(0, 7))
def test_one_wrong_bit_anywhere_is_reported_after_what_could_be_read(at, bit):
    data = bytearray(WHOLE)
    data[at] ^= 1 << bit
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        path.write_bytes(data)
        error = read(path)[2]
    kinds = ("damaged record", "not an MCAP file", "recording format")
    assert any(kind in str(error) for kind in kinds)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: b"hello world", "offset 0: not an MCAP file"),
        (lambda data: data[:5], "offset 0: the file ends in the middle of a record; it was cut short"),
        (lambda data: data + b"x", "there are bytes after the end"),
        (lambda data: data.replace(b'"direction":">"', b'"direction":"!"'), "damaged record"),
        (lambda data: foreign_mcap(), "not a recording of this program"),
    ],
)
def test_what_is_no_whole_recording_is_named_with_its_place(tmp_path, change, message):
    path = tmp_path / "run.mcap"
    path.write_bytes(change(recording([(down(5),)])))
    error = read(path)[2]
    assert message in str(error)


def test_a_scenario_of_another_version_only_leaves_the_layout_open(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(recording([(down(5),)], text="[[tomorrow]]\n"))
    found, robots, error = read(path)
    assert (len(found), robots, error) == (1, {}, None)
