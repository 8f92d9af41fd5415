"""Laws in a distribution of their own: installed by pip, driven, saved in mid-run, and what is said of a wrong one."""

import json
import math
import os
import shutil
import sys
from pathlib import Path

import pytest

from miro_exact import engine as engines
from mirotwin.recording.reader import read
from tests import children
from tests.host.distribution import install

pytestmark = pytest.mark.slow

EXAMPLE = Path(__file__).parents[2] / "examples" / "laws"
MIROTWIN = Path(sys.executable).with_name("mirotwin")
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
    """A folder with the example as pip installs it."""
    folder = tmp_path_factory.mktemp("site")
    source = shutil.copytree(EXAMPLE, folder / "source")
    options = ["--quiet", "--no-index", "--no-build-isolation", "--no-deps", "--target", folder / "installed"]
    children.run([sys.executable, "-m", "pip", "install", *options, source], check=True)
    return folder / "installed"


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(params=SHORTENED)
def either(request, tmp_path):
    """A short scenario with each of the laws, and the law's name in file names."""
    path = tmp_path / "either.toml"
    path.write_text(SHORTENED[request.param])
    return request.param, path


def environment(site):
    """This process's, with `site` before what else modules are looked up in (CONTRIBUTING.md: another checkout)."""
    paths = [str(site), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}


def python(site, code, *arguments, check=True):
    done = children.run(
        [sys.executable, "-c", code, *arguments],
        env=environment(site),
        capture_output=True,
        text=True,
        check=check,
    )
    return done.stdout.strip()


def mirotwin(site, *arguments):
    return children.run(
        [MIROTWIN, *arguments],
        env=environment(site),
        capture_output=True,
        text=True,
        check=False,
    )


def refusal(done, before=()):
    """The one line on stderr; `before` says what other lines go before it."""
    assert done.returncode == 2, done.stderr
    *lines, line = done.stderr.splitlines()
    assert lines == list(before)
    return line


def test_saved_in_mid_run_and_loaded_in_another_process_it_goes_on_with_the_same_bits(site, either, tmp_path):
    name, scenario = either
    saved = tmp_path / "saved"
    whole = python(site, WORLD + FINISH, scenario, saved)
    python(site, WORLD + SAVE, scenario, saved)
    assert python(site, WORLD + LOAD + FINISH, scenario, saved) == whole
    if name == "samson":  # which has a memory, and that is what matters
        assert python(site, WORLD + LOAD + FORGET + FINISH, scenario, saved) != whole


@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_the_command_line_runs_it_records_its_inner_values_and_replays_it(site, either, tmp_path, engine):
    name, scenario = either
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
    line = refusal(mirotwin("", "replay", out / "run.mcap", "--quiet"))  # where it is not installed
    place = "run.mcap: scenario.toml: network[0].robot[0].controller.law: '"
    assert place in line
    assert "' is not one of the choices" in line


@pytest.mark.parametrize("name", SHORTENED)
def test_it_tracks_its_path(site, tmp_path, name):
    done = mirotwin(site, "run", EXAMPLE / f"{name}.toml", "--out", tmp_path / "out", "--quiet")
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["tracking"]["rms_position_cm"] < 2.5


DRIVEN = """
from miro_host.pilot import Pilot
from miro_host.posture import Posture
from miro_host.references.line import StraightLine
from pursuit_law import Parameters

pilot = Pilot(StraightLine(), Parameters(lookahead_s=0.5, max_v_dot_m_s2=1e3, max_w_dot_rad_s2=1e3).law())
for x_m, y_m, theta_rad in ((0.5, -0.1, 0.0), (1.1, 0.0, 0.0), (0.65, 0.0, 0.0)):
    command = pilot.update(Posture(x_m, y_m, theta_rad), 3.0)
    print(command.v_m_s, command.w_rad_s)
"""


