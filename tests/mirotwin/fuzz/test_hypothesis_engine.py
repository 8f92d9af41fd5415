"""The engine where AFL++ is missing: what it keeps, that a seed repeats it, and that it ends at once."""

import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_robot.firmware import image_path
from miro_robot.harness.program import INPUTS, OPERATIONS, SESSION, Program
from miro_robot.image import load_hex
from mirotwin.fuzz import hypothesis_process
from mirotwin.fuzz.engine import EngineInput, Explorer
from mirotwin.fuzz.hypothesis_inputs import inputs
from mirotwin.fuzz.hypothesis_process import HypothesisRun, explore
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import RobotTarget, TargetFailure


class Toy:
    """Edge 0 for each input, 1 for an F in front, 2 once for each byte. A failure for FZ, by the byte behind it."""

    input = "bytes"
    map_size = 64

    def __init__(self, spec=None):
        self.executions = 0
        self.failure = None

    def use_map(self, edges):
        self.edges = edges

    def run(self, data):
        self.executions += 1
        self.edges[:3] = bytes([1, data[:1] == b"F", len(data) & 0xFF])
        pc = data[2] if len(data) > 2 else 0
        self.failure = TargetFailure("no_fault", 1, pc, "FZ") if data[:2] == b"FZ" else None
        return int(self.failure is not None)


TOY = TargetSpec(input="bytes", maker=f"{__name__}:Toy")


@pytest.fixture(autouse=True)
def importable_toy(monkeypatch):
    """Processes of the engine do not import from the current folder."""
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[3]))


def exploring():
    kept = []
    return kept, Explorer(Toy(), lambda kind, data: kept.append((kind, data)))


class Enough(BaseException):
    """Ends a round: Hypothesis takes exceptions derived from Exception for failures."""


def explore_for(runs, explorer, spec, seeds, seed):
    def tell():
        if explorer.target.executions >= runs:
            raise Enough

    with pytest.raises(Enough):
        explore(explorer, spec, seeds, seed, tell)


def kept_after(runs, seed, seeds=()):
    kept, explorer = exploring()
    explore_for(runs, explorer, TOY, seeds, seed)
    return kept, explorer


def test_an_input_is_kept_when_it_executes_an_edge_or_a_class_of_counts_that_is_new():
    kept, explorer = exploring()
    for data in (b"a", b"b", b"ab", b"F", b"abcd", b"1234567", b"12345678", b"Fa"):
        explorer.run(data)
    assert kept == [("queue", data) for data in (b"a", b"ab", b"F", b"abcd", b"12345678")]
    assert explorer.edges == 3


def test_a_finding_is_kept_once_for_each_check_and_place():
    kept, explorer = exploring()
    for data in (b"FZ\x01", b"FZ\x01\x02", b"FZ\x02"):
        explorer.run(data)
    assert kept == [("crashes", b"FZ\x01"), ("crashes", b"FZ\x02")]
    assert explorer.edges == 0


def test_the_seeds_are_run_first_and_the_number_of_runs_is_kept_to():
    kept, explorer = kept_after(3, 0, (b"a", b"FZ"))
    assert kept[:2] == [("queue", b"a"), ("crashes", b"FZ")]
    assert explorer.target.executions == 3


@pytest.mark.slow
def test_the_same_seed_keeps_the_same_inputs_over_several_rounds_and_another_one_others(monkeypatch):
    monkeypatch.setattr(hypothesis_process, "ROUND_EXAMPLES", 60)
    one, two, other = (kept_after(200, seed)[0] for seed in (1, 1, 2))
    assert one == two
    assert one != other


@pytest.mark.parametrize("kind", INPUTS)
@pytest.mark.parametrize("foreign", [False, True])
def test_inputs_of_all_kinds_are_drawn(kind, foreign):
    @settings(max_examples=20)
    @given(inputs(kind, 5, 4, foreign), st.data())
    def is_read(data, draw):
        assert data
        assert draw.draw(inputs(kind, 3, 0, foreign, (data,)))

    is_read()


def test_a_session_of_a_board_puts_values_and_levels_on_pins():
    program = Program(SESSION, repair=bytes, choices=3, pins=2)
    put = set()

    @settings(max_examples=60, database=None, derandomize=True)
    @given(inputs("session", foreign=True, puts=True))
    def is_read(data):
        program.read(data)
        put.update(program.put(number)[2] for number in range(program.puts))

    is_read()
    assert min(put) < 3 <= max(put), "values, and pins behind them"


def test_a_session_is_made_of_whole_operations():
    target = RobotTarget(load_hex(image_path()))

    @settings(max_examples=30)
    @given(inputs("session"))
    def is_whole(data):
        assert data[0] < len(OPERATIONS)
        target.program.read(data)
        assert target.program.count or data[0] >= OPERATIONS.index("again")

    is_whole()


def test_the_shipped_firmware_is_fed_and_its_edges_are_found():
    kept = []
    target = RobotTarget(load_hex(image_path()))
    explorer = Explorer(target, lambda kind, data: kept.append(kind))
    explore_for(60, explorer, TargetSpec(), (), 3)
    assert explorer.edges > 100
    assert set(kept) == {"queue"}


@pytest.fixture
def seeds(tmp_path):
    folder = tmp_path / "seeds"
    folder.mkdir()
    (folder / "one").write_bytes(b"FZ\x07")
    return folder


def waited(run, limit_s=60.0):
    end_s = time.monotonic() + limit_s
    while time.monotonic() < end_s:
        yield
        time.sleep(0.05)
    raise AssertionError(f"nothing came in {limit_s} s: {run.progress()}")


@pytest.mark.slow
def test_a_campaign_hands_out_each_find_once_tells_its_progress_and_ends_at_once(tmp_path, seeds):
    crashes = []
    queue = []
    with HypothesisRun(EngineInput(TOY.text(), seeds, tmp_path / "out", jobs=2, seed=5), Toy()) as run:
        for _ in waited(run):
            crashes += run.new_crashes()
            queue += run.new_queue()
            progress = run.progress()
            if progress.executions and len(crashes) >= 2 and len(queue) >= 2:
                break
        begun_s = time.monotonic()
    assert time.monotonic() - begun_s < 2.0
    assert not any(job.running for job in run.jobs)
    assert len(set(crashes)) == len(crashes)
    assert {path.parent.parent.name for path in crashes} == {"job0", "job1"}
    assert crashes[0].read_bytes().startswith(b"FZ")
    assert progress.edges is not None
    run.stop()


def test_a_process_that_is_killed_is_told_on_the_engine_that_is_asked_for(tmp_path, seeds):
    spec = TargetSpec(input="bytes", maker=TOY.maker, engine="python")
    with HypothesisRun(EngineInput(spec.text(), seeds, tmp_path / "out", seed=5), Toy()) as run:
        for _ in waited(run):
            if run.progress().executions:
                break
        run.jobs[0].process.kill()
        run.jobs[0].process.wait()
        with pytest.raises(BadInput, match="Hypothesis"):
            run.progress()


def test_a_target_that_cannot_be_made_ends_the_campaign_with_its_own_line(tmp_path, seeds):
    spec = TargetSpec(image=str(tmp_path / "none.ihx"))
    with (
        HypothesisRun(EngineInput(spec.text(), seeds, tmp_path / "out"), Toy()) as run,
        pytest.raises(BadInput, match=r"none\.ihx"),
    ):
        _wait_for_ever(run)


def _wait_for_ever(run):
    for _ in waited(run):
        run.progress()
