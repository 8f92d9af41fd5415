"""Many runs: rows in the order of their jobs, whoever made them, and what is left when something goes wrong."""

import contextlib
import multiprocessing
import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.campaign.execute import in_order
from mirotwin.campaign.job import Job, Row, run
from mirotwin.campaign.processes import processes
from mirotwin.campaign.seeds import seeds_of
from mirotwin.recording.reader import read
from mirotwin.recording.track import Tracks
from mirotwin.report.summary import tracking_of

SHORT = "duration_s=1.0"


def job(label="a", seed=0, *settings):
    return Job(label, "fig7", (SHORT, *settings), seed)


def test_a_row_says_what_the_run_itself_says():
    row = run(job(seed=3))
    world, tracks = World(load("fig7", (SHORT,)).scenario, 3, load_hex(image_path())), Tracks()
    while not world.finished:
        tracks.add(world.step())
    (track,) = tracks.robots.values()
    tracking = tracking_of(track.errors)
    assert row.digest == tracks.digest
    assert (row.rms_position_cm, row.rms_x_cm) == (tracking.rms_position_cm, tracking.rms_x_cm)
    assert row.settling_s == tracking.settling_s
    assert row.error == ""


def test_without_delay_noise_and_error_the_camera_sees_the_truth():
    exact = "camera={kind = 'gaussian', position_error_cm = 0.0, heading_error_deg = 0.0, pixel_cm = 0.0}"
    row = run(job("a", 1, exact))
    assert row.seen_position_cm == pytest.approx(row.rms_position_cm, rel=0.1)
    late = run(job("a", 1, exact.replace("}", ", delay_frames = 3}")))
    assert late.seen_position_cm == pytest.approx(late.rms_position_cm, rel=0.2)


def test_rows_come_in_the_order_of_the_jobs_and_are_the_same_from_processes():
    jobs = [job("a", seed) for seed in range(3)] + [job("b", 0, "network.robot.start_error_x_cm=40.0")]
    alone = [run(one) for one in jobs]
    assert list(in_order(run, jobs, processes(2), 3)) == alone
    assert [(row.label, row.seed) for row in alone] == [("a", 0), ("a", 1), ("a", 2), ("b", 0)]


def test_a_run_that_cannot_be_made_is_a_row_with_its_error_and_costs_no_other():
    found = list(in_order(run, [job("a", 0, "network.robot.slot=9"), job("b")], processes(1), 2))
    assert "slot" in found[0].error
    assert found[0].digest == ""
    assert found[1].error == ""


def test_a_recording_is_that_of_the_run(tmp_path):
    path = tmp_path / "one.mcap"
    row = run(Job("a", "fig7", (SHORT,), 2, str(path)))
    assert read(path).digest == row.digest


def test_whoever_stops_asking_leaves_no_job_behind():
    made = []

    def slow(one):
        time.sleep(0.02)
        made.append(one.seed)
        return Row(one.label, one.scenario, one.seed)

    executor = ThreadPoolExecutor(1)
    asking = in_order(slow, [job("a", seed) for seed in range(100)], executor, 4)
    assert next(asking).seed == 0
    asking.close()
    assert len(made) < 6
    with pytest.raises(RuntimeError):
        executor.submit(slow, job())


def ended(one):
    """A job that ends its process, as running out of memory does."""
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_process_that_is_killed_is_told_in_a_line():
    with pytest.raises(BadInput, match="--jobs: a process that made rows has ended"):
        list(in_order(ended, [job()], processes(1), 1))


def test_the_processes_ignore_ctrl_c_from_their_first_instruction():
    before = signal.getsignal(signal.SIGINT)
    executor = processes(2)
    try:
        for child in multiprocessing.active_children():
            os.kill(child.pid, signal.SIGINT)
        assert next(in_order(run, [job()], executor, 1)).error == ""
    finally:
        executor.shutdown()
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
