"""The same scenario, firmware and seed give the same bits: as frozen, elsewhere, compiled or not, however it is cut."""

import json
import os
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact import engine
from miro_exact.clock import CONTROL_PERIOD_TICKS
from tests import children
from tests.sim import digests
from tests.sim.engines import Checkpoint, compare, lockstep
from tests.sim.machines import MACHINES, ROOT, Missing, Refused, check_tools, run
from tests.sim.world.rig import fig6

MIROTWIN = Path(sys.executable).with_name("mirotwin")
GOLDEN = json.loads(digests.GOLDEN.read_text())
SHORT = GOLDEN[digests.SHORT]


def test_another_seed_gives_other_bits():
    assert digests.digest("fig6 0.5 s seed 8") != SHORT


@pytest.mark.parametrize("name", engine.ENGINES)
def test_each_engine_gives_the_golden_digest(tmp_path, name):
    if name == "compiled" and engine.active() != "compiled":
        pytest.skip("no compiled modules here")
    assert digest_of_a_process(tmp_path / "out", "--engine", name) == SHORT


def digest_of_a_process(out, *options, env=None):
    command = [
        MIROTWIN,
        "run",
        "fig6",
        "--set",
        "duration_s=0.5",
        "--seed",
        "7",
        "--out",
        out,
        "--quiet",
        *options,
    ]
    children.run(command, check=True, env={**os.environ, **(env or {})}, capture_output=True)
    return json.loads((out / "summary.json").read_text())["digest"]


@pytest.mark.parametrize(
    "env",
    [
        {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-AVX2"},
        {"NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX"},
        {"PYTHONHASHSEED": "12345"},
        {"OPENBLAS_NUM_THREADS": "1", "LC_ALL": "C", "TZ": "Asia/Seoul"},
    ],
    ids=lambda env: next(iter(env)),
)
def test_switches_of_the_environment_change_nothing(tmp_path, env):
    assert digest_of_a_process(tmp_path / "out", env=env) == SHORT


def test_recording_everything_changes_nothing(tmp_path):
    assert digest_of_a_process(tmp_path / "out", "--record", "full") == SHORT


@pytest.mark.parametrize("cut_ticks", [12, 40_009, CONTROL_PERIOD_TICKS - 1, 3 * CONTROL_PERIOD_TICKS + 5])
def test_any_cutting_of_a_run_gives_the_same_state(cut_ticks):
    whole, cut = fig6(), fig6()
    end = 4 * CONTROL_PERIOD_TICKS if cut_ticks > 12 else 60_000
    whole.run_to(end)
    tick = 0
    while tick < end:
        tick = min(end, tick + cut_ticks)
        cut.run_to(tick)
    assert cut.state.save() == whole.state.save()


def test_the_table_has_a_run_of_everything_and_no_other():
    assert list(GOLDEN) == list(digests.names())


@pytest.mark.parametrize("name", GOLDEN)
def test_a_run_has_its_bits(name, monkeypatch):
    monkeypatch.chdir(digests.ROOT)
    assert digests.digest(name) == GOLDEN[name]


@pytest.mark.parametrize("arguments", [[], [digests.SHORT]], ids=["table", "run"])
def test_an_engine_that_is_refused_says_so_in_one_line_and_by_its_exit_code(arguments, monkeypatch, capsys):
    monkeypatch.setattr(engine.install(), "missing", lambda: ["miro_robot.mcs51.cpu"])
    monkeypatch.setattr(sys, "argv", ["digests", *arguments])
    assert digests.main() == digests.REFUSED
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert said.err.startswith("no compiled module for miro_robot.mcs51.cpu; ")


@pytest.mark.slow
@pytest.mark.skipif(engine.active() != "compiled", reason="no compiled modules here")
def test_both_engines_have_equal_states_at_every_checkpoint():
    """With frames accepted, LM629 commands and answers by radio, each with its interrupts."""
    checkpoints = list(lockstep(1_000_000))
    last = checkpoints[-1]
    assert last.instructions >= 1_000_000
    assert len(checkpoints) > 1000
    assert min(last.frames, last.commands, last.sent) > 100, last
    assert len({checkpoint.sha256 for checkpoint in checkpoints}) == len(checkpoints)


LINES = [Checkpoint(0, 100_003 * n, 500 * n, n, 2 * n, 3 * n, f"{n:064x}").line() + "\n" for n in range(5)]


@pytest.mark.parametrize(
    "other",
    [[*LINES[:3], LINES[3].replace("3\n", "4\n"), LINES[4]], [], LINES[:4]],
    ids=["other", "none", "fewer"],
)
def test_the_first_checkpoint_that_differs_is_shown(other):
    assert [checkpoint.instructions for checkpoint in compare(LINES, LINES)] == [0, 500, 1000, 1500, 2000]
    with pytest.raises(AssertionError, match="the engines part:\ncompiled 0 "):
        list(compare(LINES, other))


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
    code = f"import sys; print('rounds twice', file=sys.stderr); sys.exit({digests.REFUSED})"
    with pytest.raises(Refused, match=r"^rounds twice$"):
        run([sys.executable, "-c", code])


@given(st.sampled_from(["fig6", "fig8"]), st.integers(1, 999), st.integers(0, 2**63 - 1))
def test_a_name_is_read_as_it_is_written(scenario, tenths, seed):
    duration_s = tenths / 10
    assert digests.parse(f"{scenario} {duration_s} s seed {seed}") == (scenario, duration_s, seed, ())


def test_a_name_may_have_settings():
    entry = digests.parse("fig6 6 s seed 7 --set a=1 --set b={c=2}")
    assert entry == ("fig6", 6.0, 7, ("a=1", "b={c=2}"))


@pytest.mark.parametrize("name", ["", "fig6", "fig6 0.5 s", "fig6 x s seed 7", "fig6 0.5 s seed -1"])
def test_what_names_no_run_is_refused(name):
    with pytest.raises(ValueError, match="names no run"):
        digests.parse(name)
