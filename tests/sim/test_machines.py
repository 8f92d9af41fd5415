"""One digest on several families of processors, the foreign ones by cross compiler and qemu-user."""

import json
import os
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact import engine
from tests import children
from tests.sim import digest_of
from tests.sim.machines import GOLDEN, MACHINES, ROOT, Missing, Refused, check_tools, run


@pytest.mark.slow
@pytest.mark.skipif(
    not os.environ.get("CI"),
    reason="a minute and packages from the net: python -m tests.sim.machines aarch64 --quick",
)
def test_an_aarch64_processor_gives_the_golden_digest():
    command = [sys.executable, "-m", "tests.sim.machines", "aarch64", "--quick"]
    done = children.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert " equal" in done.stdout


def test_a_missing_tool_is_named_with_the_package_that_brings_it(monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.raises(Missing, match="apt-get install gcc-s390x-linux-gnu libc6-dev-s390x-cross qemu-user"):
        check_tools(MACHINES["s390x"])


def test_a_refusal_of_the_other_machine_is_no_digest_and_its_line_is_kept():
    code = f"import sys; print('rounds twice', file=sys.stderr); sys.exit({digest_of.REFUSED})"
    with pytest.raises(Refused, match=r"^rounds twice$"):
        run([sys.executable, "-c", code])


def test_a_python_that_is_refused_says_so_in_one_line_and_by_its_exit_code(monkeypatch, capsys):
    def refuse(which):
        raise engine.EngineError("this Python rounds twice", "use another")

    monkeypatch.setattr(engine, "select", refuse)
    monkeypatch.setattr(sys, "argv", ["digest_of", "fig6 0.5 s seed 7"])
    with pytest.raises(SystemExit) as caught:
        digest_of.main()
    assert caught.value.code == digest_of.REFUSED
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert "rounds twice" in said.err


def test_a_run_by_its_name_has_the_digest_of_the_table():
    """Each entry that lasts no longer than a second; the command runs all of them."""
    golden = json.loads(GOLDEN.read_text())
    short = [name for name in golden if digest_of.parse(name).duration_s <= 1.0]
    assert short
    assert [digest_of.digest(name) for name in short] == [golden[name] for name in short]


@given(st.sampled_from(["fig6", "fig8"]), st.integers(1, 999), st.integers(0, 2**63 - 1))
def test_a_name_is_read_as_it_is_written(scenario, tenths, seed):
    duration_s = tenths / 10
    assert digest_of.parse(f"{scenario} {duration_s} s seed {seed}") == (scenario, duration_s, seed, ())


def test_a_name_may_have_settings():
    entry = digest_of.parse("fig6 6 s seed 7 --set a=1 --set b={c=2}")
    assert entry == ("fig6", 6.0, 7, ("a=1", "b={c=2}"))


@pytest.mark.parametrize("name", ["", "fig6", "fig6 0.5 s", "fig6 x s seed 7", "fig6 0.5 s seed -1"])
def test_what_names_no_run_is_refused(name):
    with pytest.raises(ValueError, match="names no run"):
        digest_of.parse(name)
