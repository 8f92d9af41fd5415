"""When a failure became inevitable: branches, the search for the jump, the command and the files that it leaves."""

import itertools
import re

import pytest
from msgspec.structs import replace

from miro_protocol.actions import Reseed
from miro_sim.scenario.file import load
from mirotwin.campaign import branches
from mirotwin.campaign.branches import FROM_START, Point, branch, branched, has_failed, search
from mirotwin.recording.reader import read
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.outputs import OutputFolder
from mirotwin.verify.checks.expect import expectations_in
from tests.mirotwin.campaign.race import PLACE, racing
from tests.mirotwin.program import mirotwin
from tests.sim.world.rig import PERIOD, image

LOSSY = ("network.radio.bit_error_rate=5e-3", "duration_s=0.2")
FEW_FRAMES = "frames_accepted_min=2"
SEEDS = range(50, 58)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def lossy(expect=FEW_FRAMES, seed=2):
    """Half of the seeds get fewer than two frames across; 2 is one of them."""
    text = load("fig6", (*LOSSY, f"expect.{expect}"))
    spec = RunSpec.of(text, image(), seed)
    return replace(spec, expected=expectations_in(text))


@pytest.mark.parametrize("tick", [FROM_START, 0, 2 * PERIOD, 4 * PERIOD])
def test_copies_of_a_process_do_what_runs_from_the_start_do(tick):
    spec = lossy()
    alone = [has_failed(Run(branch(spec, tick, seed)).play(), "frames_accepted_min") for seed in SEEDS]
    assert branched(spec, "frames_accepted_min", tick, SEEDS, jobs=3).failed == tuple(alone)
    assert tick == 4 * PERIOD or len({*alone}) == 2


def test_without_copies_it_is_the_same(monkeypatch):
    spec = lossy()
    copied = branched(spec, "frames_accepted_min", 2 * PERIOD, SEEDS, jobs=2)
    monkeypatch.setattr(branches, "CAN_COPY", False)
    assert branched(spec, "frames_accepted_min", 2 * PERIOD, SEEDS) == copied


def test_what_a_check_has_seen_goes_into_the_branch():
    spec = lossy("tracks_within_cm={limit_cm = 1.0, from_s = 0.0}")
    assert branched(spec, "tracks_within_cm", 5 * PERIOD, SEEDS).share == 1.0


def test_a_branch_that_breaks_is_an_error_and_no_verdict(monkeypatch):
    monkeypatch.setattr(branches, "has_failed", lambda run, name: 1 / 0)
    with pytest.raises(RuntimeError, match="a branch ended with exit code 70"):
        branched(lossy(), "frames_accepted_min", PERIOD, SEEDS[:2])


def test_the_recording_of_a_branch_replays_to_the_same_bits(here):
    run = Run(branch(lossy(), 2 * PERIOD, 99)).play()
    run.write(OutputFolder(here / "run"))
    actions = [action for period in read(here / "run" / "run.mcap").periods for action in period.actions]
    assert actions == [Reseed(2 * PERIOD + 120, 0, 99)]
    assert "equals the recorded one" in mirotwin.succeeds("replay", "run", "-q")


def stepping(at, below=0.1):
    """Branches of a run that is decided in control period `at`; the list gets what was looked at."""
    looked = []

    def point(index):
        looked.append(index)
        share = 1.0 if index > at else below
        return Point(index * PERIOD, tuple(number < 20 * share for number in range(20)))

    return point, looked


