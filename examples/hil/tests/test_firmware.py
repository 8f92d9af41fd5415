"""What this firmware has to do, beyond what the protocol asks of every robot: it names a function of its C source."""

from mirotwin import ms


def test_it_stops_when_its_host_falls_silent(link, robot):
    link.drive({0: (500, 500)}, ms(200))
    link.send(velocities={0: (500, 500)})
    robot.break_at("motion_stop", within=ms(110.5))
