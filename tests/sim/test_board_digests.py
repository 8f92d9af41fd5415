"""Runs of boards have the same bits everywhere: as frozen, in each engine and process, cut, loaded, in any order."""

import os
import sys
from functools import cache
from subprocess import PIPE

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact import engine
from miro_sim.scenario.board_scenario import load_any
from mirotwin.runs.test_file import run_test
from mirotwin.shell.firmware_image import image_for
from tests import children
from tests.sim import digests
from tests.sim.board_runs import in_pieces, play, run_of, shuffled

GOLDEN = digests.table_in(digests.BOARDS)
WHOLE = [name for name in GOLDEN if name.endswith("seed 0") and name not in digests.SHORT_BOARDS]
SESSIONS = [
    f"examples/boards/{name}.scenario.toml"
    for name in ("car/drives", "car/emergency", "follower/turns", "modbus/address", "rover/pause")
]
"""A file of each board; what they do: send, put values, switch power."""


@pytest.fixture(autouse=True)
def at_the_top(monkeypatch):
    monkeypatch.chdir(digests.ROOT)


def test_the_table_has_every_scenario_of_the_boards_and_no_other_run():
    assert list(GOLDEN) == list(digests.board_names())


@pytest.mark.parametrize("name", [name for name in GOLDEN if name not in WHOLE])
def test_a_run_has_its_bits(name):
    assert digests.digest(name) == GOLDEN[name]


@pytest.mark.parametrize("name", WHOLE)
def test_the_test_of_a_board_passes_with_its_bits(name):
    result = run_test(digests.parse(name).scenario)
    assert (result.verdict, result.digest) == ("passed", GOLDEN[name])


def test_a_net_list_has_the_bits_of_the_compiled_board():
    assert GOLDEN[f"net list: {digests.SHORT}"] == digests.table_in(digests.GOLDEN)[digests.SHORT]


EXPECTED = [GOLDEN[name] for name in digests.SHORT_BOARDS]


def start(**env):
    options = ("--engine", engine.active(), *digests.SHORT_BOARDS)
    command = [sys.executable, "-m", "tests.sim.digests", *options]
    return children.start(command, cwd=digests.ROOT, env={**os.environ, **env}, stdout=PIPE, text=True)


@pytest.mark.parametrize(
    "env",
    [
        {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-AVX2"},
        {"NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX"},
    ],
    ids=lambda env: next(iter(env)),
)
def test_switches_of_the_environment_change_nothing(env):
    assert start(**env).communicate()[0].split() == EXPECTED


def test_two_processes_at_once_with_other_hash_seeds_give_the_same():
    other = {"PYTHONHASHSEED": "12345", "LC_ALL": "C", "TZ": "Asia/Seoul"}
    both = [start(**env) for env in ({"PYTHONHASHSEED": "1"}, other)]
    assert [process.communicate()[0].split() for process in both] == [EXPECTED, EXPECTED]


@pytest.mark.parametrize("name", digests.SHORTEST_BOARDS)
def test_so_do_uncompiled_parts(name):
    assert uncompiled(name) == GOLDEN[name]


@pytest.mark.slow
@pytest.mark.parametrize("name", digests.SHORT_BOARDS[len(digests.SHORTEST_BOARDS) :])
def test_so_do_they_in_longer_runs(name):
    assert uncompiled(name) == GOLDEN[name]


def uncompiled(name):
    code = f"from tests.sim.digests import digest; print(digest({name!r}))"
    return children.uncompiled(code).strip()


@cache
def played(path):
    text = load_any(path)
    return play(run_of(text, image_for(text), 0))


@pytest.mark.parametrize("path", SESSIONS)
@settings(max_examples=4)
@given(seed=st.integers(0, 1 << 32))
def test_the_order_of_a_file_changes_no_bit(path, seed):
    text = load_any(path)
    again = play(run_of(shuffled(text, seed), image_for(text), 0))
    assert (again.result().verdict, again.world.digest) == ("passed", played(path).world.digest)


@pytest.mark.parametrize("path", SESSIONS)
@settings(max_examples=4)
@given(seed=st.integers(0, 1 << 32), stops=st.integers(1, 30))
def test_a_run_that_is_stopped_saved_and_loaded_anywhere_ends_the_same(path, seed, stops):
    assert in_pieces(played(path), seed, stops) == played(path).world.digest
