"""A campaign from its file to its results: the same rows whoever runs them, and none is lost."""

import errno
from concurrent.futures import ThreadPoolExecutor

import pytest

from miro_exact.bad_input import BadInput
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin import campaign
from mirotwin.campaign import running
from mirotwin.campaign.journal import Journal, journal_path
from mirotwin.campaign.results import wall_path
from mirotwin.campaign.worker import RunOutcome
from mirotwin.campaign.workers import Processes
from mirotwin.recording.track import Tracks, settled
from mirotwin.runs.summary import summarise, tracking_of
from mirotwin.runs.test_file import run_test
from tests.mirotwin.campaign.conftest import SHORT, InThisProcess, plan_of, rows

pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")


def test_a_row_says_what_the_run_itself_says(alone):
    row = rows(alone)[4]
    settings = ("duration_s=0.3", "network.radio.bit_error_rate=0.01")
    world, tracks = World(load("fig7", settings).scenario, 4, load_hex(image_path())), Tracks()
    while not world.finished:
        tracks.add(world.step())
    (track,) = tracks.robots.values()
    tracking, summary = tracking_of(track.errors), summarise(world, tracks, 1.0)
    assert (row["run"], row["seed"], row["network.radio.bit_error_rate"]) == (4, 4, 0.01)
    assert (row["digest"], row["verdict"], row["error"]) == (tracks.digest, "passed", "")
    assert (row["rms_position_cm"], row["rms_x_cm"]) == (tracking.rms_position_cm, tracking.rms_x_cm)
    link = summary.link
    assert (row["frames_accepted"], row["bit_errors"]) == (link.frames_accepted, link.bit_errors)
    assert row["vision_frames"] == summary.vision.frames
    assert (row["faults"], row["settled"]) == (0, settled(track.errors))
    assert row["check.no_fault"] == "passed"


def test_results_are_in_the_order_of_the_plan_with_the_last_factor_and_the_seeds_changing_first(alone):
    found = rows(alone)
    assert [row["run"] for row in found] == list(range(6))
    assert [row["network.radio.bit_error_rate"] for row in found] == [0.0] * 3 + [0.01] * 3
    assert [row["seed"] for row in found] == [3, 4, 5] * 2
    assert len({row["digest"] for row in found}) == 6


def test_processes_write_the_same_bytes(alone, tmp_path):
    path = tmp_path / "short.parquet"
    tally = campaign.run(plan_of(), path, Processes(2))
    assert (tally.done, tally.new, tally.runs) == (6, 6, 6)
    assert path.read_bytes() == alone.read_bytes()
    assert not journal_path(path).exists()


def test_a_journal_that_somebody_cut_short_makes_no_results(tmp_path):
    path = tmp_path / "short.parquet"

    def cut(tally, outcome):
        if tally.done == tally.runs:
            lines = journal_path(path).read_bytes().splitlines(keepends=True)
            journal_path(path).write_bytes(b"".join(lines[:4]))

    with pytest.raises(BadInput, match="has the outcome of 3 of 6 runs"):
        campaign.run(plan_of(), path, InThisProcess(), on_outcome=cut)
    assert not path.exists()
    assert not wall_path(path).exists()
    assert campaign.run(plan_of(), path, InThisProcess()).new == 3


def test_an_executor_of_the_caller_writes_the_same_bytes_and_stays_open(alone, tmp_path):
    path = tmp_path / "short.parquet"
    with ThreadPoolExecutor(2) as executor:
        campaign.run(plan_of(), path, executor)
        assert executor.submit(len, "ab").result() == 2
    assert path.read_bytes() == alone.read_bytes()


def test_wall_times_are_in_a_file_of_their_own(alone):
    import pyarrow.parquet as pq

    assert "wall_s" not in campaign.read(alone)[0].column_names
    walls = pq.read_table(wall_path(alone))
    assert walls["run"].to_pylist() == list(range(6))
    assert all(wall_s > 0.0 for wall_s in walls["wall_s"].to_pylist())


class Interrupted(Exception):
    pass


