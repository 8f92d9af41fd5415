"""What a ranger and line sensors on a car see."""

import itertools
import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from miro_exact.plugins import PluginError
from miro_robot.parts.hc_sr04 import HcSr04
from miro_robot.parts.servo import Servo
from miro_sim.plant.car import Car
from miro_sim.plant.line_sensors import LineSensors
from miro_sim.plant.plane import Plane
from tests.robot.parts.bench import Bench
from tests.sim.plant.car_bench import MS, RING, WAYS, bench, drive, pose

US = MS // 1000
CM = st.integers(-80, 80).map(float)


def plane(walls=(), lines=(), line_cm=2.0, picture=(), cell_cm=1.0):
    return Plane(list(walls), list(lines), line_cm, list(picture), cell_cm)


def beam(walls, x, y, heading):
    """The slow twin: distances to many points of each wall, within 7.5 degrees; 45 from the perpendicular at most."""
    best, middle, doubtful = math.inf, math.inf, False
    for x1, y1, x2, y2 in walls:
        nearest = None
        before = None
        for part in range(4001):
            px, py = x1 + (x2 - x1) * part / 4000 - x, y1 + (y2 - y1) * part / 4000 - y
            off = math.remainder(math.atan2(py, px) - heading, math.tau)
            if before is not None and abs(off) < 1 and abs(before) < 1 and off * before <= 0:
                middle = min(middle, math.hypot(px, py))
            before = off
            if abs(off) <= math.radians(7.5) and (nearest is None or math.hypot(px, py) < nearest[0]):
                nearest = math.hypot(px, py), math.atan2(py, px)
        if nearest:
            distance, angle = nearest
            lean = abs(math.remainder(angle - math.atan2(y2 - y1, x2 - x1) - math.pi / 2, math.pi))
            doubtful |= abs(lean - math.radians(45)) < 0.02 or distance < 1
            if lean <= math.radians(45):
                best = min(best, distance)
    doubtful |= abs(best - middle) < 0.2 and best > middle
    return (best if best <= middle else math.inf), doubtful


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(CM, CM, CM, CM).filter(lambda wall: math.dist(wall[:2], wall[2:]) > 1),
        min_size=1,
        max_size=3,
    ),
    CM,
    CM,
    st.integers(-180, 180),
)
def test_a_ranger_hears_what_its_slow_twin_hears(walls, x, y, degrees):
    heading = math.radians(degrees) + 1e-4
    wanted, doubtful = beam(walls, x + 0.1, y + 0.1, heading)
    assume(not doubtful)
    found = plane(walls).echo_cm(x + 0.1, y + 0.1, math.cos(heading), math.sin(heading))
    assert (math.inf if found < 0 else found) == pytest.approx(wanted, abs=0.1)


def heard(walls, degrees=0.0):
    return plane(walls).echo_cm(0.0, 0.0, math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))


WALL = (100.0, -100.0, 100.0, 100.0)


@pytest.mark.parametrize(("degrees", "cm"), [(0, 100), (7, 100), (15, 100 / math.cos(math.radians(7.5)))])
def test_of_a_wall_it_hears_the_nearest_place_in_its_beam(degrees, cm):
    assert heard([WALL], degrees) == pytest.approx(cm)


def test_a_wall_at_more_than_45_degrees_sends_nothing_back_and_hides_what_is_behind_it():
    assert heard([WALL], 52) > 0 > heard([WALL], 53)
    slanted = (40.0, -10.0, 60.0, 40.0)
    assert heard([slanted]) > 0
    grazing = (40.0, -5.0, 80.0, 5.0)
    assert heard([grazing]) < 0
    assert heard([grazing, WALL]) < 0


def test_between_the_walls_of_a_corridor_it_hears_its_end():
    assert heard([WALL, (0.0, 10.0, 100.0, 10.0), (0.0, -10.0, 100.0, -10.0)]) == pytest.approx(100)


def ping(board):
    """The length of an echo, in us."""
    board.drive("trig", 1)
    board.drive("trig", 0, board.tick + 20 * US)
    seen = len(board.edges_of("echo"))
    board.run(board.tick + 60_000 * US)
    edges = [tick for tick, _ in board.edges_of("echo")[seen:]]
    return (edges[1] - edges[0]) / US if edges else 0


def test_from_a_car_a_ranger_measures_to_the_wall_until_a_distance_is_put():
    board = bench(eyes=HcSr04(ahead_cm=10.0))
    assert board.read("eyes.distance_cm") == pytest.approx(90)
    assert ping(board) == pytest.approx(90 * 58, abs=1)
    board.put("eyes.distance_cm", 30.0)
    assert (ping(board), board.read("eyes.sees")) == (pytest.approx(30 * 58, abs=1), "put")
    board.put("eyes.sees", "walls")
    board.put("car.x_cm", 40.0)
    assert (ping(board), board.read("eyes.sees")) == (pytest.approx(50 * 58, abs=1), "walls")


def test_where_there_is_no_wall_there_is_no_echo():
    board = bench(Car())
    assert ping(board) == pytest.approx(38_000)
    assert board.read("eyes.distance_cm") > 400
    board = bench(Car(walls=((401.0, -10.0, 401.0, 10.0),)))
    assert ping(board) == pytest.approx(38_000)


def test_a_servo_turns_it_and_a_longer_pulse_turns_it_to_the_left():
    board = bench(Car(walls=((100.0, -200.0, 100.0, 200.0), (-200.0, 30.0, 200.0, 30.0))))
    assert board.read("eyes.distance_cm") == pytest.approx(100)
    for _ in range(30):
        board.drive("pwm", 1)
        board.drive("pwm", 0, board.tick + 2500 * US)
        board.run(board.tick + 17_500 * US)
    assert board.read("neck.angle_deg") == 180
    assert board.read("eyes.distance_cm") == pytest.approx(30)


