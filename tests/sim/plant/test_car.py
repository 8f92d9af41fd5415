"""How a car drives on a plane, and what stops it."""

import math
import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_exact.plugins import PluginError
from miro_robot.build import board_of
from miro_sim.plant.car import Car
from miro_sim.plant.dc_motor import DcMotor
from miro_sim.scenario.board_file import board_of_table
from tests.robot.mcs51.asm import image_of
from tests.robot.parts.bench import Bench
from tests.sim.plant.car_bench import HZ, MS, WALLS, WAYS, bench, drive, pose

RADIUS_CM, TRACK_CM = 3.25, 13.0
STRETCHES = st.lists(
    st.tuples(st.sampled_from(sorted(WAYS)), st.sampled_from(sorted(WAYS)), st.integers(1, 400)),
    min_size=1,
    max_size=5,
)


def wheels(board):
    """What the wheels have rolled, in cm."""
    return tuple(2 * math.pi * RADIUS_CM * board.read(f"{name}.turns") for name in ("left", "right"))


def test_it_goes_where_it_looks_as_far_as_its_wheels_roll():
    board = bench(Car(x_cm=10.0, y_cm=-5.0, heading_deg=30.0))
    drive(board, "forward", "forward", 800 * MS)
    left, right = wheels(board)
    x, y, heading = pose(board)
    assert left == right > 10
    assert (x, y, heading) == pytest.approx((10 + left * math.sqrt(3) / 2, -5 + left / 2, 30.0))
    assert board.read("car.speed_cm_s") == pytest.approx(
        board.read("left.rpm") / 60 * 2 * math.pi * RADIUS_CM
    )


def test_with_wheels_that_turn_against_each_other_it_turns_where_it_stands():
    board = bench()
    drive(board, "backward", "forward", 800 * MS)
    left, right = wheels(board)
    x, y, heading = pose(board)
    assert (x, y) == pytest.approx((0, 0), abs=1e-9)
    assert heading == pytest.approx(math.degrees((right - left) / TRACK_CM))
    assert heading > 90


