"""The characters in a recording, every one in the order of time, and transmissions as rows of frames."""

import re
import tracemalloc
from io import BytesIO
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS
from miro_protocol.events import Damaged, Reason, Received
from miro_protocol.frames import TeamFrame, TelemetryFrame, encode
from miro_protocol.transmission import Transmission
from miro_sim.periods import Period
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.recording.capture import recorded
from mirotwin.recording.capture.forms import FORMS
from mirotwin.recording.capture.input import Input
from mirotwin.recording.capture.rows import DecodedRow, rows
from mirotwin.recording.capture.source import READ_ERRORS, open_capture
from mirotwin.recording.container import RecordingError
from mirotwin.recording.reader import parse
from mirotwin.recording.recorder import Recorder, RunSource
from mirotwin.runs import runner
from tests.sim.world.rig import image

PERIOD = 800_800
UP = 24_960
ANSWER = encode(TelemetryFrame(3, 1), 3)
TEXT = load("fig6").text


def recording(wires, text=TEXT):
    stream = BytesIO()
    with Recorder(stream, RunSource("x", text, 1, b"", "")) as recorder:
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


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Writes a recording, and gives its path."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"

    def call(data):
        path.write_bytes(data)
        return path

    return call


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


def test_runs_come_in_the_order_of_time_with_the_layout_of_their_network(saved):
    wires = [(down(100), down(PERIOD + 50), up(90, b"a")), (down(PERIOD + 10, network=1),)]
    found, robots, error = read(saved(recording(wires)))
    assert error is None
    assert [run.tick for run in found] == [90, 100, PERIOD + 10, PERIOD + 50]
    assert [(run.direction, run.network) for run in found] == [("<", 0), (">", 0), (">", 1), (">", 0)]
    assert robots == {0: 3}


@pytest.mark.parametrize("cuts", [[], [1], [18], [5, 9], [1, 2, 3]])
def test_an_answer_that_goes_on_over_the_end_of_periods_is_one_run(saved, cuts):
    places = [0, *cuts, len(ANSWER)]
    wires = [(up(7 + start * UP, ANSWER[start:end]),) for start, end in pairwise(places)]
    assert read(saved(recording([*wires, ()])))[0] == [up(7, ANSWER)]


def test_bad_stop_bits_are_told_wherever_they_are(saved):
    first = up(7, ANSWER[:8], bad_stop=(2, 7))
    second = up(7 + 8 * UP, ANSWER[8:], bad_stop=(0, 10))
    assert read(saved(recording([(first,), (second,)])))[0] == [up(7, ANSWER, bad_stop=(2, 7, 8, 18))]


def test_what_comes_after_a_pause_is_another_transmission(saved):
    sent = [up(7, b"abc"), up(7 + 3 * UP + 1300, b"de"), up(7 + 9 * UP, b"f", 1), up(7 + 20 * UP, b"g")]
    assert read(saved(recording([tuple(sent[:1]), tuple(sent[1:]), ()])))[0] == sent


def test_periods_in_memory_give_the_same_as_their_recording(saved):
    first = (down(5), up(7, b"abc"), up(7 + 5 * UP, b"de"), up(7 + 9 * UP, ANSWER[:4], 1, (3,)))
    second = (down(PERIOD + 9), up(7 + 7 * UP, b"f"), up(7 + 13 * UP, ANSWER[4:], 1))
    wires = enumerate((first, second))
    found = recorded.transmissions_of([Period(index, index * PERIOD, (), wire, "") for index, wire in wires])
    assert found == read(saved(recording([first, second, ()])))[0]
    assert [sent.data for sent in found] == [b"down", b"abc", b"def", ANSWER, b"down"]


def test_a_recording_cut_short_anywhere_gives_what_came_before_and_the_offset(saved):
    whole = recording([(down(index * PERIOD),) for index in range(12)])
    counts = []
    for size in range(8, len(whole), 97):
        notes = []
        found, _, error = read(saved(whole[:size]), notes.append)
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
def test_one_wrong_bit_anywhere_is_reported_after_what_could_be_read(saved, at, bit):
    data = bytearray(WHOLE)
    data[at] ^= 1 << bit
    error = read(saved(data))[2]
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
def test_what_is_no_whole_recording_is_named_with_its_place(saved, change, message):
    assert message in str(read(saved(change(recording([(down(5),)]))))[2])


def test_a_scenario_of_another_version_only_leaves_the_layout_open(saved):
    found, robots, error = read(saved(recording([(down(5),)], text="[[tomorrow]]\n")))
    assert (len(found), robots, error) == (1, {}, None)


def noisy_recording(seed):
    """The recording of a noisy run, and start and body of the answers that the PC took."""
    world = World(load("fig6", ("network.radio.bit_error_rate=5e-3",)).scenario, seed, image())
    stream = BytesIO()
    with Recorder(stream, RunSource("x", "", seed, b"", "")) as recorder:
        runner.run(world, recorder, move=lambda: world.run_to(151 * CONTROL_PERIOD_TICKS))
    answers = [event.frame for _, event in world.networks[0].log.since(0) if event.what == "answer"]
    return stream.getvalue(), [(answer.start_tick, answer.body) for answer in answers if answer is not None]


