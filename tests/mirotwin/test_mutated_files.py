"""The short form of `python -m tests.mirotwin.mutated_files`."""

from tests.mirotwin.mutated_files import campaign


def test_a_damaged_file_of_any_kind_ends_in_an_exit_code_and_a_line(tmp_path):
    ends = [(number, outcome) for number, _, outcome, _ in campaign(tmp_path, 1, range(140))]
    assert [end for end in ends if not isinstance(end[1], int)] == []
    assert {outcome for _, outcome in ends} >= {0, 2, 42}