@settings(max_examples=20)
@given(STRETCHES)
def test_it_goes_as_its_slow_twin_does_by_little_steps_of_its_shafts(stretches):
    """A bench of its own, asked every quarter of a millisecond."""
    board = bench(Car())
    x = y = heading = 0.0
    before = wheels(board)
    for left, right, ms in stretches:
        drive(board, left, right)
        for _ in range(4 * ms):
            board.run(board.tick + MS // 4)
            now = wheels(board)
            way = [after - before for after, before in zip(now, before, strict=True)]
            before = now
            turn = (way[1] - way[0]) / TRACK_CM
            x += sum(way) / 2 * math.cos(heading + turn / 2)
            y += sum(way) / 2 * math.sin(heading + turn / 2)
            heading += turn
    assert pose(board) == pytest.approx((x, y, math.degrees(heading)), abs=1e-3)


@settings(max_examples=15)
@given(STRETCHES, st.lists(st.integers(1, 400), max_size=3))
def test_nobody_who_looks_changes_it_and_saving_and_loading_neither(stretches, cuts):
    car = Car(walls=((-20.0, 10.0, 40.0, 12.0), (15.0, -30.0, 15.0, 30.0)), radius_cm=8.0)
    board, quiet = bench(car), bench(car)
    for left, right, ms in stretches:
        begin = board.tick
        drive(board, left, right)
        for cut in sorted(cuts):
            board.run(max(board.tick, begin + min(cut, ms) * MS))
            pose(board), board.read("eyes.distance_cm")
            other = bench(car)
            other.load(board.save())
            other.tick = board.tick
            board = other
        board.run(max(board.tick, begin + ms * MS + 1))
        drive(quiet, left, right)
        quiet.run(board.tick)
        assert board.save() == quiet.save()


def test_its_motors_move_its_mass():
    ways = []
    for mass_kg in (0.01, 0.6, 3.0):
        board = bench(Car(mass_kg=mass_kg))
        drive(board, "forward", "forward", 150 * MS)
        ways.append(board.read("car.x_cm"))
    assert ways[0] > 1.3 * ways[1] > 1.3 * 1.3 * ways[2] > 0


def test_the_mass_of_a_motor_with_a_car_is_that_of_a_motor_with_more_inertia():
    car = Car(mass_kg=0.8, wheel_inertia_kg_m2=0.0, rolling_resistance=0.0)
    alone = DcMotor(inertia_kg_m2=DcMotor().inertia_kg_m2 + 0.4 * 0.0325**2)
    board, light = bench(car), bench(Car(mass_kg=1e-3, wheel_inertia_kg_m2=0.0), motor=alone)
    for one in (board, light):
        drive(one, "forward", "backward", 300 * MS)
    assert board.read("left.rpm") == pytest.approx(light.read("left.rpm"), rel=1e-2)


def test_four_wheels_carry_a_quarter_each_and_those_of_a_side_go_together():
    board = bench(four=True)
    drive(board, "forward", "forward", 500 * MS)
    board.put("back_left.blocked", True)
    before = pose(board)[2]
    drive(board, "forward", "forward", 300 * MS)
    assert before == pytest.approx(0, abs=1e-9)
    assert pose(board)[2] > 20  # half of the left side only


@pytest.mark.parametrize("heading", [0.0, 90.0, -90.0, 37.0])
def test_at_a_wall_it_stays_until_it_backs_off(heading):
    board = bench(Car(walls=WALLS, heading_deg=heading, radius_cm=10.0))
    drive(board, "forward", "forward", 5000 * MS)
    x, y, _ = stopped = pose(board)
    assert max(abs(x), abs(y)) == pytest.approx(90, abs=0.2)
    assert (board.read("car.bumped"), board.read("car.bumps"), board.read("car.speed_cm_s")) == (True, 1, 0)
    assert board.read("left.rpm") > 100  # its wheels slip
    drive(board, "forward", "forward", 500 * MS)
    assert pose(board) == stopped
    drive(board, "backward", "backward", 1500 * MS)
    x, y, _ = pose(board)
    assert max(abs(x), abs(y)) < 80
    assert (board.read("car.bumped"), board.read("car.bumps")) == (False, 1)
    drive(board, "forward", "forward", 5000 * MS)
    assert board.read("car.bumps") == 2


def test_at_a_wall_it_may_turn_and_leave():
    board = bench(Car(walls=WALLS))
    drive(board, "forward", "forward", 5000 * MS)
    while pose(board)[2] < 170:
        drive(board, "backward", "forward", 10 * MS)
    drive(board, "forward", "forward", 1200 * MS)
    assert pose(board)[0] < 60
    assert not board.read("car.bumped")


def test_a_test_puts_it_elsewhere():
    board = bench(Car())
    drive(board, "forward", "forward", 500 * MS)
    for key, value in (("x_cm", 5.0), ("y_cm", -7.0), ("heading_deg", 90.0)):
        board.put(f"car.{key}", value)
    assert pose(board) == pytest.approx((5, -7, 90))
    drive(board, "forward", "forward", 500 * MS)
    x, y, heading = pose(board)
    assert (x, heading) == pytest.approx((5, 90))
    assert y > 10


def test_a_car_that_spins_for_hours_still_knows_where_it_looks():
    keys = Car(track_cm=0.1, wheel_radius_cm=100.0, mass_kg=1e-3)
    board = bench(keys)
    headings = []
    while not headings or headings[-1] >= max(headings):
        drive(board, "backward", "forward", 100 * MS)
        headings.append(pose(board)[2])
    assert max(headings) > 5e6
    assert -180 < headings[-1] < 1e6
    bench(keys).load(board.save())


def test_put_away_from_a_wall_it_drives_on_at_once():
    board = bench(Car(walls=WALLS))
    drive(board, "forward", "forward", 5000 * MS)
    board.put("car.x_cm", -50.0)
    assert not board.read("car.bumped")
    drive(board, "forward", "forward", 100 * MS)
    assert pose(board)[0] > -48
    assert (board.read("car.bumped"), board.read("car.bumps")) == (False, 1)


WIDE = st.one_of(st.floats(0.1, 1.0), st.floats(1.0, 100.0))
COORDINATE = st.sampled_from([0.0, 1e-3, 1.0, 37.5, 100.0, 1e4]).flatmap(
    lambda cm: st.sampled_from([cm, -cm])
)
WALL = st.tuples(*[COORDINATE] * 4).filter(
    lambda wall: abs(wall[2] - wall[0]) + abs(wall[3] - wall[1]) >= 0.01
)


@settings(max_examples=30)
@given(
    st.builds(
        Car,
        wheel_radius_cm=WIDE,
        track_cm=WIDE,
        radius_cm=WIDE,
        mass_kg=WIDE,
        x_cm=COORDINATE,
        heading_deg=COORDINATE.filter(lambda degrees: abs(degrees) <= 3600),
        walls=st.lists(WALL, max_size=6).map(tuple),
        lines=st.lists(st.lists(st.tuples(COORDINATE, COORDINATE), min_size=2, max_size=3).map(tuple)).map(
            tuple
        ),
        picture=st.lists(st.text("#. ", max_size=5), max_size=5).map(tuple),
    ),
    STRETCHES,
)
def test_any_car_in_any_hall_drives_and_can_be_saved(car, stretches):
    board = bench(car)
    for left, right, ms in stretches:
        drive(board, left, right, ms * MS)
        seen = (*pose(board), board.read("eyes.distance_cm"), board.read("line.pattern"))
        other = bench(car)
        other.load(board.save())
        other.tick = board.tick
        assert seen == (*pose(other), other.read("eyes.distance_cm"), other.read("line.pattern"))


def test_without_the_supply_of_its_bridge_it_rolls_out():
    board = bench(Car())
    drive(board, "forward", "forward", 800 * MS)
    before = pose(board)[0]
    board.power(0)
    board.run(board.tick + 3000 * MS)
    assert board.read("car.speed_cm_s") == 0
    assert pose(board)[0] > before + 3


def test_a_car_without_motors_says_what_to_wire():
    with pytest.raises(PluginError, match="no motor at pin left"):
        Bench({"car": (Car(), {"left": "x", "right": "y"})})


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ({"walls": ((1.0, 2.0, 1.0, 2.0),)}, "shorter than 0.01 cm"),
        ({"walls": ((0.0, 0.0, 1.0, 1.0),) * 1025}, "at most 1024"),
    ],
)
def test_a_plane_that_cannot_be_is_refused(keys, reason):
    with pytest.raises(ValueError, match=reason):
        Car(**keys)