def broken_off(path, after=1):
    """The short campaign up to so many outcomes; its journal."""

    def interrupt(tally, outcome):
        if tally.new == after:
            raise Interrupted

    with pytest.raises(Interrupted):
        campaign.run(plan_of(), path, InThisProcess(), on_outcome=interrupt)
    return journal_path(path)


@pytest.mark.parametrize("torn", [b"", b'{"run":5,"verd'])
def test_a_campaign_that_was_broken_off_goes_on_and_makes_no_run_twice(alone, tmp_path, torn):
    path = tmp_path / "short.parquet"
    journal = broken_off(path, after=2)
    assert not path.exists()
    with journal.open("ab") as stream:
        stream.write(torn)
    tally = campaign.run(plan_of(), path, InThisProcess())
    assert (tally.done, tally.new) == (6, 4)
    assert path.read_bytes() == alone.read_bytes()


@pytest.mark.parametrize("length", [0, 1, 30, 60])
def test_a_first_line_that_was_cut_off_is_written_again(alone, tmp_path, length):
    path = tmp_path / "short.parquet"
    first = b'{"mirotwin_campaign":1,"hash":"0123456789abcdef0123456789abcdef'
    journal_path(path).write_bytes(first[:length])
    assert campaign.run(plan_of(), path, InThisProcess()).new == 6
    assert path.read_bytes() == alone.read_bytes()


@pytest.mark.parametrize(
    "other",
    [
        SHORT.replace("3-5", "3-6"),
        SHORT.replace("0.3", "0.4"),
        SHORT.replace("1e-2", "2e-2"),
        SHORT + "[expect]\ninside_pitch = true\n",
        SHORT.replace("fig7", "fig6"),
    ],
    ids=["seeds", "setting", "level", "check", "scenario"],
)
def test_results_of_another_campaign_are_refused_and_replaced_only_by_force(alone, tmp_path, other):
    path = tmp_path / "short.parquet"
    path.write_bytes(alone.read_bytes())
    with pytest.raises(BadInput, match="holds the results of another campaign: other runs"):
        campaign.run(plan_of(other), path, InThisProcess())
    assert path.read_bytes() == alone.read_bytes()
    if "3-6" in other:
        campaign.run(plan_of(other), path, InThisProcess(), force=True)
        assert len(rows(path)) == 8


def test_unfinished_results_of_another_campaign_are_refused(tmp_path):
    path = tmp_path / "short.parquet"
    journal = broken_off(path)
    left = journal.read_bytes()
    with pytest.raises(BadInput, match="unfinished results of another campaign"):
        campaign.run(plan_of(SHORT.replace("3-5", "3-6")), path, InThisProcess())
    assert journal.read_bytes() == left


def test_unfinished_results_without_a_single_outcome_are_in_nobodys_way(tmp_path):
    path = tmp_path / "short.parquet"
    other = plan_of(SHORT.replace("3-5", "3-6"))
    with Journal(journal_path(path), other.head):
        pass
    assert campaign.run(plan_of(), path, InThisProcess()).new == 6


class FillingDisk:
    """A stream whose disk takes so many more bytes, the last of them of a cut write."""

    def __init__(self, stream, room):
        self.stream, self.room = stream, room

    def write(self, data):
        if not self.room:
            raise OSError(errno.ENOSPC, "No space left on device")
        data = data[: self.room]
        self.room -= len(data)
        return self.stream.write(data)

    def __getattr__(self, name):
        return getattr(self.stream, name)


def test_a_line_that_a_full_disk_cut_is_taken_back_and_its_run_is_missing(tmp_path):
    path = journal_path(tmp_path / "short.parquet")
    with Journal(path, plan_of().head) as journal:
        stream = journal._stream
        journal.add(RunOutcome(run=0, verdict="passed"))
        journal._stream = FillingDisk(stream, 5)
        with pytest.raises(OSError, match="No space left"):
            journal.add(RunOutcome(run=1, verdict="passed"))
        journal._stream = FillingDisk(stream, 10_000)
        journal.add(RunOutcome(run=2, verdict="passed"))
        assert next(journal.missing()) == 1
    with Journal(path, plan_of().head) as journal:
        assert [run for run in range(3) if not journal.done[run]] == [1]