def test_pure_pursuit_drives_on_the_arc_to_the_goal_and_turns_round_for_one_behind(site):
    """At 3 s the reference is at 0.55 m and will be at 0.65 m after the 0.5 s of the look-ahead."""
    aside, behind, there = (
        [float(number) for number in line.split()] for line in python(site, DRIVEN).splitlines()
    )
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
def test_a_bad_key_of_its_table_is_refused_like_one_of_our_own(site, scenario, old, new, expected):
    scenario.write_text(SHORT.replace(old, new))
    line = refusal(mirotwin(site, "run", scenario, "--out", scenario.parent / "out"))
    assert line.startswith(f"mirotwin: error: {scenario}: network[0].robot[0].controller")
    assert expected in line
    assert not (scenario.parent / "out").exists()


def test_without_the_distribution_the_law_is_unknown(scenario):
    line = refusal(mirotwin("", "run", scenario))
    assert "controller.law: 'samson' is not one of the choices; use yang_kim" in line


BROKEN = """
from miro_host.laws.interface import Law, LawParameters, Velocities

class Parameters(LawParameters, frozen=True, tag="broken"):
    how: str = "nan"

    def __post_init__(self):
        super().__post_init__()
        if self.how == "check":
            raise KeyError("how")
        if self.how == "refuse":
            raise ValueError("how: refuse is refused")

    def law(self):
        return Broken(self)

class Broken(Law[Parameters]):
    def __init__(self, parameters):
        super().__init__(parameters)
        if parameters.how == "construct":
            raise RuntimeError("no model file")

    def step(self, given):
        return Velocities(float("nan") if given.t_s > 0.1 else 0.1, 0.0)
"""


@pytest.mark.parametrize(
    ("how", "expected"),
    [
        ("check", "controller: law 'broken' cannot check its parameters: KeyError: 'how'"),
        ("refuse", "controller.how: refuse is refused"),
        (
            "construct",
            "net0/robot0: tick 0 (0.000000 s): law 'broken' cannot be made: RuntimeError: no model file (",
        ),
        (
            "nan",
            "net0/robot0: tick 2402400 (0.100100 s): law 'broken' failed: `step` returned v_m_s = nan, which is",
        ),
    ],
)
def test_a_law_that_fails_ends_the_run_with_one_line(tmp_path, how, expected):
    install(tmp_path, "broken-law", "1", {"broken": "plug_broken:Parameters"}, plug_broken=BROKEN)
    scenario = tmp_path / "my.toml"
    scenario.write_text(SHORT[: SHORT.index("law =")] + f'law = "broken"\nhow = "{how}"\n')
    out = tmp_path / "out"
    kept = f"the run broke off after 3 control periods; they are in {out / 'run.part.mcap'}"
    done = mirotwin(tmp_path, "run", scenario, "--out", out, "--quiet")
    line = refusal(done, [f"mirotwin: {kept}"] if how == "nan" else [])
    assert expected in line
    assert line.startswith(f"mirotwin: error: {scenario}: ")
    if how == "nan":
        recording = read(out / "run.part.mcap")
        assert len(recording.periods) == 3
        assert expected in recording.broken_off
        assert expected in json.loads((out / "summary.part.json").read_text())["reason"]
    message = python(
        tmp_path,
        f"try:\n{WORLD.replace(chr(10), chr(10) + '    ')}\n    world.run_to(24_000_000)\n"
        "except ValueError as error:\n    print(error)",
        scenario,
        "",
    )
    assert expected in message


def test_a_law_that_cannot_be_imported_names_its_distribution_and_the_reason(tmp_path):
    install(
        tmp_path, "broken-law", "1", {"broken": "plug_broken:Parameters"}, plug_broken="import no_such_module"
    )
    scenario = tmp_path / "my.toml"
    scenario.write_text(SHORT[: SHORT.index("law =")] + 'law = "broken"\n')
    line = refusal(mirotwin(tmp_path, "run", scenario, "--out", tmp_path / "out"))
    assert "law 'broken' (plug_broken:Parameters, from broken-law 1) cannot be imported" in line
    assert "ModuleNotFoundError: No module named 'no_such_module'" in line
