"""`mirotwin run --save-at .. --resume .. --to ..`: a run that goes on has the bits of one that never stopped."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.mirotwin.cli.conftest import SHORT, Result

from mirotwin.recording.reader import read

QUIET = ("--no-figure", "-q")


@pytest.fixture
def short(tmp_path: Path) -> Path:
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.mark.parametrize("at", ["2402400t", "2500001t", "100ms"])
def test_a_resumed_run_has_the_digests_of_one_that_never_stopped(
    mirotwin: Callable[..., Result], tmp_path: Path, short: Path, at: str
) -> None:
    whole, rest = tmp_path / "whole", tmp_path / "rest"
    assert mirotwin("run", short, "--out", whole, "--seed", 5, "--save-at", at, *QUIET)[0] == 0
    (saved,) = whole.glob("at-*.world")
    assert mirotwin("run", short, "--out", rest, "--seed", 5, "--resume", saved, *QUIET)[0] == 0
    periods, more = read(whole / "run.mcap").periods, read(rest / "run.mcap").periods
    assert more[1:] == periods[more[1].index :]
    assert more[0].digest == periods[more[0].index].digest
    assert more[0].index in (3, 4)
    code, _, err = mirotwin("replay", rest / "run.mcap", "-q")
    assert (code, err) == (0, "")


def test_a_resumed_run_is_not_compared_with_a_whole_one(
    mirotwin: Callable[..., Result], tmp_path: Path, short: Path
) -> None:
    whole, rest = tmp_path / "whole", tmp_path / "rest"
    mirotwin("run", short, "--out", whole, "--save-at", "100ms", *QUIET)
    mirotwin("run", short, "--out", rest, "--resume", whole / "at-2400000.world", *QUIET)
    code, out, err = mirotwin("diff", whole / "run.mcap", rest / "run.mcap")
    assert (code, out) == (2, "")
    assert "a run that was resumed: it begins with control period 3" in err


def test_a_run_ends_where_it_is_told_to(mirotwin: Callable[..., Result], tmp_path: Path, short: Path) -> None:
    assert mirotwin("run", short, "--out", tmp_path / "a", "--to", "2500000t", *QUIET)[0] == 0
    summary = json.loads((tmp_path / "a" / "summary.json").read_text())
    assert summary["simulated_s"] == 2_500_000 / 24e6
    assert len(read(tmp_path / "a" / "run.mcap").periods) == 3


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (
            ("--save-at", "1s"),
            "--save-at 24000000t: the run goes from tick 0 to tick 4804800; give a tick between",
        ),
        (("--to", "0t"), "--to 0t: the run goes from tick 0 to tick 4804800; give a tick between"),
        (
            ("--save-at", "2s", "--to", "100ms"),
            "--save-at 48000000t: the run goes from tick 0 to tick 2400000",
        ),
        (
            ("--resume", "{saved}", "--seed", "6"),
            "cannot be resumed: the saved world has seed 5, this world has 6",
        ),
        (
            ("--resume", "{saved}", "--seed", "5", "--save-at", "1000t"),
            "the run goes from tick 2402400 to tick",
        ),
        (
            ("--resume", "{short}"),
            "cannot be resumed: not a saved world, or one of a version of this program",
        ),
        (("--resume", "{saved}.none"), "no such file"),
        (("--save-at", "soon"), "'soon' is not a time; write 2s, 20ms, 341us or 5min, or 48000t for ticks."),
    ],
)
def test_what_cannot_be_done_is_refused_and_nothing_is_written(
    mirotwin: Callable[..., Result], tmp_path: Path, short: Path, arguments: tuple[str, ...], what: str
) -> None:
    first = tmp_path / "first"
    mirotwin("run", short, "--out", first, "--seed", 5, "--save-at", "2402400t", *QUIET)
    given = [one.format(saved=first / "at-2402400.world", short=short) for one in arguments]
    code, _, err = mirotwin("run", short, "--out", tmp_path / "second", *given, *QUIET)
    assert code == 2
    assert what.lower() in err.lower()
    assert not (tmp_path / "second").exists()


def test_full_recordings_do_not_stop(mirotwin: Callable[..., Result], tmp_path: Path, short: Path) -> None:
    code, _, err = mirotwin("run", short, "--out", tmp_path / "a", "--record", "full", "--to", "1000t")
    assert code == 2
    assert "do not go with --record full" in err
