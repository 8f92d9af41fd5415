"""The bench: two ears on one wire, trouble on it, and a state that can be carried on anywhere."""

import msgspec
import pytest

from miro_protocol import stream
from miro_protocol.frames import ServiceFrame, TeamFrame, TelemetryFrame
from miro_robot.firmware import image_path
from miro_robot.image import Symbol, Symbols, load_hex
from miro_robot.mcs51.line import Line
from miro_sim.radio.params import Radio
from mirotwin.testing.bench import MS, Bench, LinkFailure
from mirotwin.testing.noisy_wire import NoisyWire, Trouble
from tests.mirotwin.conftest import mirotwin
from tests.mirotwin.testing.noise import listen

__all__ = ["mirotwin"]
NOISY = Radio(bit_error_rate=3e-3)


def team(seq: int, n: int = 3, ask: bool = False) -> TeamFrame:
    return TeamFrame(3 if ask else 0, seq % 64, ((300, -300),) * n)


@pytest.mark.parametrize("n", [3, 5])
def test_frames_and_answers_go_both_ways(n):
    bench = Bench(n, n - 1)
    for seq in range(2 * n):
        bench.send(team(seq, n, ask=True))
    bench.wait(30 * MS)
    assert bench.counters == (2 * n, 0, 0)
    assert [answer for _, answer in bench.answers] == [
        TelemetryFrame(n - 1, n - 1, 0x10, accepted=n, status_left=0, status_right=0),
        TelemetryFrame(2 * n - 1, n - 1, 0, accepted=2 * n),
    ]


def test_a_noisy_run_is_counted_alike_and_repeats_to_the_bit():
    benches = [Bench(3, 0, NOISY, seed) for seed in (7, 7, 8)]
    for bench in benches:
        for seq in range(40):
            bench.send(team(seq, ask=seq % 2 == 0))
    first, again, other = benches
    assert first.digest() == again.digest() != other.digest()
    assert first.heard == again.heard
    accepted, rejected, stale = first.counters
    assert 10 < accepted < 30
    assert rejected > 0
    assert stale == 0


def test_a_burst_hits_the_frame_it_falls_into_and_no_other():
    bench = Bench()
    bench.send(team(0))
    bench.trouble("burst", 12 * MS, 3 * MS)
    bench.send(team(1))
    bench.send(team(2))
    assert bench.counters[0] == 2


def test_a_dropped_link_is_silence():
    bench = Bench()
    bench.trouble("mark", 0, 26 * MS)
    bench.send(team(0))
    assert (bench.counters, bench.heard) == ((0, 0, 0), [])
    bench.send(team(1))
    assert bench.counters == (1, 0, 0)


@pytest.mark.parametrize("n", [3, 5])
def test_slicer_noise_alone_is_never_taken_for_a_frame_by_the_firmware(n):
    """`python -m tests.mirotwin.testing.noise` listens for minutes."""
    bench = listen(10, n)
    assert len(bench.heard) > 7000
    assert bench.counters == (0, 0, 0)


def test_trouble_that_comes_too_late_is_refused():
    wire = NoisyWire(Line(), Line(), 0, "x")
    wire.trouble(Trouble(5, 10, "mark"))
    with pytest.raises(
        ValueError, match="disturbance at tick 7 overlaps another one that lasts until tick 10"
    ):
        wire.trouble(Trouble(7, 20, "burst"))


def test_after_a_reset_the_robot_counts_from_nothing_and_hears_on():
    bench = Bench(3, 0, NOISY, 3)
    for seq in range(5):
        bench.send(team(seq))
    bench.reset()
    assert bench.counters == (0, 0, 0)
    for seq in range(10):
        bench.send(team(seq))
    assert bench.counters[0] > 2


@pytest.mark.parametrize("part", range(0, 100, 9))
def test_a_bench_reloaded_at_any_place_goes_on_as_it_would_have(part):
    straight, cut = Bench(3, 0, NOISY, 11), Bench(3, 0, NOISY, 11)
    for bench in (straight, cut):
        bench.send(team(0, ask=True))
    end = straight.begin(b"\x55" * 5 + b"\xff\x2d\xd4 and more")
    assert cut.begin(b"\x55" * 5 + b"\xff\x2d\xd4 and more") == end
    middle = cut.now + (end - cut.now) * part // 100
    for bench in (straight, cut):
        bench.run_to(middle)
    cut = cut.reloaded()
    for bench in (straight, cut):
        bench.run_to(end)
        bench.send(ServiceFrame.ping(1, 0))
    assert cut.digest() == straight.digest()
    assert cut.heard == straight.heard


def test_a_count_that_differs_is_a_failure_with_what_was_heard():
    image = load_hex(image_path())
    names = dict(image.symbols.names)
    names["_frames_stale"] = names["_frames_rejected"]
    bench = Bench(image=msgspec.structs.replace(image, symbols=Symbols(names)))
    bench.send(team(5))
    with pytest.raises(LinkFailure, match=r"firmware counts \(1, 0, 0\) .*, Python \(1, 0, 1\)") as caught:
        bench.send(team(5))
    assert [entry.comment for entry in stream.parse(caught.value.stream).entries] == ["type=0 seq=5"] * 2


def test_an_image_without_counters_is_refused():
    image = msgspec.structs.replace(load_hex(image_path()), symbols=Symbols({"x": Symbol(1, "iram")}))
    with pytest.raises(ValueError, match=r"no symbol _frames_accepted in internal RAM; put the .map or .cdb"):
        Bench(image=image)


@pytest.mark.parametrize("seed", range(3))
def test_replay_of_what_the_robot_heard_counts_the_same(mirotwin, tmp_path, seed):
    bench = Bench(3, 1, NOISY, seed)
    for seq in range(25):
        bench.send(team(seq if seq % 5 else 0))
    stream.write(tmp_path / "heard.stream", bench.heard_stream())
    code, out, err = mirotwin("replay", tmp_path / "heard.stream")
    assert (code, err) == (0, "")
    row = out.splitlines()[-2].split()
    assert tuple(map(int, row[1:4])) == bench.counters


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"n": 3, "slot": 3}, "slot 3 does not exist"),
        ({"radio": Radio(jitter_s=0.001)}, "jitter and offsets"),
        ({"radio": Radio(baud_offset_ppm=100)}, "jitter and offsets"),
    ],
)
def test_a_bench_that_could_not_keep_its_promises_is_refused(arguments, said):
    with pytest.raises(ValueError, match=said):
        Bench(**arguments)