def test_its_way_does_not_depend_on_the_crystal():
    ends = []
    for crystal_hz in (HZ, 11_059_200):
        board = bench(Car(), crystal_hz=crystal_hz)
        drive(board, "forward", "brake", crystal_hz)
        ends.append(pose(board))
    assert ends[0] == pytest.approx(ends[1], abs=0.02)


BOARD = Path(__file__).parents[3] / "examples" / "boards" / "car" / "hall.board.toml"


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        (
            'left = "left.shaft"',
            'left = "left.a"',
            "'car' (car), tick 0: start: no motor at pin left; give left",
        ),
        (
            'body = "car.body"',
            'body = "left.shaft"',
            "'eyes' (hc_sr04), tick 0: start: no car at pin body; give",
        ),
        (
            'horn = "neck.horn"',
            'horn = "car.body"',
            "'eyes' (hc_sr04), tick 0: start: no servo at pin horn; give",
        ),
    ],
)
def test_a_board_that_is_wired_wrongly_says_so_in_one_line(right, wrong, message):
    text = BOARD.read_text()
    assert right in text
    spec = board_of_table(tomllib.loads(text.replace(right, wrong)), "hall.board.toml")
    with pytest.raises(PluginError) as refused:
        board_of(spec, image_of("SJMP $"), 0)
    assert message in f"{refused.value}"
    assert "repair" not in f"{refused.value}"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            "lines = [[0, 0]]",
            r"parts.car.lines\[0\]\[0\]: expected a list, got a whole number \(0\); see `mirotwin",
        ),
        ("lines = [[[0, 0]]]", r"parts.car.lines\[0\]: expected a list of length >= 2; see `mirotwin"),
        (
            "walls = [[0, 0, 0, 0]]",
            r"parts.car: walls: one at \(0, 0\) is shorter than 0.01 cm; see `mirotwin",
        ),
    ],
)
def test_what_is_drawn_wrongly_on_the_plane_is_said_with_its_place_and_where_to_look(lines, message):
    kept = [line for line in BOARD.read_text().splitlines() if not line.startswith("walls")]
    text = "\n".join(kept).replace('part = "car"', f'part = "car"\n{lines}')
    with pytest.raises(BadInput, match=message + " boards show car`"):
        board_of_table(tomllib.loads(text), "hall.board.toml")
