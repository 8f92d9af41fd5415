"""What the rover shows of the wall in front of it, at several distances."""

import pytest

import mirotwin


@pytest.mark.mirotwin(board="rover.board.toml", firmware="rover.ihx")
@pytest.mark.parametrize("distance_cm", [50, 150, 300])
def test_the_display_shows_how_far_the_wall_is_within_2_per_cent(board, distance_cm):
    board.put("eyes.distance_cm", distance_cm)
    board.run_for(mirotwin.ms(700))
    shown_cm = int(board.value("lcd.row1").partition("cm")[0])
    assert abs(shown_cm - distance_cm) <= 0.02 * distance_cm
