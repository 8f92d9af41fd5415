"""A disk that is full: the folder is named, and nothing half-written stays. A limit on file sizes stands for it."""

import sys
from pathlib import Path

import pytest

from tests import children

MIROTWIN = Path(sys.executable).with_name("mirotwin")
NOTHING_FITS = 50


def limited():
    import resource

    resource.setrlimit(resource.RLIMIT_FSIZE, (NOTHING_FITS, NOTHING_FITS))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "named", "left"),
    [
        (["fuzz", "--time", "1s", "-q"], "out", []),
        (["reproduce", "--seeds", "0-0", "--jobs", "1", "-q"], "out/reproduction", ["rows.part.csv"]),
    ],
)
def test_a_full_disk_is_named_and_nothing_half_written_stays(command, named, left, tmp_path):
    done = children.run(
        [MIROTWIN, *command, "--out", "out"], cwd=tmp_path, capture_output=True, text=True, preexec_fn=limited
    )
    assert done.returncode == 2
    remedy = "make room, or choose another folder with --out"
    assert done.stderr.splitlines()[-1] == f"mirotwin: error: {named}: File too large; {remedy}"
    assert [path.name for path in tmp_path.rglob("*") if path.is_file() and path.stat().st_size] == left
