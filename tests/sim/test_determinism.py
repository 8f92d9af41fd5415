"""The same scenario, firmware and seed give the same bits: twice, elsewhere, compiled or not, however it is cut."""

import json
import os
import sys
from pathlib import Path

import pytest

from miro_exact import engine
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario import file as scenario_file
from miro_sim.scenario.profiles import profiles
from miro_sim.world.world import World
from tests import children

MIROTWIN = Path(sys.executable).with_name("mirotwin")
GOLDEN = Path(__file__).parents[1] / "vectors" / "digests.json"
SEED = 7
SHORT_RADIO = """
name = "short"
duration_s = 0.1

[[network]]
radio.profile = "{profile}"

[[network.robot]]
slot = 0
reference.kind = "line"

[[network.robot]]
slot = 2
reference.kind = "arc"

[[network]]
radio.profile = "{profile}"

[[network.robot]]
slot = 1
reference.kind = "line"
"""


def short_scenario(folder, name="fig6", duration_s=0.5):
    """The built-in scenario, cut short so that an uncompiled run stays bearable."""
    scenarios = Path(__file__).parents[2] / "sim" / "miro_sim" / "scenario" / "builtin"
    text = (scenarios / f"{name}.toml").read_text()
    lines = [
        f"duration_s = {duration_s}" if line.startswith("duration_s") else line for line in text.splitlines()
    ]
    path = folder / f"{name}.toml"
    path.write_text("\n".join(lines) + "\n")
    return path


def digest_of_a_process(folder, *options, env=None, name="fig6"):
    out = folder / f"out{len(list(folder.iterdir()))}"
    command = [
        MIROTWIN,
        "run",
        short_scenario(folder, name),
        "--out",
        out,
        "--seed",
        str(SEED),
        "--quiet",
        *options,
    ]
    children.run(command, check=True, env={**os.environ, **(env or {})}, capture_output=True, text=True)
    return json.loads((out / "summary.json").read_text())["digest"]


def world(folder, seed=SEED):
    return World(scenario_file.load(str(short_scenario(folder))).scenario, seed, load_hex(image_path()))


def digest_of(world):
    while not world.finished:
        world.step()
    return world.digest


@pytest.fixture(scope="module")
def golden():
    return json.loads(GOLDEN.read_text())["fig6 0.5 s seed 7"]


def test_twice_in_one_process(tmp_path, golden):
    assert digest_of(world(tmp_path)) == digest_of(world(tmp_path)) == golden


def test_another_seed_gives_other_bits(tmp_path, golden):
    assert digest_of(world(tmp_path, seed=8)) != golden


@pytest.mark.parametrize("name", engine.ENGINES)
def test_each_engine_gives_the_golden_digest(tmp_path, golden, name):
    if name == "compiled" and engine.active() != "compiled":
        pytest.skip("no compiled modules here")
    assert digest_of_a_process(tmp_path, "--engine", name) == golden


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
def test_switches_of_the_environment_change_nothing(tmp_path, golden, env):
    assert digest_of_a_process(tmp_path, env=env) == golden


def test_recording_everything_changes_nothing(tmp_path, golden):
    assert digest_of_a_process(tmp_path, "--record", "full") == golden


@pytest.mark.parametrize("cut_ticks", [12, 40_009, CONTROL_PERIOD_TICKS - 1, 3 * CONTROL_PERIOD_TICKS + 5])
def test_any_cutting_of_a_run_gives_the_same_state(tmp_path, cut_ticks):
    whole, cut = world(tmp_path), world(tmp_path)
    end = 4 * CONTROL_PERIOD_TICKS if cut_ticks > 12 else 60_000
    whole.run_to(end)
    tick = 0
    while tick < end:
        tick = min(end, tick + cut_ticks)
        cut.run_to(tick)
    assert cut.state.save() == whole.state.save()


@pytest.mark.parametrize("at_tick", [5_000, 801_000, 1_000_003, 1_321_777, 2_500_001])
def test_a_world_saved_anywhere_and_loaded_elsewhere_goes_on_with_the_same_bits(tmp_path, at_tick):
    first = world(tmp_path)
    first.run_to(at_tick)
    second = world(tmp_path)
    second.load(first.save())
    for period in range(1, 6):
        first.run_to(period * CONTROL_PERIOD_TICKS)
        second.run_to(period * CONTROL_PERIOD_TICKS)
        assert second.state.save() == first.state.save()
    assert second.digest == first.digest


@pytest.mark.parametrize("profile", sorted(profiles()))
@pytest.mark.parametrize("seed", [0, 1, 7])
def test_every_radio_profile_gives_one_digest_however_the_run_is_cut(profile, seed):
    text = SHORT_RADIO.format(profile=profile)
    worlds = [World(scenario_file.parse(text, "short"), seed, load_hex(image_path())) for _ in range(2)]
    worlds[0].step()
    for tick in range(8192, CONTROL_PERIOD_TICKS, 8192):
        worlds[1].run_to(tick)
    worlds[1].step()
    assert worlds[0].digest == worlds[1].digest
