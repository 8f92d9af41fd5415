"""Moves: loads in pieces, waiting for completion, stops and new accelerations, chains of relative moves."""

import pytest

from miro_robot.event_log import START_LOST, EventLog
from tests.robot.lm629.drivers.driver import (
    BREAKPOINT,
    COMPLETE,
    ERROR,
    MOTOR_OFF,
    ON_TARGET,
    everywhere,
    outcomes,
)


def split_load(driver):
    """Each parameter by an LTRJ of its own, each coefficient by an LFIL; then one UDF, one STT."""
    driver.load(0x0020, 0x8000)
    driver.load(0x0008, 0x20000)
    driver.load(0x0002, 25)
    for bit, value in ((8, 11), (4, 22), (2, 33), (1, 44)):
        driver.command("LFIL", 0x0300 | bit, value)
    driver.command("UDF")
    driver.command("STT")
    driver.ready()
    driver.sample(2)
    pid, profile = driver.chip.pid, driver.chip.trajectory
    loaded = (profile.acceleration, profile.max_velocity, profile.target)
    return loaded, (pid.kp, pid.ki, pid.kd, pid.il, pid.ds), driver.status() & ERROR


def three_moves_by_signals(driver):
    """STT, then RDSIGS until bit 10. Returns where each move was when the host took it for complete."""
    driver.load(0x0028, 0x8000, 0x20000)
    places = []
    for place in (12, -9, 30):
        driver.load(0x0002, place)
        driver.command("STT")
        driver.until(lambda: driver.signals() & ON_TARGET)
        places.append(driver.ask("RDDP"))
    return tuple(places)


def first_move_by_motor_off(driver):
    """A host that waits for "motor off" to go before it does anything else. Returns the status right after STT."""
    driver.load(0x002A, 0x8000, 0x20000, 40)
    driver.command("STT")
    driver.ready()
    return driver.status() & MOTOR_OFF, driver.signals() & (MOTOR_OFF | ON_TARGET)


def three_moves_by_status(driver):
    """RSTI, LTRJ, STT, then the status until bit 2."""
    driver.load(0x0028, 0x8000, 0x20000)
    places = []
    for place in (12, -9, 30):
        driver.command("RSTI", 0)
        driver.load(0x0002, place)
        driver.command("STT")
        driver.until_flag(COMPLETE)
        places.append(driver.ask("RDDP"))
    return tuple(places)


def stopped_and_started(driver, stop):
    """Moving; a stop, and at once a move with another acceleration. Returns that acceleration and what went wrong."""
    driver.start(0x1828, 0x8000, 0x40000, samples=12)
    driver.load(stop)
    driver.command("STT")
    driver.load(0x1828, 0x6000, 0x20000)
    driver.command("STT")
    driver.ready()
    driver.sample(15)
    status = driver.status() & (MOTOR_OFF | ERROR)
    return driver.chip.trajectory.acceleration, driver.chip.desired_velocity, status


def stopped_by_the_motor(driver):
    return stopped_and_started(driver, 0x0100)


def stopped_abruptly(driver):
    return stopped_and_started(driver, 0x0200)


def accelerated_in_motion(driver):
    """A move from rest, and before it can have ended another acceleration. Returns the acceleration in force, and the
    command error.
    """
    driver.start(0x002A, 0x8000, 0x20000, 3, samples=12)
    driver.load(0x0002, 2000)
    driver.command("STT")
    driver.load(0x0020, 0x6000)
    driver.command("STT")
    driver.ready()
    driver.sample(2)
    return driver.chip.trajectory.acceleration, driver.status() & ERROR


def chain(driver):
    """Relative moves, each started by the breakpoint of the one before, 20 counts before its target. Returns where the
    breakpoints were, the last target, and whether it stopped on the way.
    """
    driver.load(0x0028, 0x8000, 0x40000)
    targets = []
    for _ in range(4):
        driver.load(0x0003, 60)
        driver.command("STT")
        driver.position("SBPR", -20)
        driver.ready()
        targets.append(driver.chip.breakpoint)
        driver.command("RSTI", 0x7E & ~BREAKPOINT)
        driver.until_flag(BREAKPOINT)
    stopped = driver.status() & COMPLETE
    driver.until_flag(COMPLETE)
    return tuple(targets), driver.ask("RDDP"), stopped


def two_relative_starts(driver):
    """+1000, and before a sample may have come +500. Returns the target, and how many starts the log says were lost."""
    driver.chip.tell(log := EventLog(), 1)
    driver.load(0x0028, 0x8000, 0x10000)
    driver.load(0x0003, 1000)
    driver.command("STT")
    driver.load(0x0003, 500)
    driver.command("STT")
    driver.ready()
    driver.sample(2)
    lost = [log.event(serial)[2] for serial in range(log.end) if log.event(serial)[1] == START_LOST]
    assert lost in ([], [1])  # the side
    return driver.chip.trajectory.target, len(lost)


def test_parameters_that_were_loaded_one_by_one_take_effect_together():
    assert outcomes(split_load) == everywhere(((0x8000, 0x20000, 25), (11, 22, 33, 44, 3), 0))


@pytest.mark.slow
def test_the_signals_say_on_target_only_when_the_move_has_ended():
    assert outcomes(three_moves_by_signals) == everywhere((12, -9, 30))
    by_the_sample = outcomes(three_moves_by_signals, start_shows="sample")
    assert len(by_the_sample) > 1


def test_motor_off_is_gone_when_stt_is_accepted():
    assert outcomes(first_move_by_motor_off) == everywhere((0, 0))
    assert set(outcomes(first_move_by_motor_off, start_shows="sample")) > {(0, 0)}


@pytest.mark.slow
def test_the_status_says_trajectory_complete_when_each_move_has_ended():
    assert outcomes(three_moves_by_status) == everywhere((12, -9, 30))


@pytest.mark.parametrize("sequence", [stopped_by_the_motor, stopped_abruptly])
@pytest.mark.parametrize("shows", ["accepted", "sample"])
def test_after_a_stop_the_next_start_may_have_another_acceleration(sequence, shows):
    assert outcomes(sequence, start_shows=shows) == everywhere((0x6000, 0x20000, 0))


@pytest.mark.parametrize("shows", ["accepted", "sample"])
def test_in_motion_another_acceleration_is_refused(shows):
    assert outcomes(accelerated_in_motion, start_shows=shows) == everywhere((0x8000, ERROR))


@pytest.mark.slow
def test_a_chain_of_relative_moves_has_its_breakpoints_before_its_own_targets():
    assert outcomes(chain) == everywhere(((40, 100, 160, 220), 240, 0))
    assert len(outcomes(chain, breakpoint_base="working")) > 1


def test_of_two_starts_within_a_sample_the_first_is_lost_and_the_log_says_so():
    seen = outcomes(two_relative_starts)
    assert set(seen) == {(1500, 0), (500, 1)}


def test_with_the_other_reading_no_start_is_lost():
    assert outcomes(two_relative_starts, second_start="follows") == everywhere((1500, 0))
