"""A campaign whose runs are made by workers of Dask, which have none of its files."""

import os
import re
import shutil
import signal
import sys
import time
from pathlib import Path

import pytest

from miro_robot.firmware import image_path
from mirotwin import campaign
from tests import children
from tests.mirotwin.campaign.conftest import InThisProcess

pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")
distributed = pytest.importorskip("distributed", reason="needs the extra develop")
pytestmark = pytest.mark.slow

PAGE = (Path(campaign.__file__).parent / "README.md").read_text("utf-8")
LINES = re.findall(r"^    \$ (dask .*)$", PAGE, re.MULTILINE)
SCRIPT = next(text for text in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "Client" in text)
ADDRESS = "127.0.0.1:8786"
SHORT = """
scenario = "mine.toml"
seeds = "0-9"
set = { duration_s = 0.3 }

[grid]
firmware = ["", "mine.ihx"]
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A campaign with a scenario of its own, and an image with its symbols; the current folder."""
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "campaign.toml").write_text(SHORT)
    (folder / "mine.toml").write_text('scenario = "fig7"\n[expect]\ninside_pitch = true\n')
    for suffix in (".ihx", ".map", ".cdb"):
        shutil.copy(image_path().with_suffix(suffix), folder / f"mine{suffix}")
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def alone(folder):
    """The bytes of the results, made in this process."""
    campaign.run(campaign.load("campaign.toml"), "alone.parquet", InThisProcess())
    return (folder / "alone.parquet").read_bytes()


@pytest.fixture
def scheduler(tmp_path):
    """The page's lines on loopback, in a folder that holds nothing; gives the scheduler's address."""
    there = tmp_path / "there"
    there.mkdir()
    begin, work = ([sys.executable, "-m", *line.split()] for line in LINES)
    said = tmp_path / "address.json"
    options = {"cwd": there, "stdout": children.subprocess.DEVNULL, "stderr": children.subprocess.DEVNULL}
    with children.start(
        [*begin, "--port", "0", "--no-dashboard", "--scheduler-file", said], **options
    ) as one:
        address = _address(said)
        work = [address if word == ADDRESS else word for word in work]
        with children.start([*work, "--no-dashboard"], **options) as others:
            yield address
            others.terminate()
        one.terminate()


def _address(file):
    ends_s = time.monotonic() + 60
    while not (found := re.search(r"127\.0\.0\.1:\d+", file.read_text() if file.exists() else "")):
        assert time.monotonic() < ends_s
        time.sleep(0.05)
    return found[0]


def test_the_script_on_the_page_writes_the_bytes_of_a_local_run(folder, alone, scheduler):
    (folder / "script.py").write_text(SCRIPT.replace(ADDRESS, scheduler))
    children.run([sys.executable, "script.py"], check=True)
    assert (folder / "runs" / "campaign.parquet").read_bytes() == alone


def test_a_worker_that_is_killed_in_between_changes_no_byte(folder, alone, scheduler, tmp_path):
    plan = campaign.load("campaign.toml")
    os.chdir(tmp_path)
    shutil.rmtree(folder)  # a job carries all that its run needs
    path = tmp_path / "results.parquet"
    with distributed.Client(scheduler) as client:
        client.wait_for_workers(2)
        killed = []

        def kill(tally, outcome):
            if tally.new == 3:
                killed.extend(client.run(os.getpid).values())
                os.kill(killed[0], signal.SIGKILL)

        campaign.run(plan, path, client.get_executor(pure=False), on_outcome=kill)
    assert len(killed) == 2
    assert path.read_bytes() == alone
