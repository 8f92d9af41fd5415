"""The table of hardware faults on its page is what its command writes."""

import pytest

from benchmarks.hardware_faults import BEGIN, END, PAGE, table


@pytest.mark.slow
def test_the_table_is_what_the_command_measures():
    assert PAGE.read_text().partition(BEGIN)[2].partition(END)[0] == table()
