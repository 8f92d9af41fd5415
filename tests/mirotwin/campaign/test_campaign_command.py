"""`mirotwin campaign`: what it says, its exit codes, and what it refuses."""

import contextlib
import json
import signal
import time
from pathlib import Path

import pytest

from mirotwin import campaign
from mirotwin.campaign.journal import journal_path
from tests import children
from tests.mirotwin.campaign.conftest import SHORT, InThisProcess, plan_of, rows
from tests.mirotwin.program import COMMAND, mirotwin

pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")

FACTORS = """
scenario = "fig7"
seeds = "0-19"
set = { duration_s = 0.2 }
[factor.start]
near = []
far = ["network.robot.start_error_x_cm=40.0"]
"""


def made(path, text, **changes):
    """Results of a campaign; `changes`: column -> what becomes of its values."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    campaign.run(plan_of(text), path, InThisProcess())
    table = pq.read_table(path)
    for name, change in changes.items():
        at = table.schema.get_field_index(name)
        values = [change(value) for value in table[name].to_pylist()]
        table = table.set_column(
            at, table.schema.field(name), pa.array(values, table.schema.field(name).type)
        )
    pq.write_table(table, path)
    return path


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return made(tmp_path_factory.mktemp("results") / "factors.parquet", FACTORS)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.toml").write_text(SHORT)
    return tmp_path


def test_a_file_is_run_with_one_line_and_then_is_there_already(here):
    out = mirotwin.succeeds("campaign", "short.toml", "--jobs", 1, "--seeds", "3-4")
    assert out.startswith("4 runs (4 of them now, in ")
    assert out.endswith("2 clean seeds: failure rate below 78 % at 95 %\n")
    out = mirotwin.succeeds("campaign", "short.toml", "--jobs", 1, "--seeds", "3-4", "--was", "19/20")
    assert out.endswith("; at the old rate of 19/20 a fix needs 1: fixed\n")
    assert len(rows(here / "runs/short.parquet")) == 4
    again = mirotwin.succeeds("campaign", "run", "short.toml", "--seeds", "3-4")
    assert again.splitlines()[0] == "runs/short.parquet has all 4 runs already"


@pytest.mark.parametrize("was", ["3", "0/5", "6/5", "1/0", "-1/5", "a/b", "1/5/9"])
def test_what_failed_before_a_fix_is_a_share(here, was):
    _, _, err = mirotwin("campaign", "short.toml", "--was", was)
    assert f"{was!r} is not FAILED/SEEDS, such as 2/50" in err


@pytest.mark.parametrize(
    ("change", "place"),
    [
        (("bit_error_rate", "bit_error_rat"), "grid.network.radio.bit_error_rat[0]"),
        (("network.radio.bit", "network.7.radio.bit"), "grid.network.7.radio.bit_error_rate[0]"),
        (("1e-2", "7.0"), "grid.network.radio.bit_error_rate[1]"),
        (("1e-2", "0.0"), "grid.network.radio.bit_error_rate"),
        (("[0.0, 1e-2]", "0.5"), "grid.network.radio.bit_error_rate"),
        (("duration_s", "duration"), "set.duration"),
        (('"fig7"', '"fig77"'), "scenario"),
        (('"3-5"', '"5-3"'), "seeds"),
        (("scenario", "szenario"), "szenario"),
        (("[grid]", "firmware = 'none.ihx'\n[grid]"), "firmware"),
        (("[grid]", "[expect]\ntracks_within = 1\n[grid]"), "expect.tracks_within"),
        (("[grid]", "[factor.far]\na = ['network.robot.x=1']\n[grid]"), "factor.far.a"),
        (("[grid]", "[factor.run]\na = []\n[grid]"), "run"),
        (("[grid]", "[grid]\nnetwork.robot.slot = [nan]"), "grid.network.robot.slot[0]"),
        (
            ("[grid]", "[random]\ncount = 2\n[random.range]\nhost.compute_s = {from = 1, to = 2}\n[grid]"),
            "random",
        ),
        (("[grid]", "[random]\ncount = 2\n[random.range]\nhost.compute_s = {from = 1}\n[grid]"), "random"),
        (("[grid]", "[grid"), "line 6, column 6: not TOML"),
    ],
)
def test_what_is_wrong_in_a_file_is_told_with_its_place_before_anything_runs(here, change, place):
    (here / "short.toml").write_text(SHORT.replace(*change))
    assert mirotwin.refuses("campaign", "short.toml").startswith(f"short.toml: {place}")
    assert [path.name for path in here.iterdir()] == ["short.toml"]


REFUSED = {
    ("short.toml", "--seeds", "0-9999999"): "has 20000000 runs, more than 100000",
    ("nothing.toml",): "nothing.toml: there is no such file",
    ("short.toml", "--out", "short.csv"): "results are a .parquet file",
    ("short.toml", "--out", "short.toml/a.parquet"): "File exists; choose another folder with --out",
    ("show", "nothing.parquet"): "nothing.parquet: there is no such file",
    ("show", "short.toml"): "short.toml: is no Parquet file",
}


@pytest.mark.parametrize("arguments", REFUSED, ids=" ".join)
def test_what_cannot_be_meant_is_refused_in_a_line(here, arguments):
    assert REFUSED[arguments] in mirotwin.refuses("campaign", *arguments)


def test_failed_checks_are_exit_code_1_beyond_the_share_that_may(here):
    text = FACTORS.replace("0-19", "0-1") + "[expect]\ntracks_within_cm = 50.0\n"
    (here / "c.toml").write_text(text)
    assert "failed: runs 0, 1: tracks_within_cm" in mirotwin.ends(1, "campaign", "c.toml", "--jobs", 1)
    (here / "c.toml").write_text(f"allowed_failed_share = 1.0\n{text}")
    mirotwin.ends(0, "campaign", "c.toml", "--jobs", 1, "--force")


def test_of_many_failures_the_first_are_listed_and_the_others_counted(here):
    text = FACTORS.replace("0-19", "0-3").replace("far", "also").replace("40.0", "41.0")
    (here / "c.toml").write_text(f"allowed_failed_share = 1.0\n{text}[expect]\ntracks_within_cm = 0.001\n")
    err = mirotwin.ends(0, "campaign", "c.toml", "--jobs", 1)
    assert "mirotwin: failed: runs 0, 1, 2, 3" in err
    assert "mirotwin: failed: 3 more of 8\n" in err


def test_a_run_with_an_error_is_exit_code_2_and_a_row_and_costs_no_other(here):
    grid = "network.robots = [3, 5]\nnetwork.radio.keyup_s = [0.001, 0.005]\n"
    (here / "c.toml").write_text(f'scenario = "fig7"\nset = {{ duration_s = 0.1 }}\n[grid]\n{grid}')
    assert "1 of 4 runs have an error" in mirotwin.ends(2, "campaign", "c.toml", "--jobs", 1)
    found = rows(here / "runs/c.parquet")
    assert [row["verdict"] for row in found] == ["passed", "passed", "passed", "error"]
    assert "do not fit the camera period" in found[3]["error"]
    assert (found[3]["digest"], found[3]["rms_x_cm"], found[3]["check.no_fault"]) == ("", None, None)


def children_of(parent):
    """Processes that a process has started; none where there is no /proc."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            if int(entry.read_text().rpartition(")")[2].split()[1]) == parent:
                found.append(int(entry.parent.name))
    return found


