"""A Dask scheduler's workers: the same bytes as everywhere; one that is not like this process is refused by name."""

import contextlib
import logging
import os
import signal
import threading
import time
from concurrent.futures import Future

import pytest
from click.testing import CliRunner
from msgspec.structs import replace

from miro_exact.bad_input import BadInput
from mirotwin import campaign
from mirotwin.campaign import cluster as cluster_module
from mirotwin.campaign.journal import journal_path
from mirotwin.campaign.versions import versions
from mirotwin.campaign.workers import Workers
from mirotwin.commands import main
from tests.mirotwin.campaign.plans import SHORT, InThisProcess, plan_of

pytestmark = pytest.mark.slow

pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")
distributed = pytest.importorskip("distributed", reason="needs Dask: the extra cluster")


@contextlib.contextmanager
def running(count):
    """A scheduler with `count` workers, each a process."""
    with distributed.LocalCluster(
        n_workers=count,
        threads_per_worker=1,
        processes=True,
        dashboard_address=":0",
        silence_logs=logging.CRITICAL,
    ) as found:
        yield found


@pytest.fixture(scope="module")
def two_workers():
    with running(2) as found:
        yield found


def test_two_workers_write_the_same_bytes(two_workers, tmp_path):
    alone, path = tmp_path / "alone.parquet", tmp_path / "short.parquet"
    campaign.run(plan_of(), alone, InThisProcess())
    cluster = campaign.Cluster(two_workers.scheduler_address)
    try:
        tally = campaign.run(plan_of(), path, cluster)
    finally:
        cluster.close()
    assert (tally.done, tally.new) == (6, 6)
    assert path.read_bytes() == alone.read_bytes()


def test_the_command_hands_its_jobs_to_the_scheduler(two_workers, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.toml").write_text(SHORT)
    address = two_workers.scheduler_address
    result = CliRunner().invoke(main, ["campaign", "short.toml", "--cluster", address])
    assert result.exit_code == 0, result.output
    assert result.output.startswith("6 runs (6 of them now")
    here = tmp_path / "here.parquet"
    campaign.run(campaign.load("short.toml"), here, InThisProcess())
    assert (tmp_path / "runs/short.parquet").read_bytes() == here.read_bytes()


def test_a_worker_that_is_killed_in_the_middle_loses_nothing(tmp_path):
    text = SHORT.replace("3-5", "0-6")
    alone, path = tmp_path / "alone.parquet", tmp_path / "short.parquet"
    campaign.run(plan_of(text), alone, InThisProcess())
    with running(2) as found:
        cluster = campaign.Cluster(found.scheduler_address)
        killed = []

        def kill(tally, outcome):
            if tally.new == 5:
                killed.append(cluster.client.submit(os.getpid, pure=False).result())
                os.kill(killed[0], signal.SIGKILL)

        try:
            campaign.run(plan_of(text), path, cluster, on_outcome=kill)
        finally:
            cluster.close()
    assert killed
    assert path.read_bytes() == alone.read_bytes()


def test_a_scheduler_that_ends_ends_the_campaign_in_a_line_and_it_goes_on_elsewhere(tmp_path):
    path = tmp_path / "short.parquet"
    text = SHORT.replace("3-5", "0-19")
    with running(1) as found:
        cluster = campaign.Cluster(found.scheduler_address)
        ending = threading.Thread(target=found.close, daemon=True)

        def end(tally, outcome):
            if tally.new == 3:
                ending.start()
                time.sleep(0.1)

        with pytest.raises(BadInput, match="--cluster: workers have ended"):
            campaign.run(plan_of(text), path, cluster, on_outcome=end)
        cluster.close()
        ending.join()  # Dask cannot close a cluster from two threads at once
    there = journal_path(path).read_bytes().count(b"\n") - 1
    assert there >= 3
    assert campaign.run(plan_of(text), path, InThisProcess()).new == 40 - there


def test_a_worker_with_another_version_is_refused_by_its_address(two_workers, monkeypatch):
    other = replace(versions(), mirotwin="0.0.7")
    monkeypatch.setattr(cluster_module, "ours", lambda: other)
    with pytest.raises(BadInput, match=r"--cluster: worker tcp://\S+ has mirotwin \S+ instead of 0\.0\.7"):
        campaign.Cluster(two_workers.scheduler_address)


def test_a_worker_with_another_version_refuses_a_job_by_its_address(two_workers, tmp_path):
    plan = plan_of()
    other = replace(plan, versions=replace(plan.versions, code="0" * 12))
    cluster = campaign.Cluster(two_workers.scheduler_address)
    try:
        with pytest.raises(BadInput, match=r"worker tcp://127\.0\.0\.1:\d+: has other sources of mirotwin"):
            campaign.run(other, tmp_path / "short.parquet", cluster)
    finally:
        cluster.close()


def test_a_scheduler_without_workers_is_told(tmp_path):
    with running(0) as found, pytest.raises(BadInput, match="has no workers; start some: dask worker tcp://"):
        campaign.Cluster(found.scheduler_address)


@pytest.mark.parametrize(
    "address", ["tcp://127.0.0.1:9", "nowhere", "", "tcp://no.such.host.invalid:1", "x://y:1"]
)
def test_an_address_where_no_scheduler_answers_is_exit_code_2_with_a_remedy(tmp_path, monkeypatch, address):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cluster_module, "PATIENCE_S", 1)
    (tmp_path / "short.toml").write_text(SHORT)
    result = CliRunner().invoke(main, ["campaign", "short.toml", "--cluster", address])
    assert result.exit_code == 2
    assert "no Dask scheduler answers at" in result.output
    assert "start one (dask scheduler), or leave --cluster out" in result.output
    assert [path.name for path in tmp_path.iterdir()] == ["short.toml"]


def test_a_client_that_finds_no_scheduler_is_closed_at_once(monkeypatch):
    """Collected later it closes itself, which waits for ever where another client is just being made."""
    closed = []
    monkeypatch.setattr(cluster_module, "PATIENCE_S", 1)
    monkeypatch.setattr(distributed.Client, "close", lambda client, *given, **named: closed.append(client))
    with pytest.raises(BadInput, match="no Dask scheduler answers at"):
        campaign.Cluster("tcp://127.0.0.1:9")
    assert len(closed) == 1
    monkeypatch.undo()
    closed[0].close()


def test_a_result_that_dask_loses_with_its_scheduler_is_the_end_of_the_workers(tmp_path):
    class Losing(InThisProcess):
        def submit(self, function, /, *arguments, **named):
            future = Future()
            future.set_exception(TypeError("cannot unpack non-iterable Outcome object"))
            return future

    class Lost(Workers):
        gone = campaign.Cluster.gone

    with pytest.raises(BadInput, match="workers have ended, and with them what was under way"):
        campaign.run(plan_of(), tmp_path / "short.parquet", Lost(Losing()))
