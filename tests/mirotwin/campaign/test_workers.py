"""Runs alone and in workers, and workers that end, hang behind or are not like this process."""

import gc
import multiprocessing
import os
import pickle
import shutil
import signal
import sys
import threading
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

import mirotwin
from miro_exact import engine
from miro_exact.bad_input import BadInput
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin import campaign
from mirotwin.campaign.design import Level
from mirotwin.campaign.drive import Drive, outcomes_of
from mirotwin.campaign.plan import plan_of_levels
from mirotwin.campaign.ranges import seeds_of
from mirotwin.campaign.single import run_single
from mirotwin.campaign.versions import NOT_OF_RUNS
from mirotwin.campaign.worker import RunOutcome, work
from mirotwin.campaign.workers import Processes, Workers, processes
from mirotwin.recording.reader import read
from mirotwin.recording.track import Tracks
from mirotwin.runs.summary import tracking_of
from tests import children
from tests.mirotwin import program
from tests.mirotwin.campaign.conftest import SHORT, InThisProcess, plan_of, rows

pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")


def jobs(seeds, *settings):
    plan = plan_of_levels("test", [Level("a", ("duration_s=1.0", *settings), "fig7")], seeds)
    return [plan.work(run) for run in range(plan.runs)]


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


def test_a_recording_is_that_of_the_run(tmp_path):
    path = tmp_path / "one.mcap"
    (job,) = jobs(range(2, 3))
    outcome = run_single(replace(job, recording=str(path)))
    assert read(path).digest == outcome.digest == run_single(job).digest


def test_a_job_carries_its_scenario_and_its_image_with_the_symbols(tmp_path):
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "mine.toml").write_text('scenario = "fig7"\nduration_s = 0.2\n')
    for suffix in (".ihx", ".map", ".cdb"):
        shutil.copy(image_path().with_suffix(suffix), folder / f"mine{suffix}")
    (folder / "campaign.toml").write_text(
        'scenario = "mine.toml"\n[grid]\nfirmware = ["", "mine.ihx"]\n[expect]\nmain_loop_alive = true\n'
    )
    plan = campaign.load(folder / "campaign.toml")
    shutil.rmtree(folder)
    own, other = (work(pickle.loads(pickle.dumps(plan.work(run)))) for run in range(2))
    assert own.verdict == "passed"
    assert own.checks["main_loop_alive"] == "passed"  # which needs a symbol
    assert (other.digest, other.checks, other.figures) == (own.digest, own.checks, own.figures)


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


def test_outcomes_come_in_the_order_of_the_jobs(monkeypatch):
    def the_first_takes_longest(job):
        time.sleep(0.3 * (job.run == 0))
        return RunOutcome(job.run)

    monkeypatch.setattr("mirotwin.campaign.drive.work", the_first_takes_longest)
    with ThreadPoolExecutor(2) as executor:
        found = outcomes_of(4 * jobs(range(1)), Workers(executor))
        assert [one.run for one in found] == [0, 1, 2, 3]


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


@pytest.mark.parametrize("text", ["", "-", "9-0", "a", "0-49-50", "0:50", "0-1000", "1" * 41, "0-\n"])
def test_what_is_no_range_of_seeds_is_refused_in_a_line(text):
    with pytest.raises(ValueError, match=r"^[^\n]*\Z"):
        seeds_of(text)


@given(st.text(max_size=60))
def test_any_text_is_a_range_of_seeds_or_refused_in_a_line(text):
    said = ""
    try:
        assert 1 <= len(seeds_of(text)) <= 1000
    except ValueError as error:
        said = str(error)
    assert "\n" not in said


# Workers that end, or are not like this process


def killing(job):
    """Ends its process in run 4, as running out of memory does."""
    if job.run == 4:
        os.kill(os.getpid(), signal.SIGKILL)
    return work(job)


