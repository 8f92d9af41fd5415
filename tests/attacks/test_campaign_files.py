"""What a campaign finds beside its results: a stranger's journal, clocks that jump."""

import os
import sys
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from mirotwin import campaign
from mirotwin.campaign import journal
from mirotwin.campaign.journal import journal_path
from tests.example_count import examples
from tests.fuzz.mutation import changed
from tests.fuzz.target import Target
from tests.mirotwin.campaign.conftest import InThisProcess, plan_of, rows

pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "short.parquet"
    campaign.run(plan_of(), path, InThisProcess())
    return path


class Ends(InThisProcess):
    """Breaks the campaign off after four runs."""

    def __init__(self):
        self.left = 4

    def submit(self, function, /, *arguments, **named):
        self.left -= 1
        if self.left < 0:
            raise KeyboardInterrupt
        return super().submit(function, *arguments, **named)


@pytest.fixture(scope="module")
def unfinished(tmp_path_factory):
    """The journal of a campaign that was broken off."""
    path = tmp_path_factory.mktemp("unfinished") / "short.parquet"
    with pytest.raises(KeyboardInterrupt):
        campaign.run(plan_of(), path, Ends())
    return journal_path(path).read_bytes()


JUNK = Target(
    "a journal", None, most_bytes=1 << 20, words=(b"\n", b"\0", b"9" * 400, b"[" * 9000, b'"', b"1e999")
)


@pytest.mark.slow
@examples(20)
@given(chance=st.randoms(use_true_random=True))
def test_a_journal_that_was_changed_is_refused_or_gives_results_of_these_runs(
    whole, unfinished, tmp_path_factory, chance
):
    path = tmp_path_factory.mktemp("changed") / "short.parquet"
    journal_path(path).write_bytes(changed(unfinished, JUNK, [unfinished], chance))
    refusal = ""
    try:
        campaign.run(plan_of(), path, InThisProcess())
    except BadInput as error:
        refusal = str(error)
    if refusal:
        assert refusal.startswith(f"{journal_path(path)}")
    else:
        found, wanted = rows(path), rows(whole)
        assert [row["seed"] for row in found] == [row["seed"] for row in wanted]
        assert set(found[0]) == set(wanted[0])


def test_a_line_without_end_in_a_journal_is_refused(unfinished, tmp_path):
    path = tmp_path / "a.parquet"
    journal_path(path).write_bytes(unfinished + b'{"run": ' + b"1" * (3 << 20))
    with pytest.raises(BadInput, match="longer than any outcome"):
        campaign.run(plan_of(), path, InThisProcess())


@pytest.mark.skipif(sys.platform == "win32", reason="no named pipes")
def test_a_journal_that_is_a_named_pipe_is_refused(tmp_path):
    path = tmp_path / "a.parquet"
    os.mkfifo(journal_path(path))
    with pytest.raises(BadInput, match=r"a\.part\.jsonl"):
        campaign.run(plan_of(), path, InThisProcess())


@pytest.mark.parametrize("jump_s", [-86_400.0, 86_400.0, 1e12])
def test_a_wall_clock_that_jumps_changes_no_byte(whole, tmp_path, monkeypatch, jump_s):
    began_s = time.monotonic()
    calls = iter(range(1 << 30))
    monkeypatch.setattr(journal, "perf_counter", lambda: began_s + next(calls) % 3 * jump_s)
    path = tmp_path / "short.parquet"
    campaign.run(plan_of(), path, InThisProcess())
    assert path.read_bytes() == whole.read_bytes()
