"""Paths in CSV files that scenarios name: read, part of the run, and mistakes told with their line."""

import tempfile
import tomllib
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_host.references.timed import TimedRef
from miro_host.references.waypoints import Waypoint, WaypointsRef
from miro_sim.scenario.file import ScenarioError, load, parse
from mirotwin.recording.reader import read
from tests.mirotwin.program import mirotwin

SCENARIO = """name = "lap"
duration_s = 0.2

[[network]]
[[network.robot]]
slot = 0
reference.file = "{}"
"""
TIMED = "t,x,y\n0,40,40\n0.5,44,40\n1,50,41\n1.5,57,43\n"
WAYPOINTS = "x_cm; y_cm; heading; speed_m_s\n# the start\n40; 40; 0; 0.1\n\n60; 40; ; \n80; 55.5; 90; 0.4\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    (tmp_path / "lap.toml").write_text(SCENARIO.format("lap.csv"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def reference(here, text, **more):
    (here / "lap.csv").write_text(text, **more)
    return load("lap.toml").scenario.networks[0].robot[0].reference


def refusal(here, text):
    with pytest.raises(ScenarioError) as caught:
        reference(here, text)
    return str(caught.value)


def test_times_and_places_are_a_path_with_a_timetable(here):
    points = ((0.0, 40.0, 40.0), (0.5, 44.0, 40.0), (1.0, 50.0, 41.0), (1.5, 57.0, 43.0))
    assert reference(here, TIMED) == TimedRef(points=points)


def test_places_are_waypoints_with_headings_and_speeds_where_they_are_given(here):
    points = (
        Waypoint(x_cm=40.0, y_cm=40.0, heading_deg=0.0, speed_m_s=0.1),
        Waypoint(x_cm=60.0, y_cm=40.0),
        Waypoint(x_cm=80.0, y_cm=55.5, heading_deg=90.0, speed_m_s=0.4),
    )
    assert reference(here, WAYPOINTS) == WaypointsRef(points=points)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_spreadsheets_tables_are_read(here, encoding):
    usual = reference(here, TIMED)
    text = TIMED.replace(",", "\t").replace("\n", "\r\n")
    assert reference(here, text, encoding=encoding, newline="") == usual


def test_a_speed_holds_up_to_the_next_point(here):
    slow = reference(here, "x,y,speed\n40,40,0.05\n60,40,\n80,40,\n").trajectory(1.0)
    fast = reference(here, "x,y\n40,40\n60,40\n80,40\n").trajectory(1.0)
    speeds = {True: [], False: []}
    for k in range(800):
        at = slow.at(0.01 * k)
        speeds[at.posture.x_m < 0.6].append(at.v_m_s)
    assert max(speeds[True]) == pytest.approx(0.05)
    assert max(speeds[False]) == pytest.approx(0.2)
    assert slow.lap.duration_s > fast.lap.duration_s + 2.5


def test_other_keys_of_the_reference_stay_and_those_of_another_kind_go(here):
    (here / "lap.csv").write_text("x,y\n40,40\n60,40\n")
    (here / "lap.toml").write_text(SCENARIO.format("lap.csv") + "reference.turn_rad_s = 2.0\n")
    assert load("lap.toml").scenario.networks[0].robot[0].reference.turn_rad_s == 2.0
    derived = 'scenario = "fig6"\nset = { network.robot.reference.file = "lap.csv" }\n'
    (here / "other.toml").write_text(derived)
    assert isinstance(load("other.toml").scenario.networks[0].robot[0].reference, WaypointsRef)


def test_the_file_is_beside_the_scenario_that_names_it_also_where_that_is_a_base(here):
    (here / "laps").mkdir()
    for name in ("lap.toml", "lap.csv"):
        (here / "laps" / name).write_text(SCENARIO.format("lap.csv") if name.endswith("toml") else TIMED)
    (here / "mine.toml").write_text('scenario = "laps/lap.toml"\nduration_s = 0.1\n')
    assert isinstance(load("mine.toml").scenario.networks[0].robot[0].reference, TimedRef)