@pytest.mark.parametrize("seed", range(6))
def test_the_answers_in_a_recording_are_those_that_the_pc_took(saved, seed):
    data, answers = noisy_recording(seed)
    listed = rows(read(saved(data))[0], lambda network: 3)
    found = [row.event for row in listed if row.direction == "<" and isinstance(row.event, Received)]
    assert [event.body for event in found] == [body for _, body in answers]
    # Behind a bad stop bit in the preamble the PC takes its next start edge a part of a bit later than it was sent.
    bit = HOST_CHARACTER_TICKS // 10
    assert all(abs(event.start_tick - tick) < bit for event, (tick, _) in zip(found, answers, strict=True))
    assert answers
    assert recorded.transmissions_of(parse(data, "run.mcap").periods) == read(saved(data))[0]


@pytest.mark.parametrize("place", [5, 12, 18])
def test_an_answer_refused_for_one_stop_bit_even_its_last_is_listed_as_refused(mirotwin, saved, place):
    path = saved(recording([(up(90_000, ANSWER, bad_stop=(place,)), up(900_000, ANSWER))]))
    exported = path.with_name("run.stream")
    mirotwin.ends(0, "export", path, "--out", exported, "-q", "--force")
    for file in (path, exported):
        out = mirotwin("decode", file, "--robots", "3")[1]
        assert "1 telemetry; 1 damaged run of 19 bytes (1 bad stop bit)" in out


CHARACTER = 25_000


def team(seq, n=3):
    return encode(TeamFrame(0, seq, ((seq, -seq),) * n), n)


def decoded(sent, n=3):
    return list(rows(sent, lambda network: n))


def decoded_file(path, format):
    """Everything in a file, and the error it ends with."""
    found = []
    with Input(str(path)) as given:
        try:
            for row in rows(open_capture(given, print, form=FORMS[format]).sent, lambda network: 3):
                found.append(row)
        except READ_ERRORS as error:
            return found, error
    return found, None


@settings(max_examples=200)
@given(
    st.binary(max_size=200),
    st.sampled_from([b"", b"\x89MCAP0\r\n", b"\x0a\x0d\x0d\x0a"]),
    st.sampled_from([*FORMS]),
)
def test_any_bytes_in_any_format_give_rows_and_at_most_the_formats_own_error(
    tmp_path_factory, data, magic, format
):
    path = tmp_path_factory.mktemp("any") / "a"
    path.write_bytes(magic + data)
    found, error = decoded_file(path, format)
    assert error is None or str(error).startswith(str(path))
    assert all(isinstance(row, DecodedRow) for row in found)


def test_freshness_is_judged_as_the_robot_does():
    sent = [Transmission(at * 800_800, ">", team(seq)) for at, seq in enumerate([0, 1, 1, 20, 2])]
    sent.append(Transmission(10 * 800_800, ">", team(30)))
    assert [row.fresh for row in decoded(sent)] == [True, True, False, False, True, True]


def test_both_directions_and_networks_are_decoded_apart():
    answer = encode(TelemetryFrame(0, 1), 3)
    sent = []
    for at in range(0, 23, 5):  # five characters of each in turn
        sent.append(Transmission(at * CHARACTER, ">", team(7)[at : at + 5]))
        sent.append(Transmission(at * CHARACTER, ">", team(8)[at : at + 5], 1))
        if answer[at : at + 5]:
            sent.append(Transmission(at * 24960, "<", answer[at : at + 5]))
    found = decoded(sent)
    data = {(row.network, row.direction): row.event.data for row in found}
    assert data == {(0, "<"): answer, (0, ">"): team(7), (1, ">"): team(8)}
    assert len(found) == 3


def test_a_pause_of_two_characters_gives_out_what_can_be_no_frame_any_more():
    first, second = decoded([Transmission(0, ">", team(1)[:-1]), Transmission(24 * CHARACTER, ">", team(2))])
    assert first.event == Damaged(team(1)[:-1], Reason.CUT_SHORT, 0)
    assert isinstance(second.event, Received)


def test_a_bad_stop_bit_spoils_the_frame_it_is_in():
    wire = team(1)
    for place in range(6, len(wire)):
        (row,) = decoded([Transmission(0, ">", wire, 0, (place,))])
        assert row.event == Damaged(wire, Reason.BAD_STOP_BIT, 0)


def test_a_frame_that_says_nothing_known_is_a_frame_all_the_same():
    wire = encode(TelemetryFrame(3, 4), 5)  # slot 4 in a network of three
    (row,) = decoded([Transmission(0, "<", wire)])
    assert row.message is None
    assert "slot = 4" in row.unknown


def test_memory_does_not_grow_with_the_input(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(bytes(range(256)) * (1 << 14))  # 4 MiB
    with Input(str(path)) as given:
        tracemalloc.start()
        for _ in rows(open_capture(given, print, form=FORMS["raw"]).sent, lambda network: 3):
            pass
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < 1 << 20
