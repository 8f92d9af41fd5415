"""The PWM stage: real edges, loaded at the sample, phase from the end of reset."""

from miro_exact.clock import NEVER_TICK
from miro_robot.lm629.chip import PWM_TICKS, SAMPLE_TICKS, Lm629
from tests.robot.lm629.bench import Bench


def holding(kp=10):
    """A closed loop at rest; the tests set the error by hand."""
    bench = Bench.running()
    bench.filter(kp=kp)
    bench.load(0x0200)
    bench.command("STT")
    bench.sample(1)
    bench.command("RSTI", 0)
    bench.sample(1)
    return bench


def test_four_pulses_a_sample_of_16_ticks_a_step_from_the_start_of_the_period():
    bench = holding()
    bench.chip.trajectory.position = -26 * 65536
    bench.sample()
    start = bench.tick
    bench.edges.clear()
    bench.wait(SAMPLE_TICKS - 1)
    expected = []
    for period in range(4):
        at = start + period * PWM_TICKS
        expected += [(at, 1, 1, 0), (at + 32, 0, 1, 0)]
    assert [(start, 1, 1, 0), *bench.edges] == expected


def test_full_drive_is_127_of_128():
    bench = holding()
    bench.chip.trajectory.position = 4000 * 65536
    bench.sample()
    start = bench.tick
    bench.edges.clear()
    bench.wait(PWM_TICKS)
    assert bench.edges == [(start + 2032, 0, 0, 0), (start + 2048, 1, 0, 0)]


def test_without_drive_only_samples_are_events():
    bench = holding()
    assert bench.chip.next_tick == bench.chip.sample_tick == bench.tick + SAMPLE_TICKS
    seen = len(bench.edges)
    bench.sample(20)
    assert len(bench.edges) == seen


def test_the_drive_changes_at_the_sample_only():
    bench = holding()
    bench.wait(3000)
    bench.chip.trajectory.position = 100 * 65536
    bench.wait(SAMPLE_TICKS - 3001)
    assert bench.chip.pwm_magnitude == 0
    bench.wait(1)
    assert (bench.chip.pwm_magnitude, bench.chip.pwm) == (3, 1)


def test_samples_and_periods_count_from_the_end_of_reset():
    for release in (1000, 1001, 1004):
        chip = Lm629()
        assert chip.next_tick == NEVER_TICK
        chip.set_reset(900, 0)
        chip.set_reset(release, 1)
        end = -(-release // 4) * 4 + 6144 * 4
        assert chip.next_tick == end
        chip.advance(end)
        assert chip.next_tick == end + SAMPLE_TICKS
        assert chip.hi == 1


def test_reset_ends_a_pulse_at_once():
    for software in (False, True):
        bench = holding()
        bench.chip.trajectory.position = 4000 * 65536
        bench.sample()
        assert bench.chip.pwm == 1
        if software:
            bench.command("RESET")
            assert bench.chip.next_tick > bench.tick + 2 * SAMPLE_TICKS
        else:
            bench.chip.set_reset(bench.tick, 0)
            assert bench.chip.next_tick == NEVER_TICK
        assert (bench.chip.pwm, bench.chip.sign, bench.chip.pwm_magnitude, bench.chip.hi) == (0, 0, 0, 0)