@pytest.mark.slow
def test_a_run_that_ends_its_process_each_time_is_a_row_and_costs_no_other(monkeypatch, tmp_path, alone):
    monkeypatch.setattr("mirotwin.campaign.drive.work", killing)
    path = tmp_path / "short.parquet"
    campaign.run(plan_of(), path, Processes(1))
    found, whole = rows(path), rows(alone)
    assert "ended the process that ran it" in found[4]["error"]
    assert found[4]["verdict"] == "error"
    assert [*found[:4], *found[5:]] == [*whole[:4], *whole[5:]]


@pytest.mark.slow
def test_a_process_keeps_nothing_of_the_runs_that_it_has_done():
    def worlds():
        gc.collect()
        return len([one for one in gc.get_objects() if isinstance(one, World)])

    before, plan = worlds(), plan_of()
    for number in range(plan.runs):
        assert not work(plan.work(number)).error
    assert worlds() == before


@pytest.mark.slow
def test_a_worker_that_is_killed_in_the_middle_loses_nothing(alone, tmp_path):
    path = tmp_path / "short.parquet"
    executors, killed = [], []

    class Watched(Processes):
        def start(self):
            executors.append(super().start())
            return executors[-1]

    def kill(tally, outcome):
        if tally.new == 5:
            process = next(iter(executors[0]._processes.values()))
            killed.append(process.pid)
            os.kill(process.pid, signal.SIGKILL)

    text = SHORT.replace("3-5", "0-19")
    tally = campaign.run(plan_of(text), path, Watched(2), on_outcome=kill)
    assert killed
    assert (tally.done, [row["verdict"] for row in rows(path)]) == (40, ["passed"] * 40)
    whole = {(row["network.radio.bit_error_rate"], row["seed"]): row["digest"] for row in rows(alone)}
    found = {(row["network.radio.bit_error_rate"], row["seed"]): row["digest"] for row in rows(path)}
    assert whole.items() <= found.items()


@pytest.mark.slow
def test_workers_that_end_at_once_end_the_campaign_in_a_line(monkeypatch, tmp_path):
    monkeypatch.setattr("mirotwin.campaign.drive.MAX_DEAD_EXECUTORS", 2)

    class Broken(Processes):
        def start(self):
            executor = super().start()
            executor._broken = "by this test"
            return executor

    with pytest.raises(BadInput, match="--jobs: workers have ended"):
        campaign.run(plan_of(), tmp_path / "short.parquet", Broken(1))


@pytest.mark.slow
def test_a_worker_with_another_version_is_refused_by_name(tmp_path):
    plan = plan_of()
    other = replace(plan, versions=replace(plan.versions, mirotwin="0.0.7"))
    with pytest.raises(BadInput, match=r"worker .* has mirotwin .* instead of 0\.0\.7"):
        campaign.run(other, tmp_path / "a.parquet", InThisProcess())
    other = replace(plan, versions=replace(plan.versions, code="0" * 12))
    with pytest.raises(BadInput, match=r"worker .* has other sources of mirotwin"):
        campaign.run(other, tmp_path / "b.parquet", InThisProcess())


@pytest.mark.slow
def test_a_worker_loads_no_hot_module_before_its_engine_is_chosen():
    script = (
        "import sys, mirotwin.campaign.worker, mirotwin.campaign.workers\n"
        "from miro_exact import engine\n"
        "print(sorted(set(engine.install().sources) & set(sys.modules)))"
    )
    done = children.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


@pytest.mark.slow
def test_a_run_uses_no_source_that_is_left_out_of_the_hash_of_its_sources():
    script = (
        "import sys; from tests.mirotwin.campaign.conftest import plan_of\n"
        "from mirotwin.campaign.worker import work\n"
        "from mirotwin.campaign.versions import NOT_OF_RUNS\n"
        "assert not work(plan_of().work(0)).error\n"
        "rooms = tuple(f\"mirotwin.{name.replace('/', '.')}.\" for name in NOT_OF_RUNS)\n"
        "print([name for name in sys.modules if name.startswith(rooms)])"
    )
    done = children.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    assert all((Path(mirotwin.__file__).parent / name).is_dir() for name in NOT_OF_RUNS)


