"""What the follower shows of its three sensors."""

import pytest

import mirotwin

SENSORS = ("line.s1", "line.s2", "line.s3")


@pytest.mark.mirotwin(board="follower.board.toml", firmware="follower.ihx")
@pytest.mark.parametrize("dark", SENSORS)
def test_the_display_shows_which_sensor_is_dark(board, dark):
    for sensor in SENSORS:
        board.put(sensor, "dark" if sensor == dark else "light")
    board.run_for(mirotwin.ms(400))
    assert board.value("lcd.row1")[-3:] == "".join("#" if sensor == dark else "-" for sensor in SENSORS)