@pytest.mark.parametrize("content", [b"", b"PAR1", b"text", b"x" * 4000])
def test_a_file_that_is_no_campaigns_results_is_refused(tmp_path, content):
    path = tmp_path / "short.parquet"
    path.write_bytes(content)
    with pytest.raises(BadInput, match="is no "):
        campaign.run(plan_of(), path, InThisProcess())
    assert path.read_bytes() == content


@pytest.mark.parametrize("content", [b"text\n", b"{}\n", b'{"run":1}\n{}\n', b"\xff" * 50])
def test_a_file_that_is_no_campaigns_part_is_refused(tmp_path, content):
    path = tmp_path / "short.parquet"
    journal_path(path).write_bytes(content)
    with pytest.raises(BadInput, match="is not a campaign's journal"):
        campaign.run(plan_of(), path, InThisProcess())
    assert journal_path(path).read_bytes() == content


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b"\xff\xfe{}\n", "is no outcome of a run"),
        (b'{"run":"\xff"}\n', "is no outcome of a run"),
        (b'{"run":6}\n', "has an outcome of run 6"),
        (b'{"run":-1}\n', "has an outcome of run -1"),
        (b'{"run":5,"figures":{"faults":"none"}}\n', "faults: runs 0 to 5 have a value that is no int64"),
    ],
)
def test_a_line_that_is_no_outcome_is_refused(tmp_path, line, words):
    path = tmp_path / "short.parquet"
    journal = broken_off(path)
    head = journal.read_bytes().splitlines(keepends=True)[0]
    journal.write_bytes(head + line)  # other threads may have written outcomes meanwhile, of run 5 too
    with pytest.raises(BadInput, match=words):
        campaign.run(plan_of(), path, InThisProcess())
    assert not path.exists()


def test_two_processes_do_not_write_to_one_campaign(tmp_path):
    path = tmp_path / "short.parquet"

    def again(tally, outcome):
        campaign.run(plan_of(), path, InThisProcess())

    with pytest.raises(BadInput, match="another process is writing to it"):
        campaign.run(plan_of(), path, InThisProcess(), on_outcome=again)


def test_ten_million_runs_have_to_be_asked_for(tmp_path):
    plan = plan_of(SHORT.replace("3-5", "0-4999999"))
    assert plan.runs == 10_000_000
    assert plan.work(9_999_999).seed == 4_999_999
    with pytest.raises(BadInput, match=r"short\.toml: has 10000000 runs"):
        campaign.run(plan, tmp_path / "short.parquet")
    assert list(tmp_path.iterdir()) == []
    running.refuse_many(plan, agreed=True)


STEPS = """
scenario = "silent"
duration_s = 0.3
step = [
    { pause_ms = 40 },
    { send = "team", left_m_s = 0.2, right_m_s = 0.2 },
    { expect = "wheels", left_m_s = 0.2, within_ms = WITHIN },
    { check = { inside_pitch = true } },
]
"""


@pytest.mark.parametrize(("within_ms", "verdict"), [("60", "passed"), ("0.1", "failed")])
def test_steps_of_a_scenario_are_done_and_one_that_fails_is_told(tmp_path, within_ms, verdict):
    (tmp_path / "one.scenario.toml").write_text(STEPS.replace("WITHIN", within_ms))
    path = tmp_path / "c.parquet"
    campaign.run(plan_of('scenario = "one.scenario.toml"\n', tmp_path / "c.toml"), path, InThisProcess())
    (row,) = rows(path)
    assert row["verdict"] == verdict, row["failure"] + row["error"]
    assert row["failure"].startswith("step: ") == (verdict == "failed")
    assert row["check.inside_pitch"] == ("passed" if verdict == "passed" else None)
    whole = run_test(str(tmp_path / "one.scenario.toml"), load_hex(image_path()))
    assert row["digest"] == whole.digest  # of the whole run, beyond the last step


def test_without_pyarrow_the_remedy_is_a_line(monkeypatch, tmp_path):
    monkeypatch.setattr("mirotwin.campaign.results.find_spec", lambda name: None)
    with pytest.raises(BadInput, match=r"pyarrow: is not installed; pip install 'mirotwin\[campaign\]'"):
        campaign.run(plan_of(), tmp_path / "short.parquet")
