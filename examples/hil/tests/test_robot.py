"""What every robot has to do."""

from mirotwin import Telemetry, ms


def test_the_wheels_get_what_was_sent(link, robot, world):
    link.send(velocities={0: (300, -300)})
    world.run_for(ms(5))
    assert robot.wheels.commanded == (300, -300)


def test_it_answers_with_what_it_has_accepted(link):
    for _ in range(3):
        link.send(velocities={0: (100, 100)})
    link.poll(slot=0)
    assert link.expect(Telemetry, within=ms(40)).accepted == 4


def test_it_is_back_after_a_reset(link, robot, world):
    link.send(velocities={0: (300, 300)})
    world.run_for(ms(50))
    robot.reset()
    robot.wait_until_up()
    assert robot.wheels.mode == ("off", "off")
    link.send(velocities={0: (200, 200)})
    world.run_for(ms(5))
    assert robot.wheels.commanded == (200, 200)
