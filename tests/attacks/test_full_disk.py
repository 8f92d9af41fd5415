"""A disk that is full: the folder is named, and nothing half-written stays. A limit on file sizes stands for it."""

import sys
from pathlib import Path

import pytest

from tests import children

MIROTWIN = Path(sys.executable).with_name("mirotwin")
NOTHING_FITS = 50
ROWS_FIT = 60_000
CASE_FITS = 200_000
CAMPAIGN = 'scenario = "fig6"\nset = { duration_s = 0.1 }\n'
LATE = Path(__file__).parents[2] / "examples" / "firmware" / "late.ihx"
STEPS = LATE.parents[1] / "hil-steps" / "failsafe.scenario.toml"


def with_files_of(most_bytes, command, folder):
    def limited():
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))

    return children.run([MIROTWIN, *command], cwd=folder, capture_output=True, text=True, preexec_fn=limited)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "most_bytes", "named", "left"),
    [
        (["fuzz", "--time", "1s", "-q"], NOTHING_FITS, "out", []),
        (
            ["reproduce", "--seeds", "0-0", "--jobs", "1", "-q"],
            NOTHING_FITS,
            "out/reproduction",
            ["rows.part.csv"],
        ),
        (
            ["reproduce", "--seeds", "0-0", "--jobs", "1", "-q"],
            ROWS_FIT,
            "out/reproduction",
            ["rows.part.csv"],
        ),
    ],
)
def test_a_full_disk_is_named_and_nothing_half_written_stays(command, most_bytes, named, left, tmp_path):
    done = with_files_of(most_bytes, [*command, "--out", "out"], tmp_path)
    assert done.returncode == 2
    remedy = "make room, or choose another folder with --out"
    assert done.stderr.splitlines()[-1] == f"mirotwin: error: {named}: File too large; {remedy}"
    assert [path.name for path in tmp_path.rglob("*") if path.is_file() and path.stat().st_size] == left


def test_a_disk_that_becomes_full_is_named_with_the_option_that_leads_elsewhere(tmp_path):
    (tmp_path / "c.toml").write_text(CAMPAIGN)
    done = with_files_of(NOTHING_FITS, ["campaign", "c.toml", "--jobs", "1", "--out", "c.parquet"], tmp_path)
    assert done.returncode == 2
    error = "mirotwin: error: c.part.jsonl: File too large; make room, or choose another file with --out"
    assert done.stderr.splitlines()[-1] == error


@pytest.mark.parametrize(
    ("command", "most_bytes", "said"),
    [
        (["test", STEPS, "--firmware", LATE, "--pages"], CASE_FITS, "no page: "),
        (["test", STEPS, "--firmware", LATE], NOTHING_FITS, "nothing could be left in left"),
        (["conform", LATE, "--rule", "P29"], NOTHING_FITS, "nothing could be left in left"),
    ],
)
def test_a_verdict_is_told_on_a_disk_that_becomes_full(command, most_bytes, said, tmp_path):
    done = with_files_of(most_bytes, [*command, "--artifacts", "left"], tmp_path)
    assert done.returncode == 1
    assert "both wheels told to stop" in done.stdout
    assert said in done.stdout + done.stderr