def runs(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def started(here, seeds, *options):
    """The campaign in a process of its own, once three runs are in its journal; and the journal."""
    (here / "short.toml").write_text(SHORT.replace("3-5", seeds))
    words = ["campaign", "short.toml", "--jobs", "1", *options]
    process = children.start([*COMMAND, *words], stderr=-1, text=True)
    part = journal_path(here / "runs/short.parquet")
    until(lambda: part.exists() and part.read_bytes().count(b"\n") >= 4)
    return process, part


def until(true):
    deadline_s = time.monotonic() + 60
    while not true():
        assert time.monotonic() < deadline_s
        time.sleep(0.01)


@pytest.mark.slow
def test_a_campaign_that_is_killed_goes_on_and_ends_with_the_same_bytes(here):
    process, part = started(here, "0-19", "-q")
    workers = children_of(process.pid)
    process.kill()
    process.communicate()
    until(lambda: not any(map(runs, workers)))  # they end when their parent does
    left = part.read_bytes().count(b"\n") - 1
    assert 3 <= left < 40
    out = mirotwin.succeeds("campaign", "short.toml", "--jobs", 1)
    assert out.startswith(f"40 runs ({40 - left} of them now")
    whole = here / "whole.parquet"
    campaign.run(campaign.load("short.toml"), whole, InThisProcess())
    assert (here / "runs/short.parquet").read_bytes() == whole.read_bytes()


@pytest.mark.slow
def test_ctrl_c_says_how_much_is_there_and_that_the_same_command_goes_on(here):
    process, _ = started(here, "0-99")
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "of 200 runs are in runs/short.part.jsonl; the same command goes on from there" in said
    assert "Traceback" not in said


def test_statistics_are_shown_for_each_combination_of_factors(results):
    out = mirotwin.succeeds("campaign", "show", results)
    lines = out.splitlines()
    assert lines[0] == f"{results}: 40 runs of short"
    assert lines[1].split()[:3] == ["start", "runs", "failed"]
    assert [line.split()[0] for line in lines[2::3]] == ["near", "far"]
    document = json.loads(mirotwin.succeeds("campaign", "show", results, "--json", "--metric", "rms_x_cm"))
    assert [group["factors"] for group in document["groups"]] == [{"start": "near"}, {"start": "far"}]
    near = sorted(row["rms_x_cm"] for row in rows(results) if row["start"] == "near")
    assert document["groups"][0]["metrics"]["rms_x_cm"]["median"] == near[9] + (near[10] - near[9]) * 0.5


@pytest.mark.parametrize(
    ("metric", "label"),
    [("unsettled", "unsettled (1: yes)"), ("check.no_fault", "check.no_fault (1: failed)")],
)
def test_a_metric_of_0_and_1_says_what_1_is(results, metric, label):
    assert label in mirotwin.succeeds("campaign", "show", results, "--metric", metric)


def test_runs_that_never_settle_are_counted_beside_the_median_of_those_that_do(results, tmp_path):
    ends = [run % 20 >= 7 for run in range(40)]
    settled, times_s = iter(ends), iter([0.5 if end else None for end in ends])
    some = made(
        tmp_path / "some.parquet",
        FACTORS,
        settling_s=lambda _: next(times_s),
        settled=lambda _: next(settled),
    )
    shown = mirotwin.succeeds("campaign", "show", some).split("settling_s (7 of 20 never settle)")[1:]
    assert [rest.split()[0] for rest in shown] == ["13", "13"]
    groups = json.loads(mirotwin.succeeds("campaign", "show", some, "--json"))["groups"]
    assert [group["never_settled"] for group in groups] == [7, 7]
    page = tmp_path / "page.html"
    mirotwin.succeeds("campaign", "page", some, "--out", page)
    assert "settling_s (7 of 20 never settle)" in page.read_text()


def test_two_levels_are_compared_on_the_same_seeds(results):
    between = ("campaign", "show", results, "--between")
    document = json.loads(mirotwin.succeeds(*between, "start=near,far", "--json"))
    (found,) = [one for one in document["differences"] if one["metric"] == "rms_position_cm"]
    values = {(row["start"], row["seed"]): row["rms_position_cm"] for row in rows(results)}
    apart = sorted(values["far", seed] - values["near", seed] for seed in range(20))
    assert (found["pairs"], found["seeds"], found["without"]) == (20, 20, 0)
    assert found["median"] == apart[9] + (apart[10] - apart[9]) * 0.5
    assert found["interval"]["low"] <= found["difference"] <= found["interval"]["high"]
    mirotwin.succeeds(*between, "start")
    for wrong in ("start=near", "start=near,nowhere", "begin=near,far"):
        mirotwin.ends(2, *between, wrong)


def test_nothing_is_worse_than_the_same_results(results):
    out = mirotwin.succeeds("campaign", "show", results, "--against", results)
    assert "40 pairs of runs, 40 with the same digest" in out


def test_what_got_worse_is_one_line_and_exit_code_1(results, tmp_path):
    worse = made(tmp_path / "worse.parquet", FACTORS, rms_position_cm=lambda value: value * 1.1)
    err = mirotwin.ends(1, "campaign", "show", worse, "--against", results)
    (line,) = [line for line in err.splitlines() if line.startswith("mirotwin: worse")]
    assert f"worse than {results}: rms_position_cm by +" in line
    assert " (95 % interval " in line
    assert " in the mean of 40 pairs of 20 seeds, from " in line
    mirotwin.succeeds("campaign", "show", worse, "--against", results, "--tolerance", 15)
    mirotwin.succeeds("campaign", "show", results, "--against", worse)


def test_one_fault_more_is_worse(results, tmp_path):
    verdicts = iter(["fault", *["passed"] * 39])
    worse = made(tmp_path / "worse.parquet", FACTORS, verdict=lambda _: next(verdicts))
    assert "fault by +0.025" in mirotwin.ends(1, "campaign", "show", worse, "--against", results)


def test_a_gate_needs_twenty_seeds(results, tmp_path):
    few = made(tmp_path / "few.parquet", FACTORS.replace("0-19", "0-9"))
    said = mirotwin.refuses("campaign", "show", few, "--against", results)
    assert said.startswith(f"{results}: has only 10 seeds in common with {few}; a gate needs 20; ")


def test_pairs_of_which_one_run_lacks_the_figure_are_counted(results, tmp_path):
    found = iter([None, *[1.0] * 39])
    lacking = made(tmp_path / "lacking.parquet", FACTORS, rms_theta_deg=lambda _: next(found))
    document = json.loads(mirotwin.succeeds("campaign", "show", lacking, "--against", results, "--json"))
    without = {one["metric"]: one["without"] for one in document["differences"]}
    assert without["rms_position_cm"] == 0
    assert without["rms_theta_deg"] == 1


def test_results_without_a_run_in_common_are_refused(results, tmp_path):
    other = made(tmp_path / "other.parquet", FACTORS.replace("0-19", "20-39"))
    assert "has no run in common" in mirotwin.ends(2, "campaign", "show", results, "--against", other)
    other = made(tmp_path / "short.parquet", SHORT)
    err = mirotwin.ends(2, "campaign", "show", results, "--against", other)
    assert "varies network.radio.bit_error_rate, not start" in err
