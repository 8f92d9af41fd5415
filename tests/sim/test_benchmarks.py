"""Tables of `benchmarks`, small enough for every test run: disturbances, the improved chain, one frame."""

import csv
import itertools
import math
import re
from pathlib import Path

import pytest

from benchmarks import chain, disturbances, frame_loss, improved, one_frame_page, vision
from benchmarks.interval import clopper_pearson
from benchmarks.one_frame import Way, edges_of
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_sim.pitch import ground
from miro_sim.scenario.build import dead_s
from miro_sim.scenario.file import load
from mirotwin.campaign.chances import wilson
from mirotwin.campaign.single import run_single
from tests.sim.world.rig import finished, image, world_of

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/background/disturbances.md"


def stored(name):
    """The rows of a table in the folder benchmarks."""
    with (ROOT / "benchmarks" / name).open(newline="", encoding="utf-8") as stream:
        return list(csv.reader(stream))


def rows_of(page):
    """The cells of all lines in the page's blocks of text."""
    blocks = re.findall(r"```text\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    return [re.split("  +", line) for block in blocks for line in block.splitlines()]


def test_the_table_of_the_eye_has_each_case_and_the_page_has_rows_of_it():
    head, *rows = stored("vision.csv")
    assert head == list(vision.COLUMNS)
    assert [row[0] for row in rows] == list(vision.cases())
    known = {row[0]: [row[1], row[3], row[4], row[6]] for row in rows}
    _, *shown = rows_of(ROOT / "docs/background/vision.md")
    assert shown
    for name, *cells in shown:
        assert known[name] == cells


def test_a_row_of_the_eye_has_a_figure_in_each_column():
    row = vision.row("binary", vision.measure(vision.cases()["binary"], 20, 0))
    assert len(row) == len(vision.COLUMNS)
    assert row[-2:] == ["20", "0"]


@pytest.mark.parametrize("case", disturbances.CASES[1:], ids=lambda case: case.name)
def test_each_case_is_a_scenario_of_its_own(case):
    base = disturbances.settings_of(disturbances.CASES[0], "paper")
    for figure in disturbances.FIGURES:
        assert load(figure, disturbances.settings_of(case, "paper")).scenario != load(figure, base).scenario


@pytest.mark.parametrize("controller", disturbances.CONTROLLERS)
def test_estimators_are_told_the_delay_and_nothing_else(controller):
    ages = set()
    for case in disturbances.CASES:
        scenario = load("fig6", disturbances.settings_of(case, controller)).scenario
        estimator = scenario.networks[0].robot[0].estimator
        if controller != "paper":
            assert estimator.age_s == pytest.approx(scenario.camera.delay_frames * 1001 / 30000, abs=1e-9)
            ages.add(estimator.age_s)
    assert len(ages) == (0 if controller == "paper" else 3)


def test_names_of_groups_and_parts_of_names_choose_cases():
    chosen = disturbances.chosen(["slip", "8 bits"])
    assert {disturbances.CASES[number].group for number in chosen} == {"slip", "word"}
    assert len(chosen) == 3
    assert len(disturbances.chosen([""])) == len(disturbances.CASES)


@pytest.mark.slow
def test_a_table_of_one_seed_has_a_figure_in_each_cell(capsys):
    assert disturbances.main(["--only", "base", "--seeds", "0", "--jobs", "1"]) == 0
    out, err = capsys.readouterr()
    head, *rows = csv.reader(out.splitlines())
    assert head == list(disturbances.COLUMNS)
    cells = itertools.product(("none",), disturbances.FIGURES, disturbances.CONTROLLERS)
    assert [tuple(row[:3]) for row in rows] == list(cells)
    assert all(re.fullmatch(r"0\.\d\d|1\.\d\d", row[3]) for row in rows)
    assert "6 of 6 cells" in err


@pytest.mark.parametrize("arguments", ["--only weather", "--seeds x", "--jobs 0"])
def test_what_cannot_be_run_is_refused(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        disturbances.main(arguments.split())
    assert caught.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


def test_the_table_of_disturbances_has_a_row_for_each_case_and_the_page_has_rows_of_it():
    head, *rows = stored("disturbances.csv")
    assert head == list(disturbances.COLUMNS)
    names = [case.name for case in disturbances.CASES]
    keys = itertools.product(names, disturbances.FIGURES, disturbances.CONTROLLERS)
    assert [tuple(row[:3]) for row in rows] == list(keys)
    known = {tuple(key): f"{cm} ({outside})" if int(outside) else cm for *key, cm, outside in rows}
    shown = [row for row in rows_of(PAGE) if row[0] in names]
    assert len(shown) >= 10
    for name, *cells in shown:
        assert cells == [known[name, "fig6", controller] for controller in disturbances.CONTROLLERS]


IMPROVED = {case.name: case for case in improved.cases()}
SHORT = ("duration_s=2.0", 'camera={kind="gaussian"}', 'network.robot.controller={law="body_frame"}')


def run_world(*sets, seed=1, scenario="fig6"):
    return finished(world_of(scenario, *SHORT, *sets, seed=seed))


def run_case(name, estimator):
    (job,) = improved.works(IMPROVED[name], range(1, 2), "body_frame", estimator)
    return improved.result_of(run_single(job))


@pytest.mark.parametrize("estimator", ["ekf", "ekf+telemetry"])
def test_a_calibrated_camera_brings_the_robot_within_a_millimetre_and_a_half(estimator):
    result = run_case("calibrated, Fig. 6", estimator)
    assert result.settled
    assert 0.0 < result.position_cm < 0.15
    assert result.off_pitch_s == 0.0


def test_uneven_wheels_do_not_lead_the_robot_aside():
    result = run_case("wheels 1.05 and 0.95, calibrated, Fig. 8", "ekf")
    assert result.position_cm < 0.3


def test_starts_are_drawn_on_the_pitch_near_enough_and_over_all_headings():
    starts = [improved.start_of(seed, 0.6) for seed in range(200)]
    assert all(ground.holds(start) and math.hypot(start.x_m, start.y_m) <= 0.6 for start in starts)
    assert {int(4.0 * (start.theta_rad + math.pi) / math.tau) for start in starts} == {0, 1, 2, 3}
    assert improved.start_of(7, 0.6) == starts[7]


def test_a_start_that_was_drawn_is_where_the_robot_starts():
    case = IMPROVED["starts within 60 cm, arc"]
    start = improved.start_of(3, case.near_m)
    assert improved.scenario_heading_rad(case) == math.radians(60.0)
    world = run_world(*improved.start_settings(case, 3), "duration_s=0.01", scenario="fig8")
    theta_rad = world.networks[0].robots[0].drive.pose_at(0)[2]
    assert abs(math.remainder(theta_rad - start.theta_rad, math.tau)) < 1e-9


def test_a_line_says_what_is_beyond_its_limits():
    case = improved.Case("name", "fig6", (), improved.Limits(0.25, 0.5, settles=True))
    fine = improved.Result(0.2, True, 0.0)
    assert improved.row(case, [fine] * 20) == ("| name | 0.200 | 0.200 | 0.200 | 20 of 20 | 0.0 |  |", True)
    assert not improved.row(case, [fine, improved.Result(0.2, False, 1.0)])[1]
    assert not improved.row(case, [fine] * 18 + [fine._replace(position_cm=0.6)] * 2)[1]
    assert improved.row(case, [fine] * 19 + [fine._replace(position_cm=0.6)])[1] is False
    assert not improved.row(case, [fine._replace(position_cm=0.3)] * 20)[1]


def test_the_case_of_lost_frames_loses_a_fifth_of_them():
    world = run_world(improved.LOSSY, "duration_s=6.0")
    share = world.networks[0].robots[0].counter(0) / world.networks[0].frames_sent
    assert 0.7 < share < 0.9


@pytest.mark.parametrize(("robots", "expected_s"), [(3, 0.02796), (5, 0.03629)])
def test_the_pilot_is_told_the_delay_of_its_network(robots, expected_s):
    world = world_of("fig6", f"network.robots={robots}")
    assert dead_s(world.scenario, world.scenario.networks[0]) == pytest.approx(expected_s, abs=1e-5)
    assert world.networks[0].robots[0].pilot.dead_s == dead_s(world.scenario, world.scenario.networks[0])


def test_the_cost_is_that_of_both_loops_over_all_periods():
    chains = ("yang_kim", "none"), ("body_frame", "ekf")
    plain, ours = (chain.world("fig6", *each, image()) for each in chains)
    spent = chain.pair(plain, ours)
    assert plain.finished
    assert ours.finished
    assert spent[2] == 180
    assert min(spent[:2]) > 0.0


def deviations(point):
    expected = frame_loss.formula(point.robots, point.eb_n0_db)
    return (point.lost - point.sent * expected) / (point.sent * expected * (1 - expected)) ** 0.5


@pytest.mark.parametrize("robots", [3, 5])
@pytest.mark.parametrize(("receiver", "frames"), [(frame_loss.decoder, 1500), (frame_loss.firmware, 150)])
def test_as_many_frames_are_lost_as_have_a_wrong_bit_where_it_counts(receiver, frames, robots):
    assert abs(deviations(receiver(robots, 10.0, frames, 4))) < 4


def test_a_slicer_that_has_not_settled_costs_frames():
    assert deviations(frame_loss.slicer(3, 10.0, 1500, 4)) > 4


@pytest.mark.parametrize("receiver", [frame_loss.decoder, frame_loss.firmware])
def test_without_errors_no_frame_is_lost_in_the_noise_between_frames(receiver):
    assert receiver(3, 40.0, 100, 4).lost == 0


def test_the_bits_that_count_are_those_from_sync_to_crc_and_one_stop_bit():
    assert [frame_loss.critical_bits(robots) for robots in (3, 5)] == [171, 251]
    assert frame_loss.formula(3, 12.31) == pytest.approx(171e-4, rel=0.02)


@pytest.mark.develop
def test_the_same_figures_make_the_same_picture(tmp_path):
    pytest.importorskip("matplotlib", reason="needs the extra develop")
    points = [frame_loss.Point(3, "decoder", 10.0, 1000, 440), frame_loss.Point(5, "firmware", 14.0, 100, 0)]
    for name in ("a.png", "b.png"):
        frame_loss.draw(points, tmp_path / name)
    picture = (tmp_path / "a.png").read_bytes()
    assert picture == (tmp_path / "b.png").read_bytes()
    assert picture.startswith(b"\x89PNG")


@pytest.mark.parametrize(("count", "trials"), [(3, 300), (100, 300), (299, 300)])
def test_wilsons_interval_is_near_the_exact_one(count, trials):
    assert wilson(count, trials) == pytest.approx(clopper_pearson(count, trials), abs=0.012)


DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def way():
    return Way()


def test_the_page_in_the_tree_is_what_the_command_writes(way):
    assert one_frame_page.page(way) == (DOCS / "one-frame.md").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.develop
def test_the_command_draws_the_pictures_that_the_page_shows(way, tmp_path):
    pytest.importorskip("matplotlib", reason="needs the extra develop")
    from benchmarks import one_frame_pictures

    one_frame_pictures.draw(way, tmp_path)
    drawn = sorted(file.name for file in tmp_path.iterdir())
    assert drawn == sorted(file.name for file in DOCS.glob("one-frame-*.png"))
    text = (DOCS / "one-frame.md").read_text("utf-8")
    assert all(f"({name})" in text for name in drawn)
    assert all((tmp_path / name).stat().st_size < 300_000 for name in drawn)


def test_the_law_gets_the_posture_that_was_measured_in_the_followed_frame(way):
    assert way.answer.robots[0].measurement == way.pair.sighting
    assert way.pair.sighting.tick == way.before.tick == way.answer.tick - CONTROL_PERIOD_TICKS


def test_the_motion_controllers_are_loaded_with_what_the_law_gave(way):
    control = way.answer.robots[0].control
    assert control is not None
    loaded = [int.from_bytes(event.data[2:], "big") >> 8 for event in way.commands[:2]]
    assert loaded == [control.left, control.right]
    assert [event.opcode for event in way.commands] == [0x1F, 0x1F, 0x01]


def test_the_wire_carries_the_characters_that_the_robot_received(way):
    edges = way.edges["rxd"]
    for index, event in enumerate(way.received):
        begin = way.sent.tick + 25_000 * index
        bits = [level_at(edges, begin + 2500 * bit + 1250) for bit in range(10)]
        assert bits == [0, *(event.value >> bit & 1 for bit in range(8)), 1]


def test_no_time_of_the_cpu_is_missing_between_the_last_character_and_the_start(way):
    assert way.on_the_way[0].start_tick - way.received[-1].tick < 24
    assert all(one.end_tick == other.start_tick for one, other in itertools.pairwise(way.on_the_way))


def test_a_waveform_is_read_back_tick_by_tick():
    text = "$var wire 1 ! rxd $end\n#0\n1!\n#41\n0!\n#1000000000\n1!\n"
    assert edges_of(text) == {"rxd": [(0, 1), (1, 0), (24_000_000, 1)]}


def level_at(edges, tick):
    return [level for at, level in edges if at <= tick][-1]