def test_a_recording_holds_the_points_and_replays_alone(here):
    (here / "lap.csv").write_text(TIMED)
    mirotwin("run", "lap.toml", "--no-figure", "-q", "--out", "out")
    text = read("out/run.mcap").source.scenario_text
    assert tomllib.loads(text)["network"][0]["robot"][0]["reference"]["points"][1] == [0.5, 44.0, 40.0]
    assert parse(text, "") == load("lap.toml").scenario
    for name in ("lap.csv", "lap.toml"):
        (here / name).unlink()
    assert "equals the recorded one" in mirotwin.succeeds("replay", "out", "-q")


def test_another_path_is_a_difference_of_two_runs(here):
    for number, text in enumerate((TIMED, TIMED.replace("57,43", "57,44"))):
        (here / "lap.csv").write_text(text)
        mirotwin("run", "lap.toml", "--no-figure", "-q", "--out", f"out{number}")
    _, out, _ = mirotwin("diff", "out0", "out1")
    assert "reference.points" in out


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "lap.csv: holds no path; write t,x,y (s, cm), or x,y with speed (m/s)"),
        ("a,b\n", "lap.csv: line 1: 'a' is no column; "),
        ("# mine\nx,y,headin\n", "lap.csv: line 2: 'headin' is no column; did you mean heading? write t,x,y"),
        ("t,x\n0,1\n", "lap.csv: line 1: t, x are no columns of a path; write t,x,y"),
        ("t,x,y,speed\n", "lap.csv: line 1: t, x, y, speed are no columns of a path"),
        ("x,x_cm,y\n", "lap.csv: line 1: x, x_cm, y are no columns of a path"),
        (
            "t,x,y\n0,40,40\n1,50\n",
            "lap.csv: line 3: has 2 values under 3 columns; one value for each column",
        ),
        ("t,x,y\n0,40,40\n1,5O,40\n", "lap.csv: line 3: x_cm: '5O' is no number; write it as 12.5"),
        ("t,x,y\n0,40,40\n1,nan,40\n", "lap.csv: line 3: x_cm: 'nan' is no number"),
        (
            "t,x,y\n1,40,40\n\n1,50,40\n",
            "lap.csv: line 4: 1 s is not 1 ms after the point before; sort by time",
        ),
        ("t,x,y\n0,40,40\n", "lap.csv: points: there are 1; give 2 to 5000"),
        (
            "x,y\n40,40\n41,40\n",
            "lap.csv: line 3: less than 7.5 cm from line 2, the length of the robot; move them",
        ),
        (
            "x,y,speed\n40,40,9\n60,40,\n",
            "lap.csv: line 2: speed_m_s: 9.0 is out of range; must be <= 1.46",
        ),
        ('t,x,y\n0,"40,40\n1,50,40\n', "lap.csv: line "),
    ],
)
def test_what_is_no_path_is_told_with_file_line_and_remedy(here, text, message):
    said = refusal(here, text)
    assert said.startswith(message)
    assert "\n" not in said


@given(st.text(alphabet='txy,;\t\n"0123456789.-e#_ ', max_size=60))
def test_no_text_is_a_traceback(text):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "lap.toml").write_text(SCENARIO.format("lap.csv"))
        (folder / "lap.csv").write_text(text)
        with suppress(ScenarioError):
            found = load(f"{folder / 'lap.toml'}").scenario.networks[0].robot[0].reference
            assert isinstance(found, TimedRef | WaypointsRef)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("none.csv", "lap.toml: network[0].robot[0].reference.file: none.csv: no such file; give its path"),
        ("../lap.csv", "lap.toml: network[0].robot[0].reference.file: ../lap.csv lies outside of the folder"),
        ("", "lap.toml: network[0].robot[0].reference.file: expected a path, got ''"),
    ],
)
def test_a_file_that_cannot_be_named_is_refused(here, name, message):
    (here / "lap.toml").write_text(SCENARIO.format(name))
    with pytest.raises(ScenarioError) as caught:
        load("lap.toml")
    assert str(caught.value).startswith(message)


def test_no_recording_and_no_option_names_a_file(here):
    (here / "lap.csv").write_text(TIMED)
    with pytest.raises(ScenarioError, match=r"reference\.file: is read with a scenario's file only"):
        parse(SCENARIO.format("lap.csv"), "")
    err = mirotwin.refuses("run", "fig6", "--set", "network.robot.reference.file=lap.csv")
    assert (
        "reference.file: is read with a scenario's file only; write reference = { file = .. } into one" in err
    )
