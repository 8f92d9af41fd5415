"""One digest on two families of processors: x86-64 and, by cross compiler and qemu-user, aarch64."""

import json
import os
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests import children
from tests.sim import digest_of
from tests.sim.aarch64 import GOLDEN, ROOT


@pytest.mark.skipif(
    not os.environ.get("CI"), reason="a minute and packages from the net: python -m tests.sim.aarch64 --quick"
)
def test_an_aarch64_processor_gives_the_golden_digest():
    done = children.run(
        [sys.executable, "-m", "tests.sim.aarch64", "--quick"], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert " equal" in done.stdout


def test_a_run_by_its_name_has_the_digest_of_the_table():
    """Each entry that lasts no longer than a second; the command runs all of them."""
    golden = json.loads(GOLDEN.read_text())
    short = [name for name in golden if digest_of.parse(name).duration_s <= 1.0]
    assert short
    assert [digest_of.digest(name) for name in short] == [golden[name] for name in short]


@given(st.sampled_from(["fig6", "fig8"]), st.integers(1, 999), st.integers(0, 2**63 - 1))
def test_a_name_is_read_as_it_is_written(scenario, tenths, seed):
    duration_s = tenths / 10
    assert digest_of.parse(f"{scenario} {duration_s} s seed {seed}") == (scenario, duration_s, seed)


@pytest.mark.parametrize("name", ["", "fig6", "fig6 0.5 s", "fig6 x s seed 7", "fig6 0.5 s seed -1"])
def test_what_names_no_run_is_refused(name):
    with pytest.raises(ValueError, match="names no run"):
        digest_of.parse(name)
