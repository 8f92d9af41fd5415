"""`mirotwin run --save-at .. --resume .. --to ..`: a run that goes on has the bits of one that never stopped."""

import json

import pytest

from mirotwin.recording.reader import read

QUIET = ("--no-figure", "-q")


@pytest.fixture(scope="module")
def halves(mirotwin, short, tmp_path_factory):
    """The folders of a run that saved its world at 100 ms, and of one that went on from there."""
    whole, rest = (tmp_path_factory.mktemp(name) for name in ("whole", "rest"))
    mirotwin.succeeds("run", short, "--out", whole, "--save-at", "100ms", *QUIET)
    mirotwin.succeeds("run", short, "--out", rest, "--resume", whole / "at-2400000.world", *QUIET)
    return whole, rest


@pytest.mark.parametrize("at", ["2402400t", "2500001t", "100ms"])
def test_a_resumed_run_has_the_digests_of_one_that_never_stopped(mirotwin, tmp_path, short, at):
    whole, rest = tmp_path / "whole", tmp_path / "rest"
    assert mirotwin("run", short, "--out", whole, "--seed", 5, "--save-at", at, *QUIET)[0] == 0
    (saved,) = whole.glob("at-*.world")
    assert mirotwin("run", short, "--out", rest, "--seed", 5, "--resume", saved, *QUIET)[0] == 0
    periods, more = read(whole / "run.mcap").periods, read(rest / "run.mcap").periods
    assert more[1:] == periods[more[1].index :]
    assert more[0].digest == periods[more[0].index].digest
    assert more[0].index in (3, 4)
    mirotwin.succeeds("replay", rest / "run.mcap", "-q")


@pytest.mark.parametrize("to", ["4000000t", "4004000t", "4804800t"])
def test_a_resumed_run_that_is_told_where_to_end_has_the_digest_of_an_unbroken_one(
    mirotwin, tmp_path, short, to
):
    whole, rest = tmp_path / "whole", tmp_path / "rest"
    mirotwin("run", short, "--out", whole, "--save-at", "100ms", "--to", to, *QUIET)
    saved = whole / "at-2400000.world"
    assert mirotwin("run", short, "--out", rest, "--resume", saved, "--to", to, *QUIET)[0] == 0
    digests = [json.loads((run / "summary.json").read_text())["digest"] for run in (whole, rest)]
    assert digests[0] == digests[1]
    mirotwin.succeeds("replay", rest / "run.mcap", "-q")


def test_figures_of_a_resumed_run_say_what_time_they_cover(mirotwin, tmp_path, short):
    whole, rest = tmp_path / "whole", tmp_path / "rest"
    _, table, _ = mirotwin("run", short, "--out", whole, "--save-at", "100ms", "--no-figure")
    assert "rms (0.00 s to 0.20 s)" in table
    assert "resumed  " not in table
    saved = whole / "at-2400000.world"
    _, table, _ = mirotwin("run", short, "--out", rest, "--resume", saved, "--no-figure")
    assert "rms (0.10 s to 0.20 s)" in table
    assert "0.10 s to 0.20 s in " in table
    assert "resumed   at 0.10 s" in table
    summary = json.loads((rest / "summary.json").read_text())
    assert summary["resumed_s"] == 2_402_400 / 24e6
    assert summary["realtime_factor"] == (summary["simulated_s"] - summary["resumed_s"]) / summary["wall_s"]


def test_a_resumed_run_is_not_compared_with_a_whole_one(mirotwin, halves):
    said = mirotwin.refuses("diff", *(run / "run.mcap" for run in halves))
    assert "a run that was resumed: it begins with control period 3" in said


@pytest.mark.parametrize(
    "command",
    [["replay"], ["fw", "trace"], ["fw", "coverage"], ["fw", "vcd", "--out", "a.vcd"]],
    ids=" ".join,
)
def test_what_was_before_a_resumed_run_cannot_be_looked_at(mirotwin, halves, command):
    said = mirotwin.refuses(*command, halves[1] / "run.mcap", "--to", "100ms")
    assert said.endswith(": --to 2400000t: the run begins at tick 2402400; look later")


def test_a_resumed_run_is_looked_at_from_its_begin_on(mirotwin, halves):
    assert mirotwin("replay", halves[1] / "run.mcap", "--to", "2402401t")[0] == 0


def test_a_run_ends_where_it_is_told_to(mirotwin, tmp_path, short):
    assert mirotwin("run", short, "--out", tmp_path / "a", "--to", "2500000t", *QUIET)[0] == 0
    summary = json.loads((tmp_path / "a" / "summary.json").read_text())
    assert summary["simulated_s"] == 2_500_000 / 24e6
    assert len(read(tmp_path / "a" / "run.mcap").periods) == 3


@pytest.mark.parametrize(
    ("to", "frames", "verdict"),
    [
        ("10ms", 1, "not judged"),
        ("150ms", 1, "passed"),
        ("150ms", 99, "not judged"),
        ("4804800t", 99, "failed"),
    ],
)
def test_a_run_that_is_cut_short_does_not_fail_by_frames_to_come(
    mirotwin, tmp_path, short, to, frames, verdict
):
    expect = f"frames_accepted_min={frames}"
    code, _, err = mirotwin("run", short, "--out", tmp_path / "a", "--to", to, "--expect", expect, *QUIET)
    assert (code, f"expectation {verdict}: " in err) == (int(verdict == "failed"), verdict != "passed")
    found = json.loads((tmp_path / "a" / "summary.json").read_text())["expectations"]
    assert verdict in [one["verdict"] for one in found if one["name"] == "frames_accepted_min"]


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (("--save-at", "1s"), "--save-at 24000000t: the run goes from tick 0 to tick 4804800; give a tick between"),
        (("--to", "0t"), "--to 0t: the run goes from tick 0 to tick 4804800; give a tick between"),
        (("--save-at", "2s", "--to", "100ms"), "--save-at 48000000t: the run goes from tick 0 to tick 2400000"),
        (("--resume", "{saved}", "--seed", "6"), "cannot be resumed: the saved world has seed 5, this world has 6"),
        (("--resume", "{saved}", "--seed", "5", "--save-at", "1000t"), "the run goes from tick 2402400 to tick"),
        (("--resume", "{short}"), "cannot be resumed: not a saved world, or one of a version of this program"),
        (("--resume", "{saved}.none"), "no such file"),
        (("--save-at", "soon"), "'soon' is not a time; write 2s, 20ms, 341us or 5min, or 48000t for ticks."),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_refused_and_nothing_is_written(mirotwin, tmp_path, short, arguments, what):
    first = tmp_path / "first"
    mirotwin("run", short, "--out", first, "--seed", 5, "--save-at", "2402400t", *QUIET)
    given = [one.format(saved=first / "at-2402400.world", short=short) for one in arguments]
    err = mirotwin.refuses("run", short, "--out", tmp_path / "second", *given, *QUIET)
    assert what.lower() in err.lower()
    assert not (tmp_path / "second").exists()


def test_full_recordings_do_not_stop(mirotwin, tmp_path, short):
    err = mirotwin.refuses("run", short, "--out", tmp_path / "a", "--record", "full", "--to", "1000t")
    assert "do not go with --record full" in err
