"""Workers that end, hang behind or are not like this process: a campaign goes on, or ends in a line."""

import gc
import os
import signal
import sys
import threading
from concurrent.futures import Executor, Future
from pathlib import Path

import pytest
from msgspec.structs import replace

import mirotwin
from miro_exact import engine
from miro_exact.bad_input import BadInput
from miro_sim.world.world import World
from mirotwin import campaign
from mirotwin.campaign.drive import Drive
from mirotwin.campaign.versions import NOT_OF_RUNS
from mirotwin.campaign.worker import RunOutcome, work
from mirotwin.campaign.workers import Processes, Workers
from tests import children
from tests.mirotwin.campaign.plans import SHORT, InThisProcess, plan_of, rows

pytestmark = pytest.mark.slow

pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")


def killing(job):
    """Ends its process in run 4, as running out of memory does."""
    if job.run == 4:
        os.kill(os.getpid(), signal.SIGKILL)
    return work(job)


def test_a_run_that_ends_its_process_each_time_is_a_row_and_costs_no_other(monkeypatch, tmp_path, alone):
    monkeypatch.setattr("mirotwin.campaign.drive.work", killing)
    path = tmp_path / "short.parquet"
    campaign.run(plan_of(), path, Processes(1))
    found, whole = rows(path), rows(alone)
    assert "ended the process that ran it" in found[4]["error"]
    assert found[4]["verdict"] == "error"
    assert [*found[:4], *found[5:]] == [*whole[:4], *whole[5:]]


def test_a_process_keeps_nothing_of_the_runs_that_it_has_done():
    def worlds():
        gc.collect()
        return len([one for one in gc.get_objects() if isinstance(one, World)])

    before, plan = worlds(), plan_of()
    for number in range(plan.runs):
        assert not work(plan.work(number)).error
    assert worlds() == before


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
    assert (tally.done, tally.verdicts) == (40, {"passed": 40})
    whole = {(row["network.radio.bit_error_rate"], row["seed"]): row["digest"] for row in rows(alone)}
    found = {(row["network.radio.bit_error_rate"], row["seed"]): row["digest"] for row in rows(path)}
    assert whole.items() <= found.items()


def test_workers_that_end_at_once_end_the_campaign_in_a_line(monkeypatch, tmp_path):
    monkeypatch.setattr("mirotwin.campaign.drive.FRUITLESS", 2)

    class Broken(Processes):
        def start(self):
            executor = super().start()
            executor._broken = "by this test"
            return executor

    with pytest.raises(BadInput, match="--jobs: workers have ended"):
        campaign.run(plan_of(), tmp_path / "short.parquet", Broken(1))


def test_a_worker_with_another_version_or_firmware_is_refused_by_name(monkeypatch, tmp_path):
    plan = plan_of()
    other = replace(plan, versions=replace(plan.versions, mirotwin="0.0.7"))
    with pytest.raises(BadInput, match=r"worker .* has mirotwin .* instead of 0\.0\.7"):
        campaign.run(other, tmp_path / "a.parquet", InThisProcess())
    other = replace(plan, versions=replace(plan.versions, code="0" * 12))
    with pytest.raises(BadInput, match=r"worker .* has other sources of mirotwin"):
        campaign.run(other, tmp_path / "b.parquet", InThisProcess())
    images = {"": replace(plan.images[""], sha256="0" * 64)}
    with pytest.raises(BadInput, match=r"worker .* has another firmware \(the robot's own: sha256"):
        campaign.run(replace(plan, images=images), tmp_path / "c.parquet", InThisProcess())


def test_a_worker_loads_no_hot_module_before_its_engine_is_chosen():
    script = (
        "import sys, mirotwin.campaign.worker, mirotwin.campaign.workers\n"
        "from miro_exact import engine\n"
        "print(sorted(set(engine.install().sources) & set(sys.modules)))"
    )
    done = children.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_a_run_uses_no_source_that_is_left_out_of_the_hash_of_its_sources():
    script = (
        "import sys; from tests.mirotwin.campaign.plans import plan_of\n"
        "from mirotwin.campaign.worker import work\n"
        "from mirotwin.campaign.versions import NOT_OF_RUNS\n"
        "assert not work(plan_of().work(0)).error\n"
        "rooms = tuple(f\"mirotwin.{name.replace('/', '.')}.\" for name in NOT_OF_RUNS)\n"
        "print([name for name in sys.modules if name.startswith(rooms)])"
    )
    done = children.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    assert all((Path(mirotwin.__file__).parent / name).is_dir() for name in NOT_OF_RUNS)


def test_the_uncompiled_engine_writes_the_same_bytes(tmp_path):
    (tmp_path / "short.toml").write_text(SHORT.replace("3-5", "3").replace("0.3", "0.04"))
    command = [
        sys.executable,
        "-c",
        "from mirotwin.entry import main; main()",
        "campaign",
        "short.toml",
        "-q",
    ]
    for name in ("compiled", "python"):
        if name == engine.active() or name == "python":
            words = [*command, "--jobs", "1", "--engine", name, "--out", f"{name}.parquet"]
            children.run(words, cwd=tmp_path, check=True)
    assert (tmp_path / f"{engine.active()}.parquet").read_bytes() == (
        tmp_path / "python.parquet"
    ).read_bytes()


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
