"""What the car says of the obstacle in front of it, at several distances."""

import pytest

import mirotwin


@pytest.mark.mirotwin(board="car.board.toml", firmware="car.ihx")
@pytest.mark.parametrize("distance_cm", [20, 60, 150])
def test_the_car_says_how_far_the_obstacle_is_within_2_per_cent(board, serial, distance_cm):
    serial.expect(">", within=mirotwin.ms(50))
    board.put("eyes.distance_cm", distance_cm)
    board.run_for(mirotwin.ms(250))
    serial.write(b"?")
    said = serial.expect(pattern=r"([0-9]+)\r\n", within=mirotwin.ms(200))
    assert abs(int(said[1]) - distance_cm) <= 0.02 * distance_cm
