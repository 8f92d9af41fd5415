"""What afl-fuzz writes about itself, whole, in part, and damaged."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.afl.counts import Fed, read_counts
from mirotwin.fuzz.afl.statistics import Statistics, read_plot, read_statistics

STATS = """\
start_time        : 1795374603
last_update       : 1795374613
run_time          : 10
execs_done        : 550438
execs_per_sec     : 54857.29
corpus_count      : 4
stability         : 99.50%
bitmap_cvg        : 0.05%
saved_crashes     : 1
edges_found       : 4
afl_version       : ++4.04c
command_line      : afl-fuzz -i s -o o -- serve {"maker":"a:b"}
"""
PLOT = """\
# relative_time, cycles_done, cur_item, corpus_count, pending_total, pending_favs, map_size, saved_crashes, \
saved_hangs, max_depth, execs_per_sec, total_execs, edges_found
60, 29, 3, 4, 0, 0, 0.05%, 1, 0, 4, 45076.47, 550438, 4
65, 30, 3, 5, 0, 0, 0.06%, 2, 0, 4, 45000.00, 600000, 5
"""
SAID = Statistics(550438, 54857.29, 4, 1, 4, 99.5, 10.0)


def stats(folder, text):
    (folder / "fuzzer_stats").write_text(text)
    return read_statistics(folder / "fuzzer_stats")


def plot(folder, text):
    (folder / "plot_data").write_text(text)
    return read_plot(folder / "plot_data")


def test_statistics_are_read(tmp_path):
    assert stats(tmp_path, STATS) == SAID


@given(st.integers(0, len(STATS) - 1))
def test_a_file_that_is_not_written_to_its_end_counts_as_none(tmp_path_factory, end):
    assert stats(tmp_path_factory.mktemp("stats"), STATS[:end]) is None


def test_a_file_that_is_not_there_counts_as_none(tmp_path):
    assert read_statistics(tmp_path / "fuzzer_stats") is None
    assert read_plot(tmp_path / "plot_data") == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("execs_done        : 550438\n", "", "fuzzer_stats: execs_done: is missing; "),
        ("550438", "many", "fuzzer_stats: execs_done: 'many' is no number; "),
        ("99.50%", "99,5%", "fuzzer_stats: stability: '99,5%' is no number; "),
        ("run_time          : 10", "run_time 10", "fuzzer_stats:3: 'run_time 10' is no `key : value`; "),
    ],
)
def test_other_statistics_are_refused(tmp_path, old, new, said):
    with pytest.raises(BadInput) as error:
        stats(tmp_path, STATS.replace(old, new))
    assert said in f"{error.value}"


def test_rows_of_the_plot_are_read_oldest_first(tmp_path):
    first, last = plot(tmp_path, PLOT)
    assert first == Statistics(550438, 45076.47, 4, 1, 4, 100.0, 60.0)
    assert last == Statistics(600000, 45000.0, 5, 2, 5, 100.0, 65.0)


def test_columns_of_newer_versions_are_passed_over(tmp_path):
    newer = (
        PLOT.replace("edges_found", "edges_found, total_crashes")
        .replace("4\n", "4, 9\n")
        .replace("5\n", "5, 9\n")
    )
    assert plot(tmp_path, newer) == plot(tmp_path, PLOT)


def test_a_row_that_is_not_written_to_its_end_is_left_out(tmp_path):
    end = PLOT.rindex("\n65")
    assert all(len(plot(tmp_path, PLOT[:cut])) == 1 for cut in range(end + 1, len(PLOT)))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("total_execs", "execs", "plot_data:1: has no column total_execs; "),
        (", 4, 45076.47", ", 45076.47", "plot_data:2: 12 columns, not 13; "),
        ("600000", "x", "plot_data:3: invalid literal for int() with base 10: 'x'; "),
    ],
)
def test_another_plot_is_refused(tmp_path, old, new, said):
    with pytest.raises(BadInput) as error:
        plot(tmp_path, PLOT.replace(old, new))
    assert said in f"{error.value}"


@given(content=st.binary(max_size=30).filter(lambda content: len(content) != 24))
def test_counters_that_are_not_whole_are_zeros(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("counts") / "main.counts"
    path.write_bytes(content)
    assert read_counts(path) == Fed()
