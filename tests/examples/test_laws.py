"""Laws in a distribution of their own: installed by pip, driven, saved in mid-run, and what is said of wrong keys."""

import json
import math
import sys
from importlib import import_module

import pytest

from miro_exact import engine as engines
from miro_host.pilot import Pilot
from miro_host.posture import Posture
from miro_host.references.arc import StraightLine
from miro_sim.scenario.file import ScenarioError, parse
from mirotwin.recording.reader import read
from tests.examples.rig import EXAMPLES, MIROTWIN, installed, run

pytestmark = pytest.mark.slow

EXAMPLE = EXAMPLES / "laws"
SHORTENED = {
    name: (EXAMPLE / f"{name}.toml")
    .read_text(encoding="utf-8")
    .replace("duration_s = 6.0", "duration_s = 0.25")
    for name in ("samson", "pursuit")
}
SHORT = SHORTENED["samson"]
INNER = {"samson": ["e1_m", "e2_m", "e3_rad"], "pursuit": ["goal_x_m", "goal_y_m"]}
AT_TICK = 4_123_457  # in the middle of a period, a frame and a byte
WORLD = """
import sys
from pathlib import Path
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World

world = World(load(sys.argv[1]).scenario, 7, load_hex(image_path()))
saved = Path(sys.argv[2])
"""
SAVE = f"world.run_to({AT_TICK})\nsaved.write_bytes(world.save())"
LOAD = "world.load(saved.read_bytes())\n"
FORGET = "world.networks[0].robots[0].pilot.law.e2_m = 0.0\n"
FINISH = "while not world.finished:\n    world.step()\nprint(world.digest)"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    return installed("laws", tmp_path_factory.mktemp("site"))


def short_of(name, folder):
    """A short scenario with this law."""
    path = folder / "either.toml"
    path.write_text(SHORTENED[name])
    return path


@pytest.fixture
def here(site, monkeypatch):
    """The laws in this process, which forgets them afterwards."""
    monkeypatch.syspath_prepend(str(site))
    yield
    for name in ("samson_law", "pursuit_law"):
        sys.modules.pop(name, None)


def python(site, code, *arguments):
    done = run(site, sys.executable, "-c", code, *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def mirotwin(site, *arguments):
    return run(site, MIROTWIN, *arguments)


@pytest.mark.parametrize("name", SHORTENED)
def test_saved_in_mid_run_and_loaded_in_another_process_it_goes_on_with_the_same_bits(site, name, tmp_path):
    scenario = short_of(name, tmp_path)
    saved = tmp_path / "saved"
    whole = python(site, WORLD + FINISH, scenario, saved)
    python(site, WORLD + SAVE, scenario, saved)
    assert python(site, WORLD + LOAD + FINISH, scenario, saved) == whole
    if name == "samson":  # which has a memory, and that is what matters
        assert python(site, WORLD + LOAD + FORGET + FINISH, scenario, saved) != whole


@pytest.mark.parametrize(
    ("name", "engine"), [("samson", "compiled"), ("samson", "python"), ("pursuit", "compiled")]
)
def test_the_command_line_runs_it_records_its_inner_values_and_replays_it(site, name, tmp_path, engine):
    scenario = short_of(name, tmp_path)
    if engine == "compiled" and engines.active() != "compiled":
        pytest.skip("no compiled modules here")
    out = tmp_path / "out"
    done = mirotwin(site, "run", scenario, "--seed", "7", "--out", out, "--quiet", "--engine", engine)
    assert done.returncode == 0, done.stderr
    digest = json.loads((out / "summary.json").read_text())["digest"]
    assert digest == python(site, WORLD + FINISH, scenario, "")
    last = read(out / "run.mcap").periods[-1].robots[0].control
    assert list(last.inner) == INNER[name]
    assert all(abs(value) > 0.0 for value in last.inner.values())
    assert mirotwin(site, "replay", out / "run.mcap", "--quiet").returncode == 0
    gone = mirotwin("", "replay", out / "run.mcap", "--quiet")  # where it is not installed
    assert gone.returncode == 2
    *_, line = gone.stderr.splitlines()  # the first says that the plug-in is not installed
    assert "run.mcap: scenario.toml: network[0].robot[0].controller.law: '" in line
    assert "' is not one of the choices; use yang_kim" in line


@pytest.mark.parametrize("name", SHORTENED)
def test_it_tracks_its_path(site, tmp_path, name):
    done = mirotwin(site, "run", EXAMPLE / f"{name}.toml", "--out", tmp_path / "out", "--quiet")
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["tracking"]["rms_position_cm"] < 2.5


def test_pure_pursuit_drives_on_the_arc_to_the_goal_and_turns_round_for_one_behind(here):
    """At 3 s the reference is at 0.55 m and will be at 0.65 m after the 0.5 s of the look-ahead."""
    parameters = import_module("pursuit_law").Parameters(
        lookahead_s=0.5, max_v_dot_m_s2=1e3, max_w_dot_rad_s2=1e3
    )
    pilot = Pilot(StraightLine(), parameters.law())
    places = ((0.5, -0.1, 0.0), (1.1, 0.0, 0.0), (0.65, 0.0, 0.0))
    commands = [pilot.update(Posture(*place), 3.0) for place in places]
    aside, behind, there = ([command.v_m_s, command.w_rad_s] for command in commands)
    far_m = math.hypot(0.15, 0.1)
    assert aside == pytest.approx([far_m / 0.5, far_m / 0.5 * 2 * 0.1 / far_m**2])
    assert behind == pytest.approx([0.9, 3.7])  # 2 / l of curvature, v / l = 2/s, cut to the limit of w
    assert there == [0.0, 0.0]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("k1_per_s = 1.0", "k1 = 1.0", "controller.k1: unknown key; use k1_per_s, in 1/s"),
        ("k1_per_s = 1.0", "k1_per_s = '1'", "controller.k1_per_s: expected a number in 1/s, got a string"),
        ("k1_per_s = 1.0", "k1_per_s = -1", "controller.k1_per_s: -1 is out of range; must be >= 0.0 in 1/s"),
        ("weight = 0.35", "wait = 0.35", "controller.wait: unknown key; did you mean weight?"),
        ("max_v_m_s = 0.8", "max_v_m_s = 0", "controller.max_v_m_s: 0 is out of range; must be > 0.0"),
        ('"samson"\nk1', '"samsun"\nk1', "did you mean samson? use "),
        (
            'law = "samson"',
            "law = 3",
            "controller.law: expected a string, got a whole number (3); use yang_kim",
        ),
    ],
)
def test_a_bad_key_of_its_table_is_refused_like_one_of_our_own(here, old, new, expected):
    with pytest.raises(ScenarioError) as caught:
        parse(SHORT.replace(old, new), "my.toml")
    assert f"{caught.value}".startswith("my.toml: network[0].robot[0].controller")
    assert expected in f"{caught.value}"