def test_while_it_drives_its_answer_is_of_where_it_is_at_the_ping():
    board = bench()
    drive(board, "forward", "forward", 700 * MS)
    us = ping(board)
    passed = 100 - us / 58
    assert passed < pose(board)[0] < passed + 8


def test_edges_of_a_line_lie_where_its_width_says_and_of_a_picture_where_its_cells_are():
    bare = plane(lines=[(0.0, 0.0, 10.0, 0.0)])
    assert [bare.edge_cm(5.0, y) for y in (0.0, 1.0, 1.5)] == [-1, 0, 0.5]
    assert bare.edge_cm(13.0, 4.0) == pytest.approx(4)
    drawn = plane(picture=["##", ".#", "-#"], cell_cm=2.0)
    dark = [[drawn.edge_cm(2 * column + 1.0, 2 * row + 1.0) < 0 for column in range(3)] for row in range(4)]
    assert dark == [[False, True, False], [False, True, False], [True, True, False], [False, False, False]]
    assert drawn.edge_cm(-0.5, 1.0) > 0


STRETCHES = st.lists(
    st.tuples(st.sampled_from(sorted(WAYS)), st.sampled_from(sorted(WAYS)), st.integers(1, 300)),
    min_size=1,
    max_size=4,
)
PICTURE = tuple("".join("#" if (x * 7 + y * 3) % 5 == 0 else "." for x in range(40)) for y in range(40))


@settings(max_examples=15)
@given(STRETCHES, st.booleans(), st.sampled_from([(25.0, 0.0, 80.0), (5.0, 5.0, 45.0), (28.0, -3.0, 0.0)]))
def test_line_sensors_show_what_is_below_them_at_each_millisecond(stretches, drawn, place):
    """Looks that are left out would have seen nothing else."""
    x, y, heading = place
    keys = Car(
        x_cm=x, y_cm=y, heading_deg=heading, lines=() if drawn else (RING,), picture=PICTURE if drawn else ()
    )
    sensors = LineSensors()
    board = bench(keys, sensors=sensors)
    floor = plane([], [(*a, *b) for a, b in itertools.pairwise(RING)] if not drawn else [], 1.9, keys.picture)
    for left, right, ms in stretches:
        drive(board, left, right)
        for _ in range(ms):
            board.run(board.tick - board.tick % MS + MS)  # the next look is on this tick
            x, y, heading = pose(board)
            cosine, sine = math.cos(math.radians(heading)), math.sin(math.radians(heading))
            away = [
                floor.edge_cm(x + ahead * cosine - aside * sine, y + ahead * sine + aside * cosine)
                for ahead, aside in sensors.places
            ]
            board.run(board.tick + 1)
            if all(abs(cm) > (0 if drawn else 1e-6) for cm in away):
                assert board.read("line.pattern") == "".join("01"[cm <= 0] for cm in away)
                assert [board.level(f"s{n}") for n in (1, 2, 3)] == [int(cm <= 0) for cm in away]


def test_a_sensor_sees_what_is_put_until_it_sees_again():
    board = bench(Car(), sensors=LineSensors(dark="low"))
    assert (board.read("line.pattern"), board.level("s2")) == ("000", 1)
    board.put("line.s2", "dark")
    assert (board.read("line.pattern"), board.level("s2")) == ("010", 0)
    board.put("car.x_cm", 20.0)
    board.run(board.tick + 5 * MS)
    assert board.read("line.s2") == "dark"
    board.put("line.s2", "seen")
    assert (board.read("line.pattern"), board.level("s2"), board.read("line.s2")) == ("000", 1, "light")


def test_when_the_car_is_put_on_a_line_its_sensors_see_it_at_once():
    board = bench(Car(lines=(((100.0, -10.0), (100.0, 10.0)),)))
    board.run(board.tick + 100 * MS)
    board.put("car.x_cm", 92.0)
    assert board.read("line.pattern") == "111"


def test_without_supply_they_let_go_and_without_a_car_all_floor_is_light():
    board = Bench({"line": (LineSensors(dark="low"), {"s1": "s1", "s2": "s2", "s3": "s3"})})
    assert board.read("line.pattern") == "000"
    board.put("line.s1", "dark")
    assert board.level("s1") == 0
    board.power(0)
    assert board.driven("s1") is None
    board.power(1)
    assert board.level("s1") == 0


@pytest.mark.parametrize(
    ("parts", "reason"),
    [
        ({"line": (LineSensors(), {"body": "x", "s1": "a", "s2": "b", "s3": "c"})}, "no car at pin body"),
        (
            {"line": (LineSensors(places=((8.0, 0.0),)), {"s1": "a", "s2": "b"})},
            "s2 has no place",
        ),
        ({"eyes": (HcSr04(), {"trig": "t", "echo": "e", "body": "x"})}, "no car at pin body"),
    ],
)
def test_what_is_wired_wrongly_says_what_to_give(parts, reason):
    with pytest.raises(PluginError, match=reason):
        Bench(parts)


def test_a_servo_that_hangs_upside_down_turns_it_to_the_other_side():
    turned = [Bench({"neck": (Servo(longer_turns=side), {"pwm": "p"})}, ["p"]) for side in ("left", "right")]
    for board in turned:
        board.drive("p", 0)
        board.drive("p", 1, 1)
        board.drive("p", 0, 2000 * US + 1)
    left, right = (board.named["neck"].turned_deg(100 * MS) for board in turned)
    assert left == -right == pytest.approx(25)  # so far in 50 ms
