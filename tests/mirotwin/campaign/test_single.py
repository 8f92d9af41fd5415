"""Single runs and lists of them: outcomes in order, recordings, and what is left when nobody asks any more."""

import contextlib
import multiprocessing
import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.campaign.design import Level
from mirotwin.campaign.drive import outcomes_of
from mirotwin.campaign.plan import plan_of_levels
from mirotwin.campaign.ranges import seeds_of
from mirotwin.campaign.single import run_single
from mirotwin.campaign.worker import RunOutcome
from mirotwin.campaign.workers import Processes, Workers, processes
from mirotwin.recording.reader import read
from mirotwin.recording.track import Tracks
from mirotwin.report.summary import tracking_of

SHORT = "duration_s=1.0"


def jobs(seeds, *settings):
    plan = plan_of_levels("test", [Level("a", (SHORT, *settings), "fig7")], seeds)
    return [plan.work(run) for run in range(plan.runs)]


def without_times(outcomes):
    return [msgspec.structs.replace(one, wall_s=0.0) for one in outcomes]


def test_without_delay_noise_and_error_the_camera_sees_the_truth():
    exact = "camera={kind = 'gaussian', position_error_cm = 0.0, heading_error_deg = 0.0, pixel_cm = 0.0}"
    for camera, near in ((exact, 0.1), (exact.replace("}", ", delay_frames = 3}"), 0.2)):
        (job,) = jobs(range(1, 2), camera)
        found = run_single(job).figures
        assert found["seen_position_cm"] == pytest.approx(found["rms_position_cm"], rel=near)


def test_of_several_robots_the_worst_error_has_a_column(short):
    job = plan_of_levels("test", [Level("a", scenario=str(short))], range(5, 6)).work(0)
    world, tracks = World(load(str(short)).scenario, 5, load_hex(image_path())), Tracks()
    while not world.finished:
        tracks.add(world.step())
    errors = [tracking_of(track.errors).rms_position_cm for track in tracks.robots.values()]
    found = run_single(job).figures
    assert len(set(errors)) == 2
    assert (found["rms_position_cm"], found["worst_rms_position_cm"]) == (errors[0], max(errors))


@pytest.mark.slow
def test_outcomes_come_in_the_order_of_the_jobs_and_are_the_same_from_processes():
    plan = [*jobs(range(3)), *jobs(range(1), "network.robot.start_error_x_cm=40.0")]
    alone = [msgspec.structs.replace(run_single(one), run=run) for run, one in enumerate(plan)]
    assert without_times(outcomes_of(plan, Processes(2))) == without_times(alone)
    assert len({one.digest for one in alone}) == 4


def test_a_recording_is_that_of_the_run(tmp_path):
    path = tmp_path / "one.mcap"
    (job,) = jobs(range(2, 3))
    outcome = run_single(msgspec.structs.replace(job, recording=str(path)))
    assert read(path).digest == outcome.digest == run_single(job).digest


def test_whoever_stops_asking_leaves_no_job_behind(monkeypatch):
    made = []

    def slow(job):
        time.sleep(0.02)
        made.append(job.run)
        return RunOutcome(job.run)

    monkeypatch.setattr("mirotwin.campaign.drive.work", slow)
    with ThreadPoolExecutor(1) as executor:
        asking = outcomes_of(100 * jobs(range(1)), Workers(executor))
        assert next(asking).run == 0
        asking.close()
    assert len(made) < 7


def test_the_processes_ignore_ctrl_c_from_their_first_instruction():
    before = signal.getsignal(signal.SIGINT)
    with processes(2) as executor:
        for child in multiprocessing.active_children():
            os.kill(child.pid, signal.SIGINT)
        assert executor.submit(len, "ab").result() == 2
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize(("text", "seeds"), [("0-49", range(50)), ("7", range(7, 8)), ("3-3", range(3, 4))])
def test_seeds_are_written_with_the_last_one(text, seeds):
    assert seeds_of(text) == seeds


@given(st.text(max_size=60))
def test_any_other_text_is_refused(text):
    with contextlib.suppress(ValueError):
        assert 1 <= len(seeds_of(text)) <= 1000


@pytest.mark.parametrize("text", ["", "-", "9-0", "a", "0-49-50", "0:50", "0-1000", "1" * 41, "0-\n"])
def test_what_is_no_range_is_refused_in_a_line(text):
    with pytest.raises(ValueError, match=r"^[^\n]*\Z"):
        seeds_of(text)