@pytest.mark.parametrize("end", [1, 2, 7, 180, 5000])
def test_the_search_finds_the_period_with_few_points(end):
    for at in {0, end // 3, end // 2, end - 1}:
        point, looked = stepping(at)
        points, low = search(point, end, min(8, end), lambda point: None)
        assert low == at
        assert len(looked) == len({*looked}) <= 9 + end.bit_length() + 4
        assert [one.tick for one in points] == sorted(index * PERIOD for index in looked)
        assert {at * PERIOD, (at + 1) * PERIOD} <= {one.tick for one in points}


def test_a_run_that_is_lost_from_the_start_has_no_jump():
    point, _ = stepping(3, below=0.9)
    assert search(point, 40, 8, lambda point: None)[1] == -1


WHY = ("why", "fig6", "--seed", 2, "--expect", FEW_FRAMES, "--branches", 8, "-q")
WHY += tuple(itertools.chain.from_iterable(("--set", one) for one in LOSSY))
FILES = ("fails.stream", "passes.stream", "why.html")


def test_the_two_branches_replay_to_their_verdicts(here):
    out = mirotwin.succeeds(*WHY, "--jobs", 1, "--out", "a")
    assert re.search(
        r"^decided in control period \d+, .* s to .* s: from 0\.\d+ to [01]\.\d+", out, re.MULTILINE
    )
    code, _, err = mirotwin("replay", "a/fails.stream", "-q")
    assert (code, err.split(":")[1].strip()) == (1, "fails as recorded")
    mirotwin.succeeds("replay", "a/passes.stream", "-q")
    branch, other = ((here / "a" / name).read_text().split() for name in FILES[:2])
    assert branch[branch.index("reseed") - 2] == other[other.index("reseed") - 2]  # from the same moment on


@pytest.mark.slow
def test_the_files_are_the_same_whoever_makes_them(here, monkeypatch):
    mirotwin.succeeds(*WHY, "--jobs", 3, "--out", "a")
    monkeypatch.setattr(branches, "CAN_COPY", False)
    mirotwin.succeeds(*WHY, "--out", "b")
    for name in FILES:
        assert (here / "b" / name).read_bytes() == (here / "a" / name).read_bytes().replace(b"a/", b"b/")


@pytest.mark.slow
def test_a_recording_has_the_curve_of_its_scenario(here):
    settings = itertools.chain.from_iterable(("--set", one) for one in LOSSY)
    mirotwin(
        "run", "fig6", "--seed", 2, *settings, "--expect", FEW_FRAMES, "--out", "run", "-q", "--no-figure"
    )
    mirotwin.succeeds("why", "run", "--branches", 8, "-q", "--out", "a")
    mirotwin.succeeds(*WHY, "--out", "b")
    pages = [(here / name / "why.html").read_text() for name in "ab"]
    tables = {re.search("<table>.*</table>", page, re.DOTALL)[0] for page in pages}
    assert len(tables) == 1


@pytest.mark.slow
def test_a_case_that_it_left_can_be_asked_again(here):
    mirotwin.succeeds(*WHY, "--out", "a")
    out = mirotwin.succeeds("why", "a/fails.stream", "--branches", 8, "-q", "--out", "b")
    assert "fails: frames_accepted_min: net0/robot0" in out


def test_a_run_that_does_not_fail_is_refused(here):
    line = mirotwin.refuses("why", "fig6", "--set", "duration_s=0.2", "-q")
    assert line.startswith("fig6: does not fail with seed 0; ")
    assert not (here / "runs").exists()


@pytest.mark.slow
def test_a_firmware_race_is_a_step(here):
    assert racing().image.read_bytes() == PLACE.read_bytes()
    out = mirotwin.succeeds("why", "fig6", "--seed", 11, "--firmware", PLACE, "--branches", 40, "-q")
    before, after = map(float, re.search(r"from (\S+) to (\S+);", out).groups())
    assert before < 0.5
    assert after == 1.0


@pytest.mark.slow
def test_a_lossy_radio_is_a_slope(here):
    noisy = ("--set", "network.radio.bit_error_rate=5e-3", "--expect", "tracks_within_cm=9")
    out = mirotwin.succeeds("why", "fig6", "--seed", 190, *noisy, "--branches", 40, "-q")
    before, after = map(float, re.search(r"from (\S+) to (\S+);", out).groups())
    assert before < 0.5 <= after < 0.9