@pytest.mark.slow
def test_the_uncompiled_engine_writes_the_same_bytes(tmp_path):
    (tmp_path / "short.toml").write_text(SHORT.replace("3-5", "3").replace("0.3", "0.04"))
    for name in {engine.active(), "python"}:
        words = ("short.toml", "-q", "--jobs", "1", "--engine", name, "--out", f"{name}.parquet")
        program.run("campaign", *words, cwd=tmp_path, check=True)
    own, other = (tmp_path / f"{name}.parquet" for name in (engine.active(), "python"))
    assert own.read_bytes() == other.read_bytes()


@pytest.mark.slow
def test_at_most_so_many_runs_are_ahead_of_the_first_that_is_missing(monkeypatch):
    monkeypatch.setattr("mirotwin.campaign.drive.SPREAD", 10)
    held, handed = Future(), []

    class Holding(Executor):
        def submit(self, function, run):
            handed.append(run)
            if run == 0:
                return held
            if run == 9:
                threading.Timer(0.2, held.set_result, [RunOutcome(0)]).start()
            future = Future()
            future.set_result(RunOutcome(run))
            return future

    workers = Workers(Holding())
    workers.ahead = 4
    order = [outcome.run for outcome in Drive(lambda run: run, workers).outcomes(range(30))]
    assert sorted(order) == list(range(30))
    assert set(order[:9]) == set(range(1, 10))
    assert order.index(0) == 9


SCRIPT = """
{before}
from mirotwin import campaign

plan = campaign.parse('scenario = "fig6"\\nseeds = "0-7"\\nset = {{ duration_s = 0.1 }}\\n', "short.toml")
{guard}campaign.run(plan, "short.parquet", {executor})
"""


def script(folder, guard="", before="", executor="campaign.Processes(2)"):
    """What a script that makes a campaign ends with: exit code and stderr."""
    (folder / "script.py").write_text(SCRIPT.format(guard=guard, before=before, executor=executor))
    done = children.run([sys.executable, "script.py"], cwd=folder, capture_output=True, text=True)
    return done.returncode, done.stderr


def test_a_script_without_a_main_guard_ends_with_one_error_that_names_it(tmp_path):
    code, err = script(tmp_path)
    assert code == 1
    assert err.count("Traceback") == 1
    assert err.endswith('put the calls in your script below a line `if __name__ == "__main__":`\n')
    assert not (tmp_path / "short.parquet").exists()
    assert script(tmp_path, guard='if __name__ == "__main__":\n    ') == (0, "")
    assert len(rows(tmp_path / "short.parquet")) == 8


def test_an_executor_of_a_script_without_a_guard_names_it_too(tmp_path):
    before = "from concurrent.futures import ProcessPoolExecutor\nfrom multiprocessing import get_context"
    code, err = script(tmp_path, "", before, 'ProcessPoolExecutor(1, get_context("spawn"))')
    assert code == 1
    assert 'put the calls in your script below a line `if __name__ == "__main__":`' in err
    assert not (tmp_path / "short.parquet").exists()


def test_a_script_that_its_processes_cannot_import_blames_no_run(tmp_path):
    before = (
        "import multiprocessing\nif multiprocessing.current_process().name != 'MainProcess':\n"
        "    raise RuntimeError('not twice')"
    )
    code, err = script(tmp_path, 'if __name__ == "__main__":\n    ', before)
    assert code == 1
    assert "RuntimeError: not twice" in err
    assert (
        "campaign.run: its processes import your script first, which fails in them for the reason above"
        in err
    )
    assert err.count("RuntimeError: not twice") <= 2  # of each process, and no more are started
    assert not (tmp_path / "short.parquet").exists()
