"""Moves that a host learns of by HI: several flags pending, flags that rise while they are masked, the end of HI."""

import pytest

from tests.robot.lm629.drivers.driver import BREAKPOINT, COMPLETE, ERROR, EXCESS, everywhere, outcomes

INTERRUPTS = COMPLETE | EXCESS | BREAKPOINT


class Interrupts:
    """A host's routine for HI. Flags are noted, and reset, one at a time."""

    def __init__(self, driver, edge_triggered):
        self.driver = driver
        self.edge_triggered = edge_triggered
        self.mask = 0
        self.noted = []

    def command(self, name, *words):
        """Commands longer than two words are sent with all interrupts masked."""
        if len(words) > 2 and self.mask:
            self.driver.command("MSKI", 0)
            self.driver.command(name, *words)
            self.driver.command("MSKI", self.mask)
        else:
            self.driver.command(name, *words)
        self.driver.ready()
        self.serve()

    def enable(self, mask):
        self.mask = mask
        self.command("MSKI", mask)

    def serve(self):
        while self.driver.chip.hi:
            status = self.driver.status() & self.mask
            flag = status & -status
            self.noted.append(flag)
            self.driver.command("RSTI", 0x7E & ~flag)
            self.driver.ready()

    def until(self, flag):
        """Waits, and meanwhile loads filters and trajectories that are not started."""
        for number in range(60):
            if flag in self.noted:
                return
            if number % 2:
                self.command("LTRJ", 0x000A, 0, 0x8000, 0, number)
            else:
                self.command("LFIL", 0x000F, number, 0, 0, 0)
            self.driver.wait(700)
            self.serve()


def move_and_return(driver):
    """Half way a breakpoint, then completion; back home with a position alone. Returns what was noted."""
    host = Interrupts(driver, False)
    host.command("RSTI", 0x7E & ~INTERRUPTS)
    host.enable(COMPLETE | EXCESS)
    host.command("RSTI", 0x7E & ~(COMPLETE | EXCESS))
    host.command("LTRJ", 0x002A, 0, 0x8000, 4, 0, 0, 60)
    host.command("STT")
    driver.position("SBPA", 30)
    host.command("RSTI", 0x7E & ~BREAKPOINT)
    host.enable(INTERRUPTS)
    host.until(COMPLETE)
    noted = tuple(host.noted)
    arrived = driver.ask("RDDP")
    host.noted.clear()
    host.command("LTRJ", 0x000A, 4, 0, 0, 0)
    host.command("STT")
    host.until(COMPLETE)
    return noted, arrived, tuple(host.noted), driver.ask("RDDP"), driver.status() & ERROR


def two_pending(driver):
    """Breakpoint and completion are pending; the host resets one, then the other. Returns flags and HI after each."""
    driver.command("MSKI", BREAKPOINT | COMPLETE)
    driver.position("SBPA", 3)
    driver.start(0x002A, 0x8000, 0x20000, 5, samples=15)
    steps = [(driver.status(), driver.chip.hi)]
    for kept in (0x7A, 0x3A):
        driver.command("RSTI", kept)
        driver.ready()
        steps.append((driver.status(), driver.chip.hi, driver.signals() >> 15))
    return tuple(steps)


def risen_while_masked(driver):
    driver.command("MSKI", 0)
    driver.start(0x002A, 0x8000, 0x20000, 5, samples=15)
    masked = driver.chip.hi
    driver.command("MSKI", COMPLETE)
    driver.ready()
    return masked, driver.chip.hi


def right_after_rsti(driver):
    """RSTI by a routine that returns when it has written the last byte. Returns HI then, and when the chip is free."""
    driver.start(0x002A, 0x8000, 0x20000, 5, samples=15)
    driver.command("RSTI", 0)
    while_busy = driver.chip.hi
    driver.ready()
    return while_busy, driver.chip.hi


@pytest.mark.slow
def test_a_move_with_breakpoint_and_completion_notes_each_once_and_in_order():
    result = ((BREAKPOINT, COMPLETE), 60, (COMPLETE,), 0, 0)
    assert outcomes(move_and_return) == everywhere(result)


def test_of_two_pending_flags_the_second_still_interrupts_when_the_first_is_reset():
    assert outcomes(two_pending) == everywhere(((0x44, 1), (0x40, 1, 1), (0x00, 0, 0)))


def test_a_flag_that_rose_while_it_was_masked_interrupts_when_it_is_unmasked():
    assert outcomes(risen_while_masked) == everywhere((0, 1))
    assert outcomes(risen_while_masked, interrupt="event") == everywhere((0, 0))


@pytest.mark.parametrize(("falls", "while_busy"), [("busy", 1), ("latch", 0)])
def test_hi_falls_at_the_end_of_rstis_busy_time(falls, while_busy):
    assert outcomes(right_after_rsti, hi_falls=falls) == everywhere((while_busy, 0))
